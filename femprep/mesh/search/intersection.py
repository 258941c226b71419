"""A triangle surface to the pairs of its triangles that intersect.

Exact on the coordinates as given: every sign is that of the true determinant (``predicates``), so that touching,
overlap within one plane and folds of neighbours are found, and rounding invents none.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.mesh.compiled import compiled
from femprep.mesh.search.crossing import (
    apart,
    apart_at,
    apart_over,
    meet_beyond_edge,
    meet_beyond_vertex,
    triangles_meet,
)
from femprep.mesh.search.tree import LEAF, build_tree, check_mesh
from femprep.model import BoolArray, FloatArray, IntArray


def self_intersections(points: npt.ArrayLike, triangles: npt.ArrayLike, of: BoolArray | None = None) -> IntArray:
    """Find all pairs of triangles of one surface that have more in common than their shared corners and side.

    Pairs without a shared corner count as soon as they touch; pairs that share one corner where they meet elsewhere
    too; pairs that share a side where they lie folded onto each other in one plane; doubled triangles always.
    Corners are shared by number: merge equal points first. A triangle without area is tested as the segment it is,
    and its neighbours are reported where they touch it.

    Parameters
    ----------
    points : (n, 3) array
        Vertices, mm.
    triangles : (m, 3) array
        Corner numbers, in any winding.
    of : (m,) bool array, optional
        Triangles of which one at least is in each pair; all by default. Few are quick.

    Returns
    -------
    (k, 2) array
        Numbers of the two triangles, the smaller first; rows are sorted. Empty for a sound surface.

    Raises
    ------
    InputError
        A wrong shape, a point that is not finite, or a corner number out of range.
    """
    p, t = check_mesh(points, triangles)
    of = np.ones(len(t), dtype=bool) if of is None else of
    if of.shape != (len(t),):
        raise InputError(f"{of.shape} triangles are looked at, expected ({len(t)},)")
    if len(t) < 2:
        return np.empty((0, 2), dtype=np.int64)
    box = p[t]
    pairs = _search(p, t, *build_tree(p, t), of, box.min(axis=1), box.max(axis=1))
    if len(pairs):  # of most surfaces none is left, and what decides them is not compiled
        meet = np.empty(len(pairs), dtype=bool)
        _decide(p, t, pairs, meet)
        pairs = pairs[meet]
    return np.asarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))])


@compiled(inner=True, part=True)
def _beside(low: FloatArray, high: FloatArray, other_low: FloatArray, other_high: FloatArray) -> bool:
    """Whether two boxes have nothing in common."""
    beside = False
    for k in range(3):
        beside |= low[k] > other_high[k] or high[k] < other_low[k]
    return beside


@compiled(writes="")
def _search(
    points: FloatArray,
    cells: IntArray,
    low: FloatArray,
    high: FloatArray,
    order: IntArray,
    of: BoolArray,
    least: FloatArray,
    most: FloatArray,
) -> IntArray:
    """Look each triangle wanted up in the tree over all of them; every pair that is not apart for certain, once."""
    found = np.empty((64, 2), dtype=np.int64)
    count = 0
    leaves = len(low) // 2
    stack = np.empty(64, dtype=np.int64)
    for i in range(len(cells)):
        if not of[i]:
            continue
        stack[0] = 1
        depth = 1
        while depth > 0:
            depth -= 1
            node = stack[depth]
            if _beside(low[node], high[node], least[i], most[i]):
                continue
            if node < leaves:
                stack[depth] = 2 * node
                stack[depth + 1] = 2 * node + 1
                depth += 2
                continue
            first = (node - leaves) * LEAF
            for k in range(first, min(first + LEAF, len(order))):
                j = order[k]
                if j == i or (j < i and of[j]) or _beside(least[j], most[j], least[i], most[i]):
                    continue
                one, two = min(i, j), max(i, j)
                if not _apart(points, cells[one], cells[two]):
                    if count == len(found):
                        found = np.concatenate((found, np.empty_like(found)))
                    found[count, 0], found[count, 1] = one, two
                    count += 1
    return found[:count].copy()


@compiled(inner=True)
def _shared(one: IntArray, two: IntArray) -> tuple[int, int, int, int, int]:
    """How many corners two triangles share; which one the first and the second of these is in each."""
    shared = 0
    i0 = i1 = j0 = j1 = 0
    for i in range(3):
        for j in range(3):
            if one[i] == two[j]:
                if shared == 0:
                    i0, j0 = i, j
                elif shared == 1:
                    i1, j1 = i, j
                shared += 1
    return shared, i0, i1, j0, j1


@compiled(inner=True)
def _apart(points: FloatArray, one: IntArray, two: IntArray) -> bool:
    """Whether two triangles have nothing but the corners they share in common for certain."""
    shared, i0, i1, j0, j1 = _shared(one, two)
    a, b, c = points[one[i0]], points[one[(i0 + 1) % 3]], points[one[(i0 + 2) % 3]]
    d, e, f = points[two[j0]], points[two[(j0 + 1) % 3]], points[two[(j0 + 2) % 3]]
    if shared == 0:
        return apart(a, b, c, d, e, f)
    if shared == 1:
        return apart_at(a, b, c, e, f)
    return shared == 2 and apart_over(a, points[one[i1]], points[one[3 - i0 - i1]], points[two[3 - j0 - j1]])


@compiled(writes="meet")
def _decide(points: FloatArray, cells: IntArray, pairs: IntArray, meet: BoolArray) -> None:
    """Whether pairs of triangles of one surface meet beyond the corners they share, exactly."""
    for n in range(len(pairs)):
        one, two = cells[pairs[n, 0]], cells[pairs[n, 1]]
        shared, i0, i1, j0, j1 = _shared(one, two)
        a, b, c = points[one[i0]], points[one[(i0 + 1) % 3]], points[one[(i0 + 2) % 3]]
        d, e, f = points[two[j0]], points[two[(j0 + 1) % 3]], points[two[(j0 + 2) % 3]]
        if shared == 0:
            meet[n] = triangles_meet(a, b, c, d, e, f)
        elif shared == 1:
            meet[n] = meet_beyond_vertex(a, b, c, e, f)
        elif shared == 2:
            meet[n] = meet_beyond_edge(a, points[one[i1]], points[one[3 - i0 - i1]], points[two[3 - j0 - j1]])
        else:
            meet[n] = True
