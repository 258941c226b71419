"""Triangles on a smooth surface in, the same vertices joined by better ones out: edges flipped while that helps."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.mesh.energies.distortion import Ideal
from femprep.mesh.topology import EdgeTable, edge_table
from femprep.model import BoolArray, FloatArray, IntArray

#: Passes at most; each flips edges that share no triangle.
_PASSES: Final = 50
#: Fewest edges at a vertex.
_DEGREE: Final = 4
#: Fall of the measure that makes a flip worth it: no flips to and fro by rounding.
_WORTH: Final = 1e-6


def flip_edges(
    points: FloatArray, normals: FloatArray, cells: IntArray, area: FloatArray, size: float
) -> tuple[IntArray, int]:
    """Flip edges of a closed surface while the distortion of the two triangles beside them falls.

    Parameters
    ----------
    points, normals : (V, 3) arrays
        Vertices and the smooth surface's unit normals.
    cells : (T, 3) array
        Triangles. None is folded by a flip; one that is, is unfolded if a flip can.
    area : (V,) array
        Area asked of triangles at each vertex.
    size : float
        What the area counts beside the shape.

    Returns
    -------
    cells : (T, 3) array
    flips : int
    """
    cells = cells.copy()
    count = len(points)
    total = 0
    # What no corner of has changed is no better than it was: it is looked at once.
    changed = np.ones(count, dtype=bool)
    for _ in range(_PASSES):
        table = edge_table(cells)
        pairs, corners = around_edges(cells, table)
        near = changed[corners].any(axis=1)
        pairs, corners = pairs[near], corners[near]
        a, b, c, d = corners.T
        degree = np.bincount(table.nodes.ravel(), minlength=count)
        present = table.nodes[:, 0] * count + table.nodes[:, 1]
        free = (degree[a] > _DEGREE) & (degree[b] > _DEGREE)
        free &= ~_among(np.minimum(c, d) * count + np.maximum(c, d), present)
        if not free.any():
            break
        pairs, corners = pairs[free], corners[free]
        before, then = (
            _measure(points, normals, each.reshape(-1, 3), area, size).reshape(-1, 2).sum(axis=1)
            for each in (cells[pairs], _flipped(corners))
        )
        better = np.isfinite(then) & (then < before - _WORTH * np.minimum(before, 1e9))
        gain = np.where(np.isfinite(before), before, 1e30) - then
        pairs, corners, gain = pairs[better], corners[better], gain[better]
        changed = np.zeros(count, dtype=bool)
        flipped = 0
        for k in np.argsort(-gain, kind="stable"):
            own = corners[k]
            if changed[own].any():
                continue
            changed[own] = True
            cells[pairs[k]] = _flipped(own)
            flipped += 1
        total += flipped
        if not flipped:
            break
    return cells, total


def around_edges(cells: IntArray, table: EdgeTable) -> tuple[IntArray, IntArray]:
    """What lies around each inner edge of triangles.

    Returns
    -------
    pairs : (e, 2) array
        The two triangles at it.
    corners : (e, 4) array
        Its ends a and b, in the order of the first triangle, and the corners c and d of both that face it. A flip makes
        a, d, c and d, b, c of them.
    """
    inner = np.flatnonzero(table.count == 2)
    one, two = pairs = table.cells[inner].T
    side, other = (np.argmax(table.of_cell[own] == inner[:, None], axis=1) for own in pairs)
    ends = cells[one, side], cells[one, (side + 1) % 3]
    corners = np.stack([*ends, cells[one, (side + 2) % 3], cells[two, (other + 2) % 3]], axis=1)
    return pairs.T, corners


def _flipped(corners: IntArray) -> IntArray:
    """The two triangles ``(..., 2, 3)`` that flips make of corners ``(..., 4)``."""
    return corners[..., [[0, 3, 2], [3, 1, 2]]]


def _among(keys: IntArray, sorted_keys: IntArray) -> BoolArray:
    """Whether each key is one of some others, which are sorted."""
    at = np.minimum(np.searchsorted(sorted_keys, keys), len(sorted_keys) - 1)
    return np.asarray(sorted_keys[at] == keys)


def _measure(points: FloatArray, normals: FloatArray, cells: IntArray, area: FloatArray, size: float) -> FloatArray:
    return Ideal.even(cells, area[cells].mean(axis=1)).each(points, normals, size)
