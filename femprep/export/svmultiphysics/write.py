"""A volume mesh to svMultiPhysics: a ``mesh-complete`` folder of VTK files, faces with global numbers, fibres."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from femprep.export.fibres import directions
from femprep.export.names import facet_names
from femprep.export.polydata import polydata
from femprep.export.units import UNITS
from femprep.export.vtk_xml import add_arrays, add_record, save
from femprep.export.vtu.write import bare_grid
from femprep.mesh.elements import match_facets
from femprep.model import VolumeMesh, verdict_of
from femprep.model.blocks import chosen_rows, nodes_of
from femprep.model.verdict import VERDICT
from femprep.options import ExportOptions


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Fill ``folder`` with a mesh as svMultiPhysics and SimVascular know it.

    ``mesh-complete.mesh.vtu`` carries ``GlobalNodeID`` and ``GlobalElementID`` (from 1) and ``DOMAIN_ID`` (the
    region tag); ``mesh-surfaces/<tag>.vtp`` the facets of each tag with the same numbers;
    ``fibersLong.vtu`` and ``fibersSheet.vtu`` the cell array ``FIB_DIR``.
    """
    scaled = replace(mesh, points=mesh.points * UNITS[options.length_unit].per_mm)
    grid = bare_grid(scaled)
    nodes = {"GlobalNodeID": np.arange(1, len(mesh.points) + 1), **mesh.point_data}
    add_arrays(grid.GetPointData(), nodes, "point data")
    ids = {"GlobalElementID": np.arange(1, mesh.n_cells + 1), "DOMAIN_ID": mesh.region, "ModelRegionID": mesh.region}
    add_arrays(grid.GetCellData(), {**ids, **mesh.cell_data}, "cell data")
    if verdict := verdict_of(mesh):
        add_record(grid, {VERDICT: verdict})
    save(grid, folder / "mesh-complete.mesh.vtu")
    (folder / "mesh-surfaces").mkdir()
    element, _ = match_facets(mesh.cells, mesh.facets)
    for name, tag in facet_names(mesh).items():
        save(_face(scaled, tag, element), folder / "mesh-surfaces" / f"{name}.vtp")
    found = directions(mesh)
    if found is not None:
        save(_fibres(scaled, found[0]), folder / "fibersLong.vtu")
        if "sheet" in mesh.cell_data:
            save(_fibres(scaled, found[1]), folder / "fibersSheet.vtu")


def _face(mesh: VolumeMesh, tag: int, element: np.ndarray) -> Any:
    chosen = mesh.facet_tag == tag
    blocks = chosen_rows(mesh.facets, chosen)
    used = nodes_of(blocks)
    out = polydata(mesh.points[used], [np.searchsorted(used, block) for block in blocks.values()])
    add_arrays(out.GetPointData(), {"GlobalNodeID": used + 1}, "point data")
    ids = {"GlobalElementID": element[chosen] + 1, "ModelFaceID": mesh.facet_tag[chosen]}
    add_arrays(out.GetCellData(), ids, "cell data")
    return out


def _fibres(mesh: VolumeMesh, vectors: np.ndarray) -> Any:
    grid = bare_grid(mesh)
    add_arrays(grid.GetCellData(), {"FIB_DIR": vectors}, "cell data")
    return grid
