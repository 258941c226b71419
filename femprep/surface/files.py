"""A surface file in (VTK, STL, PLY, OBJ, OFF, openCARP), a Surface out."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from femprep.errors import FileError, InputError
from femprep.mesh.topology import is_closed, is_consistently_wound
from femprep.mesh.vtk.reading import load
from femprep.model import FloatArray, IntArray, Notice, Surface, noted
from femprep.model.units import MILLIMETRES
from femprep.surface.rows import require_rows

_VTK = (".vtp", ".vtk", ".vtu", ".vtm", ".vtkhdf")
_CARP = (".elem", ".pts")
_OTHERS = (".stl", ".ply", ".obj", ".off")

#: Field array of femprep's own files that keeps what VTK has no place for, as UTF-8 bytes of JSON.
RECORD = "femprep_json"


def read_surface(path: str | Path) -> Surface:
    """Read a surface of triangles or quadrilaterals.

    Parameters
    ----------
    path : path
        ``.vtp``, ``.vtu``, ``.vtm``, ``.vtkhdf``, legacy ``.vtk``, ``.stl``, ``.ply``, ``.obj``, ``.off``, or
        openCARP's ``.elem`` with its ``.pts``, which is in micrometres; other lengths are taken as mm, coordinates as
        LPS.

    Returns
    -------
    Surface
        Of a file that femprep wrote the vertex numbering, ``directions``, point data, name and record are those it
        was written with. Other files are merged at equal points (STL repeats them), polygons and strips are cut into
        triangles, and a closed surface wound inward is turned; ``info`` says so. Several solids or blocks become one
        surface: see :func:`femprep.split_surface`.

    Raises
    ------
    FileError
        The file is missing, damaged, of an unknown format or holds no triangles.

    Examples
    --------
    >>> path = fp.write_surface(endo, "lv.vtp")
    >>> fp.read_surface(path)
    Surface('lv': 500 points, 996 triangles)
    """
    path = Path(path)
    suffix = path.suffix.lower()
    known = (*_VTK, *_OTHERS, *_CARP)
    if suffix not in known:
        raise FileError(f"{str(path)!r}: unknown surface format {suffix!r}; expected one of {', '.join(known)}")
    if not path.is_file():
        raise FileError(f"surface file {str(path)!r} does not exist")
    try:
        return (_from_vtk if suffix in _VTK else _from_carp if suffix in _CARP else _from_trimesh)(path)
    except FileError:
        raise
    except InputError as error:
        raise FileError(f"{str(path)!r} holds no sound surface: {error}") from error
    except Exception as error:  # readers raise what they like on damaged files
        raise FileError(f"{str(path)!r} is damaged or no surface: {type(error).__name__}: {error}") from error


def _from_vtk(path: Path) -> Surface:
    import pyvista
    from vtkmodules.vtkCommonDataModel import vtkCellTypeUtilities

    mesh, lost = pyvista.wrap(load(path)), 0
    if isinstance(mesh, pyvista.UnstructuredGrid):
        dimension = np.array([vtkCellTypeUtilities.GetDimension(int(kind)) for kind in mesh.celltypes], dtype=int)
        _require_no_volume(path, int(np.count_nonzero(dimension == 3)))
        lost = int(np.count_nonzero(dimension < 2))
        mesh = mesh.extract_cells(dimension == 2).extract_surface(algorithm="dataset_surface")
    if not isinstance(mesh, pyvista.PolyData):
        raise FileError(f"{str(path)!r} holds {type(mesh).__name__}, expected polygons of a surface")
    lost += mesh.n_verts + mesh.n_lines
    sides = mesh.n_cells - mesh.n_verts - mesh.n_lines
    quads = sides > 0 and mesh.faces.size == 5 * sides and bool(np.all(mesh.faces[::5] == 4))
    cells = mesh.faces.reshape(-1, 5)[:, 1:] if quads else mesh.triangulate().regular_faces
    if len(cells) < sides and mesh.faces.size == 7 * sides:  # svMultiPhysics' quadratic triangles, which VTK cannot cut
        cells = mesh.faces.reshape(-1, 7)[:, [[1, 4, 6], [4, 2, 5], [6, 5, 3], [4, 5, 6]]].reshape(-1, 3)
    elif len(cells) < sides:
        raise FileError(f"{str(path)!r} has {sides} polygons, of which VTK makes {len(cells)} triangles")
    points = np.asarray(mesh.points, dtype=np.float64)
    if RECORD not in mesh.field_data:
        return _foreign(points, np.asarray(cells, dtype=np.int64), path, lost)
    record: dict[str, Any] = json.loads(np.asarray(mesh.field_data[RECORD]).astype(np.uint8).tobytes().decode())
    data = {name: np.array(mesh.point_data[name]) for name in mesh.point_data}
    return Surface(
        points,
        np.asarray(cells, dtype=np.int64),
        name=str(record.get("name", path.stem)),
        directions=data.pop("direction", None),
        point_data=data,
        info=record.get("info", {}),
    )


def _require_no_volume(path: Path, count: int) -> None:
    if count:
        raise FileError(
            f"{str(path)!r} is no surface: it holds {count} volume elements; femprep annotate names the sides of such "
            "a mesh, femprep check judges it"
        )


def _from_carp(path: Path) -> Surface:
    """Triangles and quadrilaterals of openCARP, in mm."""
    for file in (elements := path.with_suffix(".elem"), nodes := path.with_suffix(".pts")):
        if not file.is_file():
            raise FileError(f"{str(file)!r} does not exist; an openCARP mesh is an .elem and a .pts of one name")
    rows = [line.split() for line in elements.read_text(encoding="ascii").splitlines()[1:] if line.strip()]
    corners = {"Tr": 3, "Qd": 4}
    _require_no_volume(path, sum(row[0] not in (*corners, "Ln", "Cx") for row in rows))
    listed = [[int(node) for node in row[1 : 1 + corners[row[0]]]] for row in rows if row[0] in corners]
    cells = [three for row in listed for three in (row[:3], [row[0], *row[2:]])[: len(row) - 2]]
    points = np.loadtxt(nodes, skiprows=1, ndmin=2) * MILLIMETRES["um"]
    return _foreign(points, np.array(cells, dtype=np.int64).reshape(-1, 3), path, len(rows) - len(listed))


def _from_trimesh(path: Path) -> Surface:
    import trimesh

    require_rows(path)
    # From its bytes alone: materials and pictures that it names are not looked for.
    mesh = trimesh.load(io.BytesIO(path.read_bytes()), file_type=path.suffix[1:].lower(), force="mesh", process=False)
    return _foreign(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64), path)


def _foreign(points: FloatArray, cells: IntArray, path: Path, lost: int = 0) -> Surface:
    """An external surface: equal points merged, cells without area dropped with them, outward where closed."""
    if len(cells) == 0:
        raise FileError(f"{str(path)!r} holds no triangles")
    if not np.isfinite(points).all():
        raise FileError(f"{str(path)!r} holds points that are not finite")
    unique, number = np.unique(points, axis=0, return_inverse=True)
    merged = number.ravel()[cells]
    ordered = np.sort(merged, axis=1)
    kept = np.all(ordered[:, 1:] != ordered[:, :-1], axis=1)
    merged = merged[kept]
    if len(merged) == 0:
        raise FileError(f"{str(path)!r} holds no triangle with three different corners")
    used, merged = np.unique(merged, return_inverse=True)
    merged = merged.reshape(-1, cells.shape[1])
    closed = is_closed(merged) and is_consistently_wound(merged)
    surface = Surface(unique[used], merged, name=path.stem)
    turned = closed and surface.volume < 0.0
    info = {
        "source": path.name,
        "merged_points": len(points) - len(used),
        "dropped_cells": int(np.count_nonzero(~kept)),
        "turned_outward": turned,
    }
    if lost:
        info = noted(info, Notice.of("left out", f"{lost} points and lines of {path.name}"))
    return Surface(unique[used], merged[:, ::-1] if turned else merged, name=path.stem, info=info)
