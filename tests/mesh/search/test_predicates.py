from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.mesh.search.predicates import orient2d, orient3d


def exact_orient3d(a, b, c, d) -> int:
    m = [[Fraction(float(p[k])) - Fraction(float(d[k])) for k in range(3)] for p in (a, b, c)]
    det = (
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1])
        - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
        + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    )
    return (det > 0) - (det < 0)


def exact_orient2d(a, b, c) -> int:
    (ax, ay), (bx, by), (cx, cy) = ([Fraction(float(v)) for v in p] for p in (a, b, c))
    det = (ax - cx) * (by - cy) - (ay - cy) * (bx - cx)
    return (det > 0) - (det < 0)


@pytest.mark.parametrize("seed", range(6))
def test_orientation_in_space_agrees_with_fractions_where_points_are_nearly_in_one_plane(seed):
    rng = np.random.default_rng(seed)
    decided = set()
    for _ in range(300):
        a, b, c = rng.normal(size=(3, 3)) * 50.0
        u, v = rng.normal(size=2)
        d = a + u * (b - a) + v * (c - a)
        d[rng.integers(3)] += rng.integers(-3, 4) * 2.0**-50
        expected = exact_orient3d(a, b, c, d)
        assert orient3d(a, b, c, d) == expected
        decided.add(expected)
    assert decided >= {-1, 1}


@pytest.mark.parametrize("seed", range(3))
def test_orientation_in_the_plane_agrees_with_fractions_where_points_are_nearly_on_one_line(seed):
    rng = np.random.default_rng(seed)
    for _ in range(500):
        a, b = rng.normal(size=(2, 2)) * 10.0
        c = a + rng.normal() * (b - a)
        assert orient2d(*a, *b, *c) == exact_orient2d(a, b, c)


@settings(deadline=None, max_examples=200)
@given(st.lists(st.integers(-2, 2).map(lambda i: i * 0.1), min_size=12, max_size=12))
def test_degenerate_positions_on_a_coarse_grid(values):
    a, b, c, d = np.array(values).reshape(4, 3)
    expected = exact_orient3d(a, b, c, d)
    assert orient3d(a, b, c, d) == expected
    assert orient3d(b, a, c, d) == -expected
    assert orient3d(b, c, a, d) == expected


def test_sides_of_a_plane():
    a, b, c = np.eye(3)
    assert orient3d(a, b, c, np.array([0.0, 0.0, 0.0])) == 1
    assert orient3d(a, b, c, np.array([1.0, 1.0, 1.0])) == -1
    assert orient2d(0.0, 0.0, 1.0, 0.0, 0.0, 1.0) == 1
