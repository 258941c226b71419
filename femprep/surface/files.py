"""A surface file in (.vtp, .vtk, .stl, .ply, .obj, .off), a Surface out."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import numpy as np

from femprep.errors import FileError, InputError
from femprep.mesh.topology import is_closed, is_consistently_wound
from femprep.mesh.vtk.reading import load
from femprep.model import FloatArray, IntArray, Surface
from femprep.surface.rows import require_rows

_VTK = (".vtp", ".vtk")
_OTHERS = (".stl", ".ply", ".obj", ".off")

#: Field array of femprep's own files that keeps what VTK has no place for, as UTF-8 bytes of JSON.
RECORD = "femprep_json"


def read_surface(path: str | Path) -> Surface:
    """Read a surface of triangles or quadrilaterals.

    Parameters
    ----------
    path : path
        ``.vtp``, legacy ``.vtk``, ``.stl``, ``.ply``, ``.obj`` or ``.off``; lengths are taken as mm, coordinates as
        LPS.

    Returns
    -------
    Surface
        Of a file that femprep wrote the vertex numbering, ``directions``, point data, name and record are those it
        was written with. Other files are merged at equal points (STL repeats them), polygons are cut into
        triangles, and a closed surface wound inward is turned; ``info`` says so.

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
    if suffix not in _VTK + _OTHERS:
        raise FileError(
            f"{str(path)!r}: unknown surface format {suffix!r}; expected one of {', '.join(_VTK + _OTHERS)}"
        )
    if not path.is_file():
        raise FileError(f"surface file {str(path)!r} does not exist")
    try:
        return _from_vtk(path) if suffix in _VTK else _from_trimesh(path)
    except FileError:
        raise
    except InputError as error:
        raise FileError(f"{str(path)!r} holds no sound surface: {error}") from error
    except Exception as error:  # readers raise what they like on damaged files
        raise FileError(f"{str(path)!r} is damaged or no surface: {type(error).__name__}: {error}") from error


def _from_vtk(path: Path) -> Surface:
    import pyvista

    mesh = pyvista.wrap(load(path))
    if not isinstance(mesh, pyvista.PolyData):
        raise FileError(f"{str(path)!r} holds {type(mesh).__name__}, expected polygons of a surface")
    points = np.asarray(mesh.points, dtype=np.float64)
    quads = mesh.n_cells > 0 and mesh.faces.size == 5 * mesh.n_cells and bool(np.all(mesh.faces[::5] == 4))
    cells = mesh.faces.reshape(-1, 5)[:, 1:] if quads else mesh.triangulate().regular_faces
    if RECORD not in mesh.field_data:
        return _foreign(points, np.asarray(cells, dtype=np.int64), path)
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


def _from_trimesh(path: Path) -> Surface:
    import trimesh

    require_rows(path)
    # From its bytes alone: materials and pictures that it names are not looked for.
    mesh = trimesh.load(io.BytesIO(path.read_bytes()), file_type=path.suffix[1:].lower(), force="mesh", process=False)
    return _foreign(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64), path)


def _foreign(points: FloatArray, cells: IntArray, path: Path) -> Surface:
    """Somebody else's surface: equal points merged, cells without area dropped with them, outward where closed."""
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
    return Surface(unique[used], merged[:, ::-1] if turned else merged, name=path.stem, info=info)
