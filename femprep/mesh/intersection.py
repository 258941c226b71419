"""Triangle surfaces to the pairs of triangles that intersect, of one surface with itself or of two with each other.

Exact on the coordinates as given: every sign is that of the true determinant (``predicates``), so that touching,
overlap within one plane and folds of neighbours are found, and rounding invents none.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from femprep.mesh.compiled import compiled
from femprep.mesh.crossing import meet_beyond_edge, meet_beyond_vertex, triangles_meet
from femprep.mesh.tree import LEAF, build_tree, check_mesh
from femprep.model import FloatArray, IntArray


def self_intersections(points: npt.ArrayLike, triangles: npt.ArrayLike) -> IntArray:
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
    if len(t) < 2:
        return np.empty((0, 2), dtype=np.int64)
    return _sorted(_search(p, t, p, t, *build_tree(p, t), True))


def intersections(
    points_a: npt.ArrayLike, triangles_a: npt.ArrayLike, points_b: npt.ArrayLike, triangles_b: npt.ArrayLike
) -> IntArray:
    """Find all pairs of a triangle of surface a and one of surface b that touch or cross.

    Parameters
    ----------
    points_a, points_b : (n, 3) arrays
        Vertices of either surface, mm.
    triangles_a, triangles_b : (m, 3) arrays
        Corner numbers.

    Returns
    -------
    (k, 2) array
        Numbers of the triangle of a and of b; rows are sorted. One surface wholly within the other meets it nowhere.

    Raises
    ------
    InputError
        As for :func:`self_intersections`.
    """
    pa, ta = check_mesh(points_a, triangles_a)
    pb, tb = check_mesh(points_b, triangles_b)
    if len(ta) == 0 or len(tb) == 0:
        return np.empty((0, 2), dtype=np.int64)
    return _sorted(_search(pa, ta, pb, tb, *build_tree(pb, tb), False))


def _sorted(pairs: IntArray) -> IntArray:
    return np.asarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))])


@compiled()
def _search(
    pa: FloatArray,
    ta: IntArray,
    pb: FloatArray,
    tb: IntArray,
    low: FloatArray,
    high: FloatArray,
    order: IntArray,
    same: bool,
) -> IntArray:
    """Look each triangle of a up in the tree over b; within one surface, every pair once."""
    found = np.empty((64, 2), dtype=np.int64)
    count = 0
    leaves = len(low) // 2
    stack = np.empty(64, dtype=np.int64)
    for i in range(len(ta)):
        a, b, c = pa[ta[i, 0]], pa[ta[i, 1]], pa[ta[i, 2]]
        x0, x1 = min(a[0], b[0], c[0]), max(a[0], b[0], c[0])
        y0, y1 = min(a[1], b[1], c[1]), max(a[1], b[1], c[1])
        z0, z1 = min(a[2], b[2], c[2]), max(a[2], b[2], c[2])
        stack[0] = 1
        depth = 1
        while depth > 0:
            depth -= 1
            node = stack[depth]
            if (
                low[node, 0] > x1
                or high[node, 0] < x0
                or low[node, 1] > y1
                or high[node, 1] < y0
                or low[node, 2] > z1
                or high[node, 2] < z0
            ):
                continue
            if node < leaves:
                stack[depth] = 2 * node
                stack[depth + 1] = 2 * node + 1
                depth += 2
                continue
            first = (node - leaves) * LEAF
            for k in range(first, min(first + LEAF, len(order))):
                j = order[k]
                if same and j <= i:
                    continue
                d, e, f = pb[tb[j, 0]], pb[tb[j, 1]], pb[tb[j, 2]]
                if (
                    min(d[0], e[0], f[0]) > x1
                    or max(d[0], e[0], f[0]) < x0
                    or min(d[1], e[1], f[1]) > y1
                    or max(d[1], e[1], f[1]) < y0
                    or min(d[2], e[2], f[2]) > z1
                    or max(d[2], e[2], f[2]) < z0
                ):
                    continue
                if _neighbours_meet(pa, ta[i], ta[j]) if same else triangles_meet(a, b, c, d, e, f):
                    if count == len(found):
                        larger = np.empty((2 * count, 2), dtype=np.int64)
                        larger[:count] = found
                        found = larger
                    found[count, 0] = i
                    found[count, 1] = j
                    count += 1
    return found[:count].copy()


@compiled()
def _neighbours_meet(points: FloatArray, one: IntArray, two: IntArray) -> bool:
    """Whether two triangles of one surface meet beyond the corners they share."""
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
    if shared == 0:
        return triangles_meet(
            points[one[0]], points[one[1]], points[one[2]], points[two[0]], points[two[1]], points[two[2]]
        )
    if shared == 1:
        return meet_beyond_vertex(
            points[one[i0]],
            points[one[(i0 + 1) % 3]],
            points[one[(i0 + 2) % 3]],
            points[two[(j0 + 1) % 3]],
            points[two[(j0 + 2) % 3]],
        )
    if shared == 2:
        return meet_beyond_edge(points[one[i0]], points[one[i1]], points[one[3 - i0 - i1]], points[two[3 - j0 - j1]])
    return True
