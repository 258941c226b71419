"""Tetrahedra cut along a surface: nothing gained or lost, neighbours fit, and no element is left on both sides."""

from __future__ import annotations

import numpy as np
import pytest
from anatomy_meshes import ellipsoid, slab
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.mesh.elements import boundary_faces
from femprep.mesh.measures.tetrahedra import tetra_volumes
from femprep.mesh.operations.level_cut import LevelCut, cut_along_level
from femprep.model import FloatArray, VolumeMesh

BOX = slab("tetra").mesh


def sides_of_box() -> np.ndarray:
    """Which of its six planes the points of the box lie in."""
    low, high = BOX.points.min(axis=0), BOX.points.max(axis=0)
    return np.concatenate([np.abs(BOX.points - low) < 1e-9, np.abs(BOX.points - high) < 1e-9], axis=1)


def cut(mesh: VolumeMesh, value: FloatArray, still: np.ndarray | None = None, **more) -> LevelCut:
    """The mesh cut, the planes of the box or the tags being its surfaces."""
    facets = boundary_faces({"tetra": mesh.cells["tetra"]})["triangle"].nodes
    surfaces = sides_of_box()
    if mesh is not BOX:
        tags = np.unique(mesh.facet_tag)
        surfaces = np.zeros((len(mesh.points), len(tags)), dtype=bool)
        for column, tag in enumerate(tags):
            surfaces[np.unique(mesh.facets["triangle"][mesh.facet_tag == tag]), column] = True
    still = np.zeros(len(mesh.points), dtype=bool) if still is None else still
    wall = np.ones(len(mesh.cells["tetra"]), dtype=bool)
    return cut_along_level(mesh.points, mesh.cells["tetra"], facets, value, wall, surfaces, still, **more)


def require_whole(mesh: VolumeMesh, found: LevelCut) -> FloatArray:
    """The new points; the mesh is sound, fills its parents' and has its facets as boundary."""
    points = np.asarray(found.matrix @ mesh.points)
    volume = tetra_volumes(points, found.cells)
    assert volume.min() > 0.0
    sides = found.value[found.cells]
    assert not ((sides.max(axis=1) > 0) & (sides.min(axis=1) < 0)).any()
    faces = boundary_faces({"tetra": found.cells})["triangle"].nodes
    assert sorted(map(tuple, np.sort(faces, axis=1))) == sorted(map(tuple, np.sort(found.facets, axis=1)))
    np.testing.assert_allclose(found.matrix.sum(axis=1), 1.0, atol=1e-12)
    return points


@settings(max_examples=40, deadline=None)
@given(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1), st.floats(-3, 3))
def test_a_plane_through_a_box_is_exact(normal: tuple[float, float, float], shift: float) -> None:
    normal = np.array(normal) / np.linalg.norm(normal)
    value = (BOX.points - BOX.points.mean(axis=0)) @ normal - shift
    found = cut(BOX, value)
    points = require_whole(BOX, found)
    # The faces of a box are planes: points moved in them change nothing.
    assert tetra_volumes(points, found.cells).sum() == pytest.approx(6000.0, rel=1e-12)
    on = found.value == 0.0
    off = np.abs((points - BOX.points.mean(axis=0)) @ normal - shift)
    stayed = np.diff(found.matrix.indptr) == 1
    assert off[on & ~stayed].max(initial=0.0) < 1e-9
    # Points that could not move let the surface come to them, from within the share of an edge it was near by.
    assert off[on].max(initial=0.0) < 0.3 * 10.0


def test_a_sphere_in_a_wall_keeps_good_elements() -> None:
    mesh = ellipsoid("tetra", size=8, layers=4).mesh
    centre, radius = np.array([30.0, 0.0, -10.0]), 9.0
    found = cut(mesh, radius - np.linalg.norm(mesh.points - centre, axis=1))
    points = require_whole(mesh, found)
    away = np.linalg.norm(points[found.value == 0.0] - centre, axis=1)
    assert away.max() < radius + 0.3 * 6.0
    assert np.median(np.abs(away - radius)) < 0.5  # of edges of 5 mm


def test_still_nodes_stay_and_parents_are_told() -> None:
    value = BOX.points[:, 2] - 12.3
    still = np.ones(len(BOX.points), dtype=bool)
    found = cut(BOX, value, still)
    points = require_whole(BOX, found)
    np.testing.assert_array_equal(points[: len(BOX.points)], BOX.points)
    middle = points[found.cells].mean(axis=1)
    box = BOX.points[BOX.cells["tetra"]][found.cell]
    weights = np.linalg.solve(np.swapaxes(box[:, 1:] - box[:, :1], 1, 2), (middle - box[:, 0])[..., None])[..., 0]
    assert weights.min() > 0.0
    assert weights.sum(axis=1).max() < 1.0


def test_where_the_surface_crosses_may_be_told() -> None:
    """Values of 1 and -1 alone say nothing of where: a callable does."""
    value = np.where(BOX.points[:, 2] > 12.3, 1.0, -1.0)

    def crossing(ends: np.ndarray) -> np.ndarray:
        low, high = BOX.points[ends, 2].T
        return (12.3 - low) / (high - low)

    found = cut(BOX, value, crossing=crossing)
    points = require_whole(BOX, found)
    np.testing.assert_allclose(points[found.value == 0.0, 2], 12.3, atol=1e-9)


def test_a_surface_beyond_the_mesh_changes_nothing() -> None:
    found = cut(BOX, np.ones(len(BOX.points)))
    np.testing.assert_array_equal(found.cells, BOX.cells["tetra"])
    assert len(found.facets) == len(boundary_faces({"tetra": BOX.cells["tetra"]})["triangle"].nodes)
    assert found.matrix.shape == (len(BOX.points),) * 2
