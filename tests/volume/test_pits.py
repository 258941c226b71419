"""A pit that reaches through a thin wall in one point is filled; what else touches in a point is left alone."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import truncated_ellipsoid

from femprep.mesh.elements import boundary_faces
from femprep.mesh.measures.volume_elements import element_volumes
from femprep.mesh.topology import is_manifold
from femprep.model import FACET_TAGS, Wall
from femprep.volume import check, runs, tetrahedralize
from femprep.volume.pits import without_pits
from femprep.volume.tetwild.guard import TetwildRun

ENDO, EPI = FACET_TAGS["endo"], FACET_TAGS["epi"]


@pytest.fixture(scope="module")
def body():
    """A wall one element thick, and what it fills."""
    mesh = truncated_ellipsoid("tetra", heights=6, around=24, layers=1, lean=0.0)
    nodes = mesh.facets["triangle"]
    wall = Wall(mesh.points, nodes, mesh.facet_tag, np.full(len(mesh.points), -1), mesh.planes)
    return mesh, wall


@pytest.fixture(scope="module", params=["endo", "epi"])
def pitted(body, request) -> tuple[np.ndarray, np.ndarray]:
    """Its elements with a vertex of one surface drawn onto the one opposite: those between both are gone."""
    mesh, wall = body
    cells = mesh.cells["tetra"]
    tags = {name: np.unique(wall.triangles[wall.facet_tag == FACET_TAGS[name]]) for name in ("endo", "epi")}
    rim = np.unique(wall.triangles[~np.isin(wall.facet_tag, [ENDO, EPI])])
    here = np.setdiff1d(tags[request.param], rim)
    there = np.setdiff1d(tags["epi" if request.param == "endo" else "endo"], rim)
    drawn = here[len(here) // 2]
    opposite = there[np.argmin(np.linalg.norm(mesh.points[there] - mesh.points[drawn], axis=1))]
    both = (cells == drawn).any(axis=1) & (cells == opposite).any(axis=1)
    assert both.any()
    moved = np.where(cells == drawn, opposite, cells)[~both]
    assert (element_volumes(mesh.points, moved, "tetra") > 0.0).all()
    return mesh.points, moved


def facets_of(cells: np.ndarray) -> np.ndarray:
    return boundary_faces({"tetra": cells})["triangle"].nodes


def test_the_pit_is_filled_to_the_surface(body, pitted):
    _, wall = body
    points, cells = pitted
    assert not is_manifold(facets_of(cells))
    found, filled, count = without_pits(points, cells, wall)
    assert count == 1
    assert is_manifold(facets_of(filled))
    np.testing.assert_array_equal(filled[: len(cells)], cells)
    assert (element_volumes(found, filled, "tetra") > 0.0).all()
    # The vertex stands where the surface is nearest: beside where it was, so that not all of the volume comes back.
    lost = [1.0 - element_volumes(*pair, "tetra").sum() / wall.volume for pair in ((points, cells), (found, filled))]
    assert abs(lost[1]) < 0.25 * lost[0]


def test_a_mesh_with_a_pit_is_a_mesh(body, pitted, monkeypatch):
    """Before, such a run came to nothing, and where all did the wall was swept."""
    _, wall = body
    points, cells = pitted
    monkeypatch.setattr(runs, "run_tetwild", lambda *_, **__: TetwildRun(points.copy(), cells.copy(), 1.0, None, 1.0))
    options = {"edge_length": 5.0, "retries": 0, "minimum_dihedral": 0.0, "mean_ratio": 0.0}
    mesh = tetrahedralize(wall, refinement="none", **options)
    assert mesh.info["pits_filled"] == 1
    assert any("1 pit" in note["what"] and note["kind"] == "repaired" for note in mesh.info["notices"])
    assert check(mesh).validity.non_manifold_boundary_points == 0


def test_two_bodies_that_touch_in_a_point_are_left(body):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]], dtype=float)
    cells = np.array([[0, 1, 2, 3], [0, 5, 4, 6]])
    cells[element_volumes(points, cells, "tetra") < 0] = cells[element_volumes(points, cells, "tetra") < 0][
        :, [1, 0, 2, 3]
    ]
    facets = facets_of(cells)
    wall = Wall(points, facets, np.where((facets > 3).any(axis=1), ENDO, EPI), np.full(7, -1))
    found, same, count = without_pits(points, cells, wall)
    assert count == 0
    assert found is points
    assert same is cells


def test_a_sound_mesh_is_left(body):
    mesh, wall = body
    found, same, count = without_pits(mesh.points, mesh.cells["tetra"], wall)
    assert count == 0
    assert found is mesh.points
    assert same is mesh.cells["tetra"]
