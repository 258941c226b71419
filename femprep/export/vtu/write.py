"""A volume mesh to VTK's ``.vtu``: points and volume cells; tagged facets and names as field data."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.errors import InputError
from femprep.export.deck.names import facet_names, region_names
from femprep.export.purkinje import purkinje_fields
from femprep.export.vtk.polydata import planes_record
from femprep.export.vtk.xml import add_arrays, add_record, save, vtk_cells, vtk_points
from femprep.model import VolumeMesh
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
#: How field data are called that hold facets, and data on facets.
FACETS, FACET_DATA = "facets_", "facet_data_"


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.vtu``; lengths stay in mm."""
    save(unstructured_grid(mesh, shared=True), folder / f"{stem}.vtu")


def unstructured_grid(mesh: VolumeMesh, *, shared: bool = False) -> Any:
    """The mesh as a VTK grid.

    Cell data ``region``; field data one ``[tag, dimension]`` per name, as Gmsh and meshio keep names; the facets as
    field data too, so that one file is the whole mesh and every reader still finds volume cells alone. Where
    ``shared``, the grid has the mesh's own arrays, to be read only.

    Raises
    ------
    InputError
        Data are called ``region``.
    """
    out = bare_grid(mesh, shared=shared)
    if "region" in mesh.cell_data:
        raise InputError("cell data 'region' would hide the region tags; give it another name")
    add_arrays(out.GetCellData(), {"region": mesh.region, **mesh.cell_data}, "cell data", shared=shared)
    add_arrays(out.GetPointData(), mesh.point_data, "point data", shared=shared)
    names = {name: np.array([tag, 3], np.int32) for name, tag in region_names(mesh).items()}
    names |= {name: np.array([tag, 2], np.int32) for name, tag in facet_names(mesh).items()}
    facets = {FACETS + kind: block for kind, block in mesh.facets.items()}
    data = {FACET_DATA + name: values for name, values in {"facet_tag": mesh.facet_tag, **mesh.facet_data}.items()}
    net, told = purkinje_fields(mesh.purkinje) if mesh.purkinje is not None else ({}, {})
    add_arrays(out.GetFieldData(), {**names, **facets, **data, **net}, "field data")
    record = {"planes": planes_record(mesh.planes), "info": dict(mesh.info), **told}
    add_record(out, {**record, "cells": list(mesh.cells), "facets": list(mesh.facets)})
    return out


def bare_grid(mesh: VolumeMesh, *, shared: bool = False) -> Any:
    """Points and volume cells of the mesh as a VTK grid, without any data."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid

    types = [np.full(len(block), VTK_TYPES[kind], dtype=np.uint8) for kind, block in mesh.cells.items()]
    out = vtkUnstructuredGrid()
    out.SetPoints(vtk_points(mesh.points, shared=shared))
    kinds = np.concatenate([np.empty(0, dtype=np.uint8), *types])
    out.SetCells(numpy_to_vtk(kinds, deep=True), vtk_cells(list(mesh.cells.values())))
    return out
