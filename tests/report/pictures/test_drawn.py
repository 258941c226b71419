"""A page of a large mesh draws a part of it, and shows the same as the whole at the surface and at its cuts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from meshes import mixed, truncated_ellipsoid

from femprep.mesh.elements import ELEMENTS, boundary_faces
from femprep.model import BoolArray, VolumeMesh
from femprep.model.blocks import chosen_rows
from femprep.report.pictures.drawn import drawn
from femprep.report.pictures.scene import moving_scene
from femprep.report.pictures.shown import shown
from femprep.volume import check

AXES = np.eye(3)


def large(kind: str) -> VolumeMesh:
    if kind == "mixed":
        return mixed()
    mesh = truncated_ellipsoid(kind, heights=12, around=36, layers=6)
    return mesh.with_data(cell={"aha": 1 + np.arange(mesh.n_cells) * 4 // mesh.n_cells})


def faces_of(mesh: VolumeMesh, kept: BoolArray, numbers: np.ndarray) -> set[tuple[int, ...]]:
    """Boundary faces of some elements, by the whole mesh's numbers of their corners."""
    found = boundary_faces(chosen_rows(mesh.cells, kept))
    return {tuple(sorted(numbers[row].tolist())) for faces in found.values() for row in faces.nodes}


@pytest.mark.parametrize("kind", ["tetra", "wedge", "hexahedron", "mixed"])
def test_the_part_shows_what_the_whole_shows(kind: str) -> None:
    mesh = large(kind)
    found = drawn(mesh, AXES, [5], most=10)
    part, every, own = found.mesh, np.arange(len(mesh.points)), found.nodes
    assert 5 in found.elements
    assert part.n_facets == mesh.n_facets
    assert np.array_equal(part.points, mesh.points[own])
    whole = faces_of(mesh, np.ones(mesh.n_cells, dtype=bool), every)
    assert whole <= faces_of(part, np.ones(part.n_cells, dtype=bool), own)
    centre = np.concatenate([mesh.points[b[:, : ELEMENTS[k].corners]].mean(axis=1) for k, b in mesh.cells.items()])
    sides = [mesh.region == mesh.region[0]]
    for axis in AXES:
        height = mesh.points @ axis
        sides += [centre @ axis <= height.min() + share * np.ptp(height) for share in found.cuts]
    for kept in sides:
        cut = faces_of(mesh, kept, every) - whole
        assert cut
        assert cut <= faces_of(part, kept[found.elements], own)


def test_a_part_is_smaller_and_a_small_mesh_is_whole() -> None:
    mesh = truncated_ellipsoid("hexahedron", heights=30, around=90, layers=20)
    assert drawn(mesh, AXES, [], most=mesh.n_cells).mesh is mesh
    found = drawn(mesh, AXES, [], most=mesh.n_cells - 1)
    assert found.mesh.n_cells < mesh.n_cells
    assert 0.5 in found.cuts


def test_phases_of_a_large_mesh_move_the_same_part() -> None:
    mesh = truncated_ellipsoid("tetra", heights=48, around=120, layers=8)
    other = replace(mesh, points=0.9 * mesh.points)
    views, quality = [shown(one) for one in (mesh, other)], check(mesh)
    found = moving_scene(views, [quality, quality], ["ed", "es"], 0)
    assert str(mesh.n_cells) in found["note"]
    assert len(found["phases"]) == 2
    count = drawn(mesh, found["axes"], [one.element for one in quality.worst]).mesh.n_cells
    assert max(one["element"] for one in found["phases"][1]["worst"]) < count < mesh.n_cells
