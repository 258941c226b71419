from __future__ import annotations

import numba
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.errors import InputError
from femprep.mesh.search.closest import ClosestFinder


def box():
    mesh = trimesh.creation.box(extents=(2, 2, 2))
    return np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int64)


def box_distance(q):
    outside = np.maximum(np.abs(q) - 1.0, 0.0)
    inside = np.minimum(np.max(np.abs(q) - 1.0, axis=1), 0.0)
    return np.linalg.norm(outside, axis=1) + inside


def test_signed_distance_of_a_box_is_exact_at_faces_edges_and_corners():
    q = np.random.default_rng(1).uniform(-2.5, 2.5, size=(4000, 3))
    corner = np.array([[2.0, 2, 2], [-2, 2, 0.3], [0.2, 0.1, 3], [0, 0, 0.5], [0.9, 0.9, 0.9]])
    q = np.vstack([q, corner])
    np.testing.assert_allclose(ClosestFinder(*box()).signed(q), box_distance(q), atol=1e-14)


def test_foot_points_lie_on_the_surface_where_the_weights_say():
    points, cells = box()
    q = np.random.default_rng(2).normal(size=(500, 3)) * 2
    found = ClosestFinder(points, cells)(q)
    foot = np.einsum("qi,qik->qk", found.weights, points[cells[found.triangle]])
    np.testing.assert_allclose(foot, found.points, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(q - foot, axis=1), found.distance)
    np.testing.assert_allclose(np.abs(foot).max(axis=1), 1.0)
    assert np.all(found.weights >= 0)


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.integers(1, 90))
def test_search_agrees_with_all_triangles(seed, count):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(3 * count, 3))
    cells = np.arange(3 * count).reshape(count, 3)
    q = rng.normal(size=(40, 3)) * 2
    found = ClosestFinder(points, cells)(q)
    every = np.stack([ClosestFinder(points, cells[[t]])(q).distance for t in range(count)])
    np.testing.assert_array_equal(found.distance, every.min(axis=0))


def test_agrees_with_another_library_on_a_ball():
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=10.0)
    q = np.random.default_rng(3).normal(size=(400, 3)) * 8
    _, distance, _ = trimesh.proximity.closest_point(mesh, q)
    found = ClosestFinder(mesh.vertices, mesh.faces)(q)
    np.testing.assert_allclose(found.distance, distance, atol=1e-10)


def test_what_is_not_within_a_distance_is_infinitely_far():
    finder = ClosestFinder(*box())
    q = np.random.default_rng(4).uniform(-2.5, 2.5, size=(500, 3))
    exact, closest = finder.sided(q)
    within = np.random.default_rng(5).uniform(0.0, 1.0, size=len(q))
    near = closest.distance < within
    assert 50 < near.sum() < 450
    found, bounded = finder.sided(q, within)
    np.testing.assert_array_equal(found, np.where(near, exact, np.inf))
    np.testing.assert_array_equal(bounded.triangle, np.where(near, closest.triangle, -1))
    np.testing.assert_array_equal(bounded.distance, np.abs(found))


def test_a_point_on_a_vertex_has_distance_zero():
    points, cells = box()
    found = ClosestFinder(points, cells)(points)
    np.testing.assert_array_equal(found.distance, 0.0)


def test_bad_input_is_refused():
    points, cells = box()
    with pytest.raises(InputError, match="not closed"):
        ClosestFinder(points, cells[1:]).signed(points)
    flipped = cells.copy()
    flipped[0] = flipped[0, ::-1]
    with pytest.raises(InputError, match="not consistently wound"):
        ClosestFinder(points, flipped).signed(points)
    with pytest.raises(InputError, match="no triangles"):
        ClosestFinder(points, np.empty((0, 3), dtype=int))
    with pytest.raises(InputError, match=r"query points have shape \(3,\)"):
        ClosestFinder(points, cells)([0.0, 0.0, 0.0])
    with pytest.raises(InputError, match="query point 0 is"):
        ClosestFinder(points, cells)([[np.inf, 0.0, 0.0]])


def test_one_thread_and_several_give_the_same_bytes(monkeypatch):
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 4)
    points, cells = box()
    # Points on the diagonals are equally close to several triangles.
    q = np.vstack([np.random.default_rng(4).normal(size=(999, 3)) * 2, np.linspace(-2, 2, 101)[:, None] * np.ones(3)])
    several = ClosestFinder(points, cells)(q)
    monkeypatch.setattr(numba.config, "NUMBA_NUM_THREADS", 1)
    one = ClosestFinder(points, cells)(q)
    assert one.triangle.tobytes() == several.triangle.tobytes()
    assert one.points.tobytes() == several.points.tobytes()
