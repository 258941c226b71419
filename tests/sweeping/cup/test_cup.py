"""Cups and tubes are what they say: disks and rings of positive cells with even rims, at any resolution."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.errors import OptionError
from femprep.sweeping.cup.cup import HOLE, Cup, quad_cup, quad_tube, triangle_cup, triangle_tube

CLOSED = [(triangle_cup, 5), (quad_cup, 4)]
CLIPPED = [(triangle_tube, 3), (quad_tube, 4)]


def _edges(cup: Cup) -> tuple[np.ndarray, np.ndarray]:
    corners = cup.cells.shape[1]
    sides = np.concatenate([cup.cells[:, [i, (i + 1) % corners]] for i in range(corners)])
    return np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)


def _least_corner(cup: Cup) -> float:
    points = cup.disk[cup.cells]
    after, before = np.roll(points, -1, axis=1) - points, np.roll(points, 1, axis=1) - points
    return float((after[..., 0] * before[..., 1] - after[..., 1] * before[..., 0]).min())


@settings(deadline=None, max_examples=25)
@given(kind=st.sampled_from([*CLOSED, *CLIPPED]), factor=st.integers(1, 8), rows=st.integers(1, 9))
def test_every_resolution_is_a_surface_with_whole_rims(kind, factor, rows):
    make, multiple = kind
    cup = make(factor * multiple, rows)
    edges, uses = _edges(cup)
    euler = len(cup.disk) - len(edges) + len(cup.cells)
    assert euler == (0 if len(cup.apex) else 1)
    assert uses.max() == 2
    rims = [cup.base, cup.apex] if len(cup.apex) else [cup.base]
    wanted = {tuple(sorted(pair)) for rim in rims for pair in zip(rim.tolist(), np.roll(rim, -1).tolist())}
    assert {tuple(pair) for pair in edges[uses == 1].tolist()} == wanted
    assert np.array_equal(np.unique(cup.cells), np.arange(len(cup.disk)))
    assert np.allclose(np.linalg.norm(cup.disk[cup.base], axis=1), 1.0)
    assert np.allclose(np.linalg.norm(cup.disk[cup.apex], axis=1), HOLE)


@pytest.mark.parametrize(("make", "multiple"), [*CLOSED, *CLIPPED])
def test_cells_are_convex_and_counter_clockwise(make, multiple):
    assert _least_corner(make(6 * multiple, 7)) > 0.0


def test_valences_are_those_of_a_capped_cylinder():
    edges, _ = _edges(triangle_cup(30, 8))
    inner = np.bincount(edges.ravel())[:-30]
    assert np.bincount(inner).tolist()[5:] == [6, len(inner) - 6]
    edges, _ = _edges(quad_cup(24, 5))
    inner = np.bincount(edges.ravel())[:-24]
    assert np.bincount(inner).tolist()[3:] == [4, len(inner) - 4]


def test_rows_are_numbered_from_the_apex_and_counter_clockwise():
    cup = triangle_cup(20, 5)
    assert cup.disk[0].tolist() == [0.0, 0.0]
    assert np.all(np.diff(np.round(np.linalg.norm(cup.disk, axis=1), 12)) >= 0.0)
    angle = np.unwrap(np.arctan2(*cup.disk[cup.base].T[::-1]))
    assert np.all(np.diff(angle) > 0.0)


@pytest.mark.parametrize(
    ("make", "columns", "rows"),
    [(triangle_cup, 7, 2), (quad_cup, 6, 2), (triangle_cup, 0, 2), (quad_tube, 2, 2), (triangle_tube, 9, 0)],
)
def test_impossible_resolutions_are_refused(make, columns, rows):
    with pytest.raises(OptionError, match="expected"):
        make(columns, rows)
