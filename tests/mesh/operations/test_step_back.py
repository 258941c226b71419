"""Vertices go where they should, but for those around triangles that would cross."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from femprep.mesh.operations.step_back import step_uncrossed
from femprep.mesh.search.intersection import self_intersections
from femprep.template import charge_template

BALL = charge_template(1000)


def test_where_nothing_crosses_all_go_the_whole_way() -> None:
    old, new = 10.0 * BALL.directions, 12.0 * BALL.directions
    np.testing.assert_allclose(step_uncrossed(old, new, BALL.cells), new)


def test_a_crossing_holds_back_its_own_surroundings_alone() -> None:
    old = 10.0 * BALL.directions
    new = 12.0 * BALL.directions
    top = BALL.directions[:, 2] > 0.97
    # The top would be pushed out through the bottom.
    new[top] = [0.0, 0.0, -1000.0] + 0.01 * BALL.directions[top]
    points = step_uncrossed(old, new, BALL.cells)
    assert len(self_intersections(points, BALL.cells)) == 0
    far = np.abs(BALL.directions[:, 2]) < 0.5
    np.testing.assert_allclose(points[far], new[far])


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.floats(0.1, 3.0))
def test_nothing_crosses_however_vertices_would_go(seed: int, far: float) -> None:
    old = 10.0 * BALL.directions
    new = old + np.random.default_rng(seed).normal(scale=far, size=old.shape)
    assert len(self_intersections(step_uncrossed(old, new, BALL.cells), BALL.cells)) == 0
