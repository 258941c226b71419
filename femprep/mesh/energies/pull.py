"""Points that triangles ought to pass near in, how far they pass them by out, with slopes: compiled parts.

Each point belongs to a place of a triangle, a fixed share of each corner. It counts by the square of how much farther
than a slack it lies from there, so that corners are pulled towards what their triangle cuts off, and not at all where
it follows closely enough.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.mesh.compiled import compiled


@compiled(part=True)
def _gap(x: Any, corners: Any, shares: Any, target: Any) -> Any:
    """From a point to its place on a triangle."""
    gx = -target[0]
    gy = -target[1]
    gz = -target[2]
    for a in range(3):
        gx += shares[a] * x[corners[a], 0]
        gy += shares[a] * x[corners[a], 1]
        gz += shares[a] * x[corners[a], 2]
    return gx, gy, gz


@compiled(part=True)
def pulled(x: Any, vertex: int, pulls: Any) -> float:
    """Sum over the points that belong to triangles around a vertex."""
    starts, around, corners, shares, targets, slack, strength = pulls
    total = 0.0
    for k in range(starts[vertex], starts[vertex + 1]):
        s = around[k]
        gx, gy, gz = _gap(x, corners[s], shares[s], targets[s])
        beyond = np.sqrt(gx * gx + gy * gy + gz * gz) - slack
        if beyond > 0.0:
            total += strength * beyond * beyond
    return total


@compiled(part=True)
def add_pulls(x: Any, vertex: int, pulls: Any, gradient: Any, hessian: Any) -> float:
    """The same sum; its slopes where the vertex moves are added to a gradient and to a Hessian, kept positive."""
    starts, around, corners, shares, targets, slack, strength = pulls
    gap = np.empty(3)
    total = 0.0
    for k in range(starts[vertex], starts[vertex + 1]):
        s = around[k]
        gap[0], gap[1], gap[2] = _gap(x, corners[s], shares[s], targets[s])
        away = np.sqrt(gap[0] ** 2 + gap[1] ** 2 + gap[2] ** 2)
        beyond = away - slack
        if beyond <= 0.0:
            continue
        total += strength * beyond * beyond
        mine = 0.0
        for a in range(3):
            if corners[s, a] == vertex:
                mine = shares[s, a]
        side = beyond / away
        for i in range(3):
            gradient[i] += 2.0 * strength * mine * side * gap[i]
            for j in range(3):
                along = gap[i] * gap[j] / (away * away)
                hessian[i, j] += 2.0 * strength * mine * mine * (along + side * ((1.0 if i == j else 0.0) - along))
    return total
