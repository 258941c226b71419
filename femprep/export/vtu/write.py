"""A volume mesh to and from VTK's ``.vtu``: points and volume cells; tagged facets and names as field data."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.errors import FileError, InputError
from femprep.export.foreign import Block, ForeignMesh
from femprep.export.names import facet_names, region_names
from femprep.export.polydata import planes_from, planes_record
from femprep.export.vtk_xml import add_arrays, add_record, arrays_of, load, record_of, save, vtk_cells, vtk_points
from femprep.mesh.elements import ELEMENTS, FACET_TYPES
from femprep.model import FloatArray, IntArray, VolumeMesh
from femprep.options import ExportOptions

log = logging.getLogger(__name__)

#: VTK's numbers of the cell types (vtkCellType.h).
VTK_TYPES: Final = {
    "triangle": 5,
    "quad": 9,
    "tetra": 10,
    "hexahedron": 12,
    "wedge": 13,
    "triangle6": 22,
    "quad8": 23,
    "tetra10": 24,
    "hexahedron20": 25,
    "wedge15": 26,
}
_FACETS, _FACET_DATA = "facets_", "facet_data_"


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.vtu``; lengths stay in mm."""
    save(unstructured_grid(mesh), folder / f"{stem}.vtu")


def unstructured_grid(mesh: VolumeMesh) -> Any:
    """The mesh as a VTK grid.

    Cell data ``region``; field data one ``[tag, dimension]`` per name, as Gmsh and meshio keep names; the facets as
    field data too, so that one file is the whole mesh and every reader still finds volume cells alone.

    Raises
    ------
    InputError
        Data are called ``region``, or are no numbers.
    """
    out = bare_grid(mesh)
    if "region" in mesh.cell_data:
        raise InputError("cell data 'region' would hide the region tags; give it another name")
    add_arrays(out.GetCellData(), {"region": mesh.region, **mesh.cell_data}, "cell data")
    add_arrays(out.GetPointData(), mesh.point_data, "point data")
    names = {name: np.array([tag, 3], np.int32) for name, tag in region_names(mesh).items()}
    names |= {name: np.array([tag, 2], np.int32) for name, tag in facet_names(mesh).items()}
    facets = {_FACETS + kind: block for kind, block in mesh.facets.items()}
    data = {_FACET_DATA + name: values for name, values in {"facet_tag": mesh.facet_tag, **mesh.facet_data}.items()}
    add_arrays(out.GetFieldData(), {**names, **facets, **data}, "field data")
    record = {"planes": planes_record(mesh.planes), "info": dict(mesh.info)}
    add_record(out, {**record, "cells": list(mesh.cells), "facets": list(mesh.facets)})
    return out


def bare_grid(mesh: VolumeMesh) -> Any:
    """Points and volume cells of the mesh as a VTK grid, without any data."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid

    types = [np.full(len(block), VTK_TYPES[kind], dtype=np.uint8) for kind, block in mesh.cells.items()]
    out = vtkUnstructuredGrid()
    out.SetPoints(vtk_points(mesh.points))
    kinds = np.concatenate([np.empty(0, dtype=np.uint8), *types])
    out.SetCells(numpy_to_vtk(kinds, deep=True), vtk_cells(list(mesh.cells.values())))
    return out


def read_own(path: Path) -> VolumeMesh | None:
    """A mesh from a ``.vtu`` of ours, every array as it was; ``None`` for anyone else's file.

    Raises
    ------
    FileError
        The file is damaged.
    """
    import pyvista
    from vtkmodules.util.numpy_support import vtk_to_numpy

    grid = load(path)
    fields = arrays_of(grid.GetFieldData())
    record = record_of(fields)
    if "cells" not in record:
        return None
    nodes = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    kinds = pyvista.UnstructuredGrid(grid).celltypes
    cells, first = {}, 0
    for kind in record["cells"]:
        size = ELEMENTS[kind].nodes
        count = int(np.sum(kinds == VTK_TYPES[kind]))
        cells[kind] = nodes[first : first + count * size].reshape(count, size)
        first += count * size
    cell = arrays_of(grid.GetCellData())
    return VolumeMesh(
        points=vtk_to_numpy(grid.GetPoints().GetData()),
        cells=cells,
        region=cell.pop("region"),
        facets={kind: fields[_FACETS + kind].reshape(-1, _facet_size(kind)) for kind in record["facets"]},
        facet_tag=fields[_FACET_DATA + "facet_tag"],
        cell_data=cell,
        point_data=arrays_of(grid.GetPointData()),
        facet_data={
            name.removeprefix(_FACET_DATA): values
            for name, values in fields.items()
            if name.startswith(_FACET_DATA) and name != _FACET_DATA + "facet_tag"
        },
        planes=planes_from(record["planes"]),
        info=record["info"],
    )


def _facet_size(kind: str) -> int:
    return next(size for size, name in FACET_TYPES.items() if name == kind)


def read_foreign(path: Path) -> ForeignMesh:
    """Blocks and arrays of anyone's ``.vtu`` or ``.vtk`` file, read by VTK, one block per cell type.

    Raises
    ------
    FileError
        The file is damaged, or no unstructured grid.
    """
    import pyvista
    from vtkmodules.util.numpy_support import vtk_to_numpy

    grid = load(path)
    if not grid.IsA("vtkUnstructuredGrid"):
        raise FileError(f"{str(path)!r} holds a {grid.GetClassName()}; give an unstructured grid of volume elements")
    kinds = pyvista.UnstructuredGrid(grid).celltypes
    offsets = vtk_to_numpy(grid.GetCells().GetOffsetsArray())
    nodes = vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    names = {number: name for name, number in VTK_TYPES.items()}
    cells, rows = [], []
    for number in np.unique(kinds):
        chosen = np.flatnonzero(kinds == number)
        size = int(offsets[chosen[0] + 1] - offsets[chosen[0]])
        if number in names:
            cells.append((names[number], nodes[offsets[chosen][:, None] + np.arange(size)]))
            rows.append(chosen)
        else:
            log.warning("cells of VTK type %d are left out", number)
    data = arrays_of(grid.GetCellData())
    points = vtk_to_numpy(grid.GetPoints().GetData()) if grid.GetPoints() else np.empty((0, 3))
    cells = [(kind, _turned(nodes, points) if kind == "wedge" else nodes) for kind, nodes in cells]
    return ForeignMesh(
        points,
        [Block(kind, data) for kind, data in cells],
        point_data=arrays_of(grid.GetPointData()),
        cell_data={name: [values[chosen] for chosen in rows] for name, values in data.items()},
        field_data=arrays_of(grid.GetFieldData()),
    )


def _turned(wedges: IntArray, points: FloatArray) -> IntArray:
    """Wedges that all follow VTK's documentation (0-1-2 outward, as meshio writes them) in VTK's working order.

    VTK's own volumes and shape functions, Abaqus, Gmsh and femprep have 0-1-2 inward. Where only some are negative,
    they are inverted elements and stay.
    """
    a, b, c, top = (points[wedges[:, i]] for i in (0, 1, 2, 3))
    if np.all(np.einsum("ij,ij->i", np.cross(b - a, c - a), top - a) < 0):
        log.info("the wedges have their first triangle outward, as VTK's documentation says: turned")
        return wedges[:, [0, 2, 1, 3, 5, 4]]
    return wedges
