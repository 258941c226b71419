"""A volume mesh to svMultiPhysics: a ``mesh-complete`` folder of VTK files, faces with global numbers, fibres."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from femprep.export.deck.fibres import directions
from femprep.export.deck.names import facet_names, region_names
from femprep.export.deck.springs import has_pericardium, per_millimetre
from femprep.export.deck.units import UNITS
from femprep.export.svmultiphysics.step import ORIGIN, PERICARDIUM, origin_of, write_step
from femprep.export.vtk.polydata import polydata
from femprep.export.vtk.xml import add_arrays, add_record, save
from femprep.export.vtu.write import bare_grid
from femprep.mesh.elements import match_facets
from femprep.mesh.length_unit import UNIT
from femprep.mesh.measures.triangles import normals
from femprep.model import VolumeMesh, verdict_of
from femprep.model.blocks import chosen_rows, nodes_of
from femprep.model.verdict import VERDICT
from femprep.options import ExportOptions
from femprep.wall import cavity_surface, open_cavities


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Fill ``folder`` with a mesh as svMultiPhysics and SimVascular know it.

    ``mesh-complete.mesh.vtu`` carries ``GlobalNodeID`` and ``GlobalElementID`` (from 1) and ``DOMAIN_ID`` (the region
    tag), and names of regions as field data; ``mesh-surfaces/<tag>.vtp`` the facets of each tag with the same numbers;
    ``fibersLong.vtu`` and ``fibersSheet.vtu`` the cell array ``FIB_DIR``. ``caps/<cavity>.vtp`` closes a cavity for the
    coupling with a model of the circulation (``Chamber_cap_surface``); ``pericardium.vtp`` is the epicardium with the
    stiffness of its springs. With a step there are ``inflation.xml``, to be run in the folder, and ``inflation.dat``,
    or ``inflation_<cavity>.dat`` where pressures differ by cavity.
    """
    origin = origin_of(mesh, options)
    scaled = replace(mesh, points=(mesh.points - origin) * UNITS[options.length_unit].per_mm)
    grid = bare_grid(scaled)
    nodes = {"GlobalNodeID": _counted(len(mesh.points)), **mesh.point_data}
    add_arrays(grid.GetPointData(), nodes, "point data")
    ids = {"GlobalElementID": _counted(mesh.n_cells), "DOMAIN_ID": mesh.region, "ModelRegionID": mesh.region}
    add_arrays(grid.GetCellData(), {**ids, **mesh.cell_data}, "cell data")
    names = {name: _numbers(np.array([tag, 3])) for name, tag in region_names(mesh).items()}
    add_arrays(grid.GetFieldData(), names, "field data")
    record = {UNIT: options.length_unit, **({VERDICT: verdict} if (verdict := verdict_of(mesh)) else {})}
    if origin.any():
        record[ORIGIN] = (origin * UNITS[options.length_unit].per_mm).tolist()
    add_record(grid, record)  # by which the folder is known as ours
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
    caps = folder / "caps"
    for name in open_cavities(mesh):
        caps.mkdir(exist_ok=True)
        save(_cap(scaled, name), caps / f"{name}.vtp")
    if has_pericardium(mesh):
        save(_robin(scaled, element, options), folder / PERICARDIUM)
    if options.step != "none":
        write_step(mesh, folder, options)


def _numbers(values: np.ndarray) -> np.ndarray:
    """Numbers as svMultiPhysics reads them: of 32 bits; it takes others for missing."""
    return np.asarray(values, dtype=np.int32)


def _counted(count: int) -> np.ndarray:
    return _numbers(np.arange(1, count + 1))


def _face(mesh: VolumeMesh, tag: int, element: np.ndarray) -> Any:
    chosen = mesh.facet_tag == tag
    blocks = chosen_rows(mesh.facets, chosen)
    used = nodes_of(blocks)
    out = polydata(mesh.points[used], [np.searchsorted(used, block) for block in blocks.values()])
    add_arrays(out.GetPointData(), {"GlobalNodeID": _numbers(used + 1)}, "point data")
    ids = {"GlobalElementID": _numbers(element[chosen] + 1), "ModelFaceID": mesh.facet_tag[chosen]}
    add_arrays(out.GetCellData(), ids, "cell data")
    return out


def _cap(mesh: VolumeMesh, name: str) -> Any:
    """The flat triangles over the openings of a cavity, over nodes of the mesh, wound as its endocardium is."""
    surface = cavity_surface(mesh, name)
    cap = surface.triangles[-surface.info["cap_triangles"] :, ::-1]
    used = np.unique(cap)
    out = polydata(surface.points[used], [np.searchsorted(used, cap)])
    add_arrays(out.GetPointData(), {"GlobalNodeID": _numbers(surface.point_data["GlobalNodeID"][used])}, "point data")
    ids = {"GlobalElementID": _counted(len(cap)), "Normals": normals(surface.points, cap)}
    add_arrays(out.GetCellData(), ids, "cell data")
    return out


def _robin(mesh: VolumeMesh, element: np.ndarray, options: ExportOptions) -> Any:
    """The epicardium with the stiffness of the pericardium, as a Robin boundary condition takes it."""
    tag = facet_names(mesh)["epi"]
    out = _face(mesh, tag, element)
    used = nodes_of(chosen_rows(mesh.facets, mesh.facet_tag == tag))
    stiffness = np.asarray(mesh.point_data["pericardium"], dtype=np.float64)[used] * per_millimetre(options)
    add_arrays(out.GetPointData(), {"Stiffness": stiffness, "Damping": np.zeros(len(used))}, "point data")
    return out


def _fibres(mesh: VolumeMesh, vectors: np.ndarray) -> Any:
    grid = bare_grid(mesh)
    add_arrays(grid.GetCellData(), {"FIB_DIR": vectors}, "cell data")
    return grid
