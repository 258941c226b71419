"""Tetrahedra whose nodes have places in some space, and points of that space, in; the tetrahedron at each point out.

The places need not be positions: coordinates of a wall serve as well, so that points of one mesh are found in another.
A point in no tetrahedron gets the closest place of one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from femprep.errors import InputError
from femprep.mesh.compiled import compiled
from femprep.mesh.search.closest import CHUNK, closest_on_triangle
from femprep.mesh.search.tree import LEAF, build_tree, next_leaf
from femprep.model import FloatArray, IntArray


@dataclass(frozen=True)
class Located:
    """Where points were found.

    Attributes
    ----------
    tet : (q,) array
        The tetrahedron at each.
    nodes : (q, 4) array
        Its nodes.
    weights : (q, 4) array
        Their shares, not negative, of sum 1: a value there is ``(weights * value[nodes]).sum(axis=1)``.
    distance : (q,) array
        From the point to the closest place of a tetrahedron, 0 inside one, in units of the space.
    """

    tet: IntArray
    nodes: IntArray
    weights: FloatArray
    distance: FloatArray

    def matrix(self, columns: int) -> sp.csr_array:
        """Matrix ``(q, columns)`` from values at nodes to values at the points."""
        count = len(self.tet)
        return sp.csr_array(
            (self.weights.ravel(), self.nodes.ravel(), np.arange(0, 4 * count + 1, 4)), shape=(count, columns)
        )

    def at(self, values: FloatArray) -> FloatArray:
        """Values at the points, of values at nodes."""
        return np.einsum("qi,qi...->q...", self.weights, values[self.nodes])


class Locator:
    """Tetrahedra prepared for many searches.

    Parameters
    ----------
    tets : (m, 4) array
        Node numbers.
    places : (n, 3) array
        Where the nodes lie. Tetrahedra may be inverted or flat there.

    Raises
    ------
    InputError
        There are no tetrahedra, or a place of a node in use is not finite.
    """

    def __init__(self, tets: IntArray, places: FloatArray) -> None:
        if not len(tets):
            raise InputError("there are no elements to find points in")
        self.tets = np.ascontiguousarray(tets, dtype=np.int64)
        self.places = np.ascontiguousarray(places, dtype=np.float64)
        x = self.places[self.tets]
        if not np.isfinite(x).all():
            raise InputError("places of nodes are not finite, so that no point can be found among them")
        # The tree knows triangles: two corners of its box stand for each tetrahedron.
        ends = np.concatenate([x.min(axis=1), x.max(axis=1)])
        first = np.arange(len(tets))
        self._tree = build_tree(ends, np.column_stack([first, first + len(tets), first]))

    def __call__(self, queries: FloatArray) -> Located:
        """Find points ``(q, 3)``."""
        q = np.ascontiguousarray(queries, dtype=np.float64)
        tet = np.full(len(q), -1, dtype=np.int64)
        weights, gap = np.zeros((len(q), 4)), np.full(len(q), np.inf)
        _search(-(-len(q) // CHUNK), q, self.places, self.tets, *self._tree, tet, weights, gap)
        if len(q) and tet.min() < 0:
            row = int(np.argmin(tet))
            raise InputError(f"point {q[row].tolist()} cannot be looked for; expected finite numbers")
        return Located(tet, self.tets[tet], weights, np.sqrt(gap))


@compiled(part=True)
def _inside(q: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, w: FloatArray) -> bool:
    """Barycentric coordinates of q into w; whether it lies within. A flat tetrahedron holds nothing."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    sx, sy, sz = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    x, y, z = q[0] - a[0], q[1] - a[1], q[2] - a[2]
    nx, ny, nz = vy * sz - vz * sy, vz * sx - vx * sz, vx * sy - vy * sx
    det = ux * nx + uy * ny + uz * nz
    size = (abs(ux) + abs(uy) + abs(uz)) * (abs(vx) + abs(vy) + abs(vz)) * (abs(sx) + abs(sy) + abs(sz))
    if not abs(det) > 1e-12 * size:
        return False
    w[1] = (x * nx + y * ny + z * nz) / det
    w[2] = (x * (sy * uz - sz * uy) + y * (sz * ux - sx * uz) + z * (sx * uy - sy * ux)) / det
    w[3] = (x * (uy * vz - uz * vy) + y * (uz * vx - ux * vz) + z * (ux * vy - uy * vx)) / det
    w[0] = 1.0 - w[1] - w[2] - w[3]
    return min(min(w[0], w[1]), min(w[2], w[3])) >= 0.0


@compiled(part=True)
def _try(
    q: FloatArray,
    places: FloatArray,
    tets: IntArray,
    t: int,
    best: float,
    i: int,
    tet: IntArray,
    weights: FloatArray,
    w: FloatArray,
) -> float:
    """Take tetrahedron t for query i where it is nearer than the best, or as near with a smaller number."""
    if _inside(q, places[tets[t, 0]], places[tets[t, 1]], places[tets[t, 2]], places[tets[t, 3]], w):
        if best > 0.0 or tet[i] < 0 or t < tet[i]:
            tet[i] = t
            for k in range(4):
                weights[i, k] = w[k]
        return 0.0
    if best == 0.0:
        return best
    for left_out in range(4):
        j, k, m = (left_out + 1) % 4, (left_out + 2) % 4, (left_out + 3) % 4
        a, b, c = places[tets[t, j]], places[tets[t, k]], places[tets[t, m]]
        wa, wb, wc = closest_on_triangle(q, a, b, c)
        gap = 0.0
        for axis in range(3):
            step = wa * a[axis] + wb * b[axis] + wc * c[axis] - q[axis]
            gap += step * step
        if gap < best or (gap == best and t < tet[i]):
            best = gap
            tet[i] = t
            weights[i, left_out] = 0.0
            weights[i, j], weights[i, k], weights[i, m] = wa, wb, wc
    return best


@compiled(grain=2, writes="tet weights found")
def _search(
    first: int,
    last: int,
    queries: FloatArray,
    places: FloatArray,
    tets: IntArray,
    low: FloatArray,
    high: FloatArray,
    order: IntArray,
    tet: IntArray,
    weights: FloatArray,
    found: FloatArray,
) -> None:
    """Nearer child first; of equally close tetrahedra the smallest number wins, so that threads change nothing."""
    for chunk in range(first, last):
        stack, bound, w = np.empty(64, dtype=np.int64), np.empty(64), np.empty(4)
        for i in range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(queries))):
            q = queries[i]
            best = np.inf
            stack[0], bound[0] = 1, 0.0
            depth = np.int64(1)  # else numba compiles next_leaf once more for the number 1
            while True:
                leaf, depth = next_leaf(q, low, high, best, stack, bound, depth)
                if leaf < 0:
                    break
                for k in range(leaf * LEAF, min(leaf * LEAF + LEAF, len(order))):
                    best = _try(q, places, tets, order[k], best, i, tet, weights, w)
            found[i] = best
