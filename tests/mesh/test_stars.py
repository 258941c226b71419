"""Stars and colours of elements of any number of corners, against their definitions."""

from __future__ import annotations

import numpy as np
import pytest

from femprep.mesh.stars import coloured, stars

COUNT = 60


@pytest.mark.parametrize("corners", [3, 4])
def test_stars_and_colours(corners: int) -> None:
    rng = np.random.default_rng(corners)
    # The last point has no element.
    cells = np.stack([rng.choice(COUNT - 1, corners, replace=False) for _ in range(90)])
    start, around = stars(cells, COUNT)
    for v in range(COUNT):
        assert around[start[v] : start[v + 1]].tolist() == np.flatnonzero((cells == v).any(axis=1)).tolist()

    order, first = coloured(cells, start, around, np.arange(COUNT))
    assert sorted(order) == list(range(COUNT))
    colour = np.empty(COUNT, dtype=int)
    for c in range(len(first) - 1):
        part = order[first[c] : first[c + 1]]
        assert len(part) > 0
        assert (np.diff(part) > 0).all()
        colour[part] = c
        # No two of a colour share an element.
        assert np.isin(cells, part).sum(axis=1).max() == 1
    # Greedy: before each point, a point of its star has each lower colour.
    for v in range(COUNT):
        near = np.unique(cells[(cells == v).any(axis=1)])
        assert set(range(colour[v])) <= set(colour[near[near < v]])
