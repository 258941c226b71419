"""Tetrahedra with a metric each and times at some nodes in, the first time at which a front reaches each node out.

The front obeys grad t . D grad t = 1: where D has the squares of speeds along its axes, it runs by that speed along
each. On each tetrahedron the time at one node is the least over all straight ways from the face across, on which time
is linear [1]_; nodes whose time falls are put in a queue, and have their neighbours done again, until none falls any
more [2]_. What comes out does not depend on the order, but for rounding. A plane front is exact on any mesh; fronts
that bend are late, by an error of first order in the length of the edges, or nearly, where they come from one node.

References
----------
.. [1] Qian, Zhang & Zhao, Fast sweeping methods for eikonal equations on triangular meshes, SIAM J. Numer. Anal. 45,
   2007. doi:10.1137/050627083
.. [2] Fu, Kirby & Whitaker, A fast iterative method for solving the eikonal equation on tetrahedral domains, SIAM J.
   Sci. Comput. 35, 2013. doi:10.1137/120881956
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.mesh.compiled import compiled
from femprep.model import FloatArray, IntArray

#: A node is done again only where its time falls by more than this share of the largest there can be.
_SHARE: Final = 1e-13


def first_times(
    points: npt.ArrayLike, tets: npt.ArrayLike, metric: npt.ArrayLike, nodes: npt.ArrayLike, times: npt.ArrayLike
) -> FloatArray:
    """The first time at which a front reaches each point.

    Parameters
    ----------
    points : (n, 3) array
        mm.
    tets : (m, 4) array
        Corner numbers.
    metric : (m, 3, 3) array
        Symmetric, positive: the time along a vector v within the tetrahedron is sqrt(v . metric v). The inverse of D.
    nodes : (k,) array
        Where fronts begin.
    times : (k,) array
        When. Another front may be there before.

    Returns
    -------
    (n,) array
        Infinite where no front comes.

    Raises
    ------
    InputError
        Nothing begins, a node is out of range, or a time is not finite.
    """
    x = np.ascontiguousarray(points, dtype=np.float64)
    cells = np.ascontiguousarray(tets, dtype=np.int64)
    start, when = np.atleast_1d(np.asarray(nodes, dtype=np.int64)), np.asarray(times, dtype=np.float64)
    if not start.size:
        raise InputError("no front begins anywhere; give at least one node and its time")
    if start.min() < 0 or start.max() >= len(x):
        wrong = start.min() if start.min() < 0 else start.max()
        raise InputError(f"a front begins at point {wrong}, but there are {len(x)} points")
    when = np.broadcast_to(when, start.shape)
    if not np.isfinite(when).all():
        raise InputError("a front begins at a time that is not finite; give times in ms")
    out = np.full(len(x), np.inf)
    np.minimum.at(out, start, when)
    order = np.argsort(cells.ravel(), kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(cells.ravel(), minlength=len(x)))])
    # Rows of tetrahedra at each node, four places to a tetrahedron.
    _run(x, cells, np.ascontiguousarray(metric, dtype=np.float64), order, first, np.unique(start), out)
    return out


@compiled(part=True)
def _quadratic(aa: float, ab: float, bb: float) -> float:
    """The larger root of aa - 2 ab u + bb u^2 = 1, infinite where there is none."""
    root = ab * ab - bb * (aa - 1.0)
    if root < 0.0 or bb <= 0.0:
        return np.inf
    return (ab + np.sqrt(root)) / bb


@compiled(part=True)
def _over_edge(g00: float, g01: float, g11: float, t0: float, t1: float) -> float:
    """The least time over an edge with times at its ends, from the products of the two vectors to them."""
    best = min(t0 + np.sqrt(g00), t1 + np.sqrt(g11))
    det = g00 * g11 - g01 * g01
    if det > 0.0:
        a0, a1 = (g11 * t0 - g01 * t1) / det, (g00 * t1 - g01 * t0) / det
        b0, b1 = (g11 - g01) / det, (g00 - g01) / det
        u = _quadratic(t0 * a0 + t1 * a1, t0 * b0 + t1 * b1, b0 + b1)
        # The way comes from between the ends.
        if u * b0 >= a0 and u * b1 >= a1 and u < best:
            best = u
    return best


@compiled(part=True)
def _over_face(g: FloatArray, t0: float, t1: float, t2: float) -> float:
    """The least time over a triangle with times at its corners, from the products of the three vectors to them."""
    c00 = g[1, 1] * g[2, 2] - g[1, 2] * g[1, 2]
    c01 = g[0, 2] * g[1, 2] - g[0, 1] * g[2, 2]
    c02 = g[0, 1] * g[1, 2] - g[0, 2] * g[1, 1]
    det = g[0, 0] * c00 + g[0, 1] * c01 + g[0, 2] * c02
    if det > 0.0 and t0 < np.inf and t1 < np.inf and t2 < np.inf:
        c11 = g[0, 0] * g[2, 2] - g[0, 2] * g[0, 2]
        c12 = g[0, 1] * g[0, 2] - g[0, 0] * g[1, 2]
        c22 = g[0, 0] * g[1, 1] - g[0, 1] * g[0, 1]
        a0 = (c00 * t0 + c01 * t1 + c02 * t2) / det
        a1 = (c01 * t0 + c11 * t1 + c12 * t2) / det
        a2 = (c02 * t0 + c12 * t1 + c22 * t2) / det
        b0, b1, b2 = (c00 + c01 + c02) / det, (c01 + c11 + c12) / det, (c02 + c12 + c22) / det
        u = _quadratic(t0 * a0 + t1 * a1 + t2 * a2, t0 * b0 + t1 * b1 + t2 * b2, b0 + b1 + b2)
        if u < np.inf and u * b0 >= a0 and u * b1 >= a1 and u * b2 >= a2:
            return u
    # Time is convex over the triangle: the least is on its boundary then.
    t = (t0, t1, t2)
    best = np.inf
    for i in range(3):
        j = (i + 1) % 3
        if t[i] < np.inf and t[j] < np.inf:
            best = min(best, _over_edge(g[i, i], g[i, j], g[j, j], t[i], t[j]))
        else:
            best = min(best, min(t[i] + np.sqrt(g[i, i]), t[j] + np.sqrt(g[j, j])))
    return best


@compiled(writes="times")
def _run(
    points: FloatArray,
    tets: IntArray,
    metric: FloatArray,
    order: IntArray,
    first: IntArray,
    start: IntArray,
    times: FloatArray,
) -> None:
    n = len(points)
    queue = np.empty(n + 1, dtype=np.int64)
    waiting = np.zeros(n, dtype=np.bool_)
    head, tail = 0, 0
    for node in start:
        queue[tail] = node
        waiting[node] = True
        tail = (tail + 1) % (n + 1)
    y = np.empty((3, 3))
    my = np.empty((3, 3))
    g = np.empty((3, 3))
    others = np.empty(3, dtype=np.int64)
    while head != tail:
        node = queue[head]
        head = (head + 1) % (n + 1)
        waiting[node] = False
        for place in range(first[node], first[node + 1]):
            row = order[place] // 4
            for corner in range(4):
                target = tets[row, corner]
                if target == node:
                    continue
                k = 0
                for other in range(4):
                    if other != corner:
                        others[k] = tets[row, other]
                        k += 1
                for i in range(3):
                    for axis in range(3):
                        y[i, axis] = points[others[i], axis] - points[target, axis]
                for i in range(3):
                    for axis in range(3):
                        my[i, axis] = (
                            metric[row, axis, 0] * y[i, 0]
                            + metric[row, axis, 1] * y[i, 1]
                            + metric[row, axis, 2] * y[i, 2]
                        )
                for i in range(3):
                    for j in range(i, 3):
                        g[i, j] = y[j, 0] * my[i, 0] + y[j, 1] * my[i, 1] + y[j, 2] * my[i, 2]
                        g[j, i] = g[i, j]
                u = _over_face(g, times[others[0]], times[others[1]], times[others[2]])
                if u < times[target] - _SHARE * (1.0 + abs(u)):
                    times[target] = u
                    if not waiting[target]:
                        waiting[target] = True
                        queue[tail] = target
                        tail = (tail + 1) % (n + 1)
