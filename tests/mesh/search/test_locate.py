"""Points found among tetrahedra, by places of any kind."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

from femprep.errors import InputError
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.search.locate import Locator


def cloud() -> tuple[np.ndarray, np.ndarray, Delaunay]:
    points = np.random.default_rng(3).random((300, 3))
    whole = Delaunay(points)
    return points, whole.simplices.astype(np.int64), whole


def test_points_are_found_where_they_lie_and_others_at_the_hull() -> None:
    points, tets, whole = cloud()
    queries = np.random.default_rng(4).random((2000, 3)) * 1.4 - 0.2
    found = Locator(tets, points)(queries)
    inside = whole.find_simplex(queries) >= 0
    assert 0.2 < inside.mean() < 0.8
    assert np.all(found.distance[inside] < 1e-12)
    np.testing.assert_allclose(found.at(points)[inside], queries[inside], atol=1e-12)
    hull = ClosestFinder(points, whole.convex_hull)(queries[~inside])
    np.testing.assert_allclose(found.distance[~inside], hull.distance, atol=1e-12)
    np.testing.assert_allclose(found.at(points)[~inside], hull.points, atol=1e-12)
    assert found.weights.min() >= 0.0
    np.testing.assert_allclose(found.weights.sum(axis=1), 1.0, atol=1e-12)
    linear = points @ [1.0, 2.0, 3.0]
    np.testing.assert_allclose(found.matrix(len(points)) @ linear, found.at(linear), atol=1e-12)


def test_inverted_and_flat_tetrahedra_do_no_harm() -> None:
    points, tets, _ = cloud()
    queries = np.random.default_rng(5).random((500, 3))
    plain = Locator(tets, points)(queries)
    turned = Locator(tets[:, [1, 0, 2, 3]], points)(queries)
    flat = Locator(np.concatenate([np.tile(tets[:1, :1], (5, 4)), tets]), points)(queries)
    # In a face both neighbours hold a point: which one is rounding, the place is not.
    for found in (turned, flat):
        np.testing.assert_allclose(found.distance, plain.distance, atol=1e-12)
        np.testing.assert_allclose(found.at(points), plain.at(points), atol=1e-9)
    assert np.mean(flat.tet == plain.tet + 5) > 0.98


def test_what_cannot_be_searched_is_refused() -> None:
    points, tets, _ = cloud()
    with pytest.raises(InputError, match="no elements"):
        Locator(tets[:0], points)
    with pytest.raises(InputError, match="not finite"):
        Locator(tets, np.full_like(points, np.nan))
    with pytest.raises(InputError, match="cannot be looked for"):
        Locator(tets, points)(np.array([[np.nan, 0.0, 0.0]]))
