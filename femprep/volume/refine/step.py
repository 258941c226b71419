"""One level of refinement the whole way: cut, put onto the surfaces, improved, its data carried along."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from femprep.mesh.elements import ELEMENTS
from femprep.mesh.quadratic import add_middles, number_edges
from femprep.model import IntArray, TagArray, VolumeMesh, frozen
from femprep.volume.optimise import optimise
from femprep.volume.pericardium import springs_renewed
from femprep.volume.refine.boundary import constraints_of, moved_onto
from femprep.volume.refine.fields import carried
from femprep.volume.refine.level import cut_cells, cut_facets, number_nodes
from femprep.volume.refine.sheets import Sheets, membership, placed


@dataclass
class State:
    """A mesh between two levels: the sheet of each facet, and faces that hold their nodes though they are no facets."""

    mesh: VolumeMesh
    of_facet: IntArray
    held: IntArray


def step(
    state: State, sheets: Sheets, corners: bool, improve: bool, poor: float
) -> tuple[State, dict[str, TagArray], dict[str, Any]]:
    """One level: cut, put onto the sheets, improve; the corners there were are put onto the sheets too where asked."""
    mesh = state.mesh
    facets = _with_held(mesh.facets, state.held)
    numbered = number_nodes(mesh.points, mesh.cells, facets)
    fine_facets, fine_held, of_facet = _cut_facets(numbered.facets, mesh, state)
    on = membership(_with_held(fine_facets, fine_held), np.concatenate([of_facet, np.full(len(fine_held), -1)]), sheets)
    first = 0 if corners else len(mesh.points)
    rows = on.nodes >= first
    places = placed(numbered.middles[on.nodes], on, sheets, rows)
    target = numbered.middles.copy()
    target[on.nodes] = places
    cells, ways = cut_cells(target, numbered.lattice)
    points, short, gap = moved_onto(numbered.middles, on.nodes, places, cells)
    record: dict[str, Any] = {"elements": sum(map(len, cells.values())), "held_back": short}
    record["greatest_distance_from_surface_mm"] = gap
    if improve:
        bound = constraints_of(len(points), cells["tetra"], on, sheets)
        outcome = optimise(points, cells["tetra"], bound, poor=poor)
        points = outcome.points
        record |= {**outcome.record(), "greatest_distance_from_surface_mm": outcome.off_wall}
    fine = VolumeMesh(
        frozen(points),
        {name: frozen(block) for name, block in cells.items()},
        np.repeat(mesh.region, 8),
        fine_facets,
        np.repeat(mesh.facet_tag, 4),
        cell_data={name: np.repeat(values, 8, axis=0) for name, values in mesh.cell_data.items()},
        facet_data={name: np.repeat(values, 4, axis=0) for name, values in mesh.facet_data.items()},
        planes=mesh.planes,
        info=mesh.info,
    )
    if any(ELEMENTS[name].quadratic for name in mesh.cells):
        fine, fine_held = _curved(fine, fine_held, sheets, of_facet)
    fine = springs_renewed(carried(mesh, fine, ways))
    return State(fine, of_facet, fine_held), ways, record


def _curved(mesh: VolumeMesh, held: IntArray, sheets: Sheets, of_facet: IntArray) -> tuple[VolumeMesh, IntArray]:
    """A mesh of linear elements, and faces of it, with mid-side nodes, those of the boundary on its sheets."""
    edges = number_edges(mesh)
    middle = 0.5 * (mesh.points[edges.ends[:, 0]] + mesh.points[edges.ends[:, 1]])
    sides = {kind: edges.find(nodes, np.roll(nodes, -1, axis=1)) for kind, nodes in mesh.facets.items()}
    at = membership(sides, of_facet, sheets)
    curved = middle.copy()
    curved[at.nodes] = placed(middle[at.nodes], at, sheets, np.ones(len(at.nodes), dtype=np.bool_))
    sides_held = edges.find(held, np.roll(held, -1, axis=1))
    return add_middles(mesh, edges, curved)[0], np.concatenate([held, edges.total + sides_held], axis=1)


def _with_held(facets: Any, held: IntArray) -> dict[str, IntArray]:
    """Facets by type, with those that only hold their nodes after the triangles."""
    out = dict(facets)
    if len(held):
        kind = "triangle" if held.shape[1] == 3 else "triangle6"
        tagged = out.get(kind, np.empty((0, held.shape[1]), dtype=np.int64))
        out[kind] = np.concatenate([tagged, held])
    return out


def _cut_facets(
    rings: dict[str, IntArray], mesh: VolumeMesh, state: State
) -> tuple[dict[str, IntArray], IntArray, IntArray]:
    """The facets' children, those of the faces that hold their nodes, and the sheets of the first."""
    fine = cut_facets(rings)
    held = np.empty((0, 3), dtype=np.int64)
    if len(state.held):
        tagged = len(fine["triangle"]) - 4 * len(state.held)
        held, fine["triangle"] = fine["triangle"][tagged:], fine["triangle"][:tagged]
    # Where nothing is tagged the faces that hold their nodes were all there was.
    fine = {kind: nodes for kind, nodes in fine.items() if len(nodes) or len(mesh.facets)}
    return fine, held, np.repeat(state.of_facet, 4)
