from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.mesh.measures.triangles import area_vectors, areas, triangle_quality
from femprep.mesh.topology import border_edges
from femprep.wall.joining.planar import fill_rings


def ring(radius: float, count: int, wave: float = 0.0, lobes: int = 3, centre=(0.0, 0.0), jitter: float = 0.0):
    angle = 2 * np.pi * (np.arange(count) + jitter * np.random.default_rng(count).uniform(-0.4, 0.4, count)) / count
    r = radius * (1 + wave * np.cos(lobes * angle))
    return np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1) + centre


def polygon_area(points) -> float:
    x, y = points.T
    return abs(0.5 * (x @ np.roll(y, -1) - np.roll(x, -1) @ y))


def flat(points):
    return np.concatenate([points, np.zeros((len(points), 1))], axis=1)


def edges_of(rings):
    out, start = set(), 0
    for r in rings:
        n = len(r)
        out |= {frozenset((start + i, start + (i + 1) % n)) for i in range(n)}
        start += n
    return out


@settings(deadline=None, max_examples=30)
@given(
    outer=st.integers(24, 90),
    inner=st.integers(20, 80),
    wall=st.floats(3.0, 15.0),
    wave=st.floats(0.0, 0.08),
    lobes=st.integers(2, 5),
    jitter=st.floats(0.0, 1.0),
    turn=st.booleans(),
)
def test_an_annulus_is_filled_exactly_and_well(outer, inner, wall, wave, lobes, jitter, turn):
    rings = [ring(35.0, outer, wave, lobes, jitter=jitter), ring(35.0 - wall, inner, wave, lobes, jitter=jitter)]
    if turn:
        rings[0] = rings[0][::-1]
    points, triangles = fill_rings(rings)
    given_points = np.concatenate(rings)
    assert (points[: len(given_points)] == given_points).all()
    size = areas(flat(points), triangles)
    assert (area_vectors(flat(points), triangles)[:, 2] > 0).all()
    assert size.sum() == pytest.approx(polygon_area(rings[0]) - polygon_area(rings[1]), rel=1e-10)
    assert {frozenset(e) for e in border_edges(triangles).tolist()} == edges_of(rings)


@pytest.mark.parametrize("wall", [2.0, 4.0, 8.0, 16.0])
def test_evenly_spaced_rings_give_good_triangles(wall):
    rings = [ring(33.0, 70), ring(33.0 - wall, int(70 * (33.0 - wall) / 33.0))]
    points, triangles = fill_rings(rings)
    quality = triangle_quality(flat(points), triangles)
    assert quality.min() > 0.5
    assert quality.mean() > 0.85


def test_several_holes_are_kept():
    rings = [ring(40.0, 80), ring(12.0, 26, centre=(-18.0, 0.0)), ring(14.0, 30, centre=(16.0, 3.0))]
    points, triangles = fill_rings(rings)
    assert {frozenset(e) for e in border_edges(triangles).tolist()} == edges_of(rings)
    expected = polygon_area(rings[0]) - polygon_area(rings[1]) - polygon_area(rings[2])
    assert areas(flat(points), triangles).sum() == pytest.approx(expected, rel=1e-10)
    assert triangle_quality(flat(points), triangles).min() > 0.3


def test_a_disc_is_filled():
    points, triangles = fill_rings([ring(20.0, 50)])
    assert areas(flat(points), triangles).sum() == pytest.approx(polygon_area(ring(20.0, 50)), rel=1e-10)
    assert triangle_quality(flat(points), triangles).min() > 0.5


def test_the_same_rings_give_the_same_bytes():
    rings = [ring(33.0, 70, jitter=0.5), ring(25.0, 50, jitter=0.5)]
    first, second = fill_rings(rings), fill_rings(rings)
    assert first[0].tobytes() == second[0].tobytes()
    assert first[1].tobytes() == second[1].tobytes()
