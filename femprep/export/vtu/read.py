"""A ``.vtu`` of ours, or anyone's ``.vtu`` or ``.vtk``, in; a volume mesh, or its blocks and arrays, out."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from femprep.export.deck.unread import no_elements
from femprep.export.foreign import Block, ForeignMesh
from femprep.export.purkinje import purkinje_from
from femprep.export.vtk.polydata import planes_from
from femprep.export.vtk.xml import arrays_of, record_of
from femprep.export.vtu.write import FACET_DATA, FACETS, VTK_TYPES
from femprep.export.wedges import turned_wedges
from femprep.mesh.elements import ELEMENTS, FACET_TYPES
from femprep.mesh.vtk.reading import load
from femprep.model import VolumeMesh


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
        facets={kind: fields[FACETS + kind].reshape(-1, _facet_size(kind)) for kind in record["facets"]},
        facet_tag=fields[FACET_DATA + "facet_tag"],
        cell_data=cell,
        point_data=arrays_of(grid.GetPointData()),
        facet_data={
            name.removeprefix(FACET_DATA): values
            for name, values in fields.items()
            if name.startswith(FACET_DATA) and name != FACET_DATA + "facet_tag"
        },
        planes=planes_from(record["planes"]),
        info=record["info"],
        purkinje=purkinje_from(fields, record),
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
        raise no_elements(["triangle" if grid.IsA("vtkPolyData") else grid.GetClassName()])
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
        else:  # named alone, for what is left out to be told
            cells.append((_name_of(int(number)), np.empty((len(chosen), 0), dtype=np.int64)))
            rows.append(chosen)
    data, fields = arrays_of(grid.GetCellData()), grid.GetFieldData()
    # Named alone as well: they are no numbers.
    texts = {fields.GetArrayName(i) or f"array_{i}": np.empty(0) for i in range(fields.GetNumberOfArrays())}
    points = vtk_to_numpy(grid.GetPoints().GetData()) if grid.GetPoints() else np.empty((0, 3))
    cells = [(kind, turned_wedges(nodes, points) if kind == "wedge" else nodes) for kind, nodes in cells]
    return ForeignMesh(
        points,
        [Block(kind, data) for kind, data in cells],
        point_data=arrays_of(grid.GetPointData()),
        cell_data={name: [values[chosen] for chosen in rows] for name, values in data.items()},
        field_data={**texts, **arrays_of(fields)},
    )


def _name_of(number: int) -> str:
    """VTK's name of a cell type that femprep does not have."""
    import pyvista

    try:
        return str(pyvista.CellType(number).name).lower()
    except ValueError:
        return f"VTK type {number}"
