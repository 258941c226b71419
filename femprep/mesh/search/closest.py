"""Points and a triangle surface to the closest point of the surface for each: distance, foot, triangle, side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.mesh.compiled import compiled
from femprep.mesh.measures.triangles import normals, vertex_normals
from femprep.mesh.search.tree import LEAF, BoxTree, build_tree, check_mesh, curve_order, next_leaf
from femprep.mesh.topology import edge_table, is_closed, is_consistently_wound
from femprep.model import BoolArray, FloatArray, IntArray

#: Queries that share their working memory.
CHUNK: Final = 64


@dataclass(frozen=True)
class Closest:
    """Closest points of a surface.

    Attributes
    ----------
    distance : (q,) array
        mm, never negative.
    points : (q, 3) array
        The closest point of the surface, mm.
    triangle : (q,) array
        The triangle it lies in.
    weights : (q, 3) array
        Its barycentric coordinates there.
    nodes : (q, 3) array
        The corners of that triangle.
    """

    distance: FloatArray
    points: FloatArray
    triangle: IntArray
    weights: FloatArray
    nodes: IntArray

    def at(self, values: FloatArray) -> FloatArray:
        """Values there, of values at the vertices of the surface."""
        return np.asarray(np.einsum("qi,qi...->q...", self.weights, values[self.nodes]))


class ClosestFinder:
    """A surface prepared for many searches.

    Parameters
    ----------
    points : (n, 3) array
        Vertices, mm.
    triangles : (m, 3) array
        Corner numbers.

    Raises
    ------
    InputError
        A wrong shape, a point that is not finite, a corner number out of range, or no triangles.
    """

    def __init__(self, points: npt.ArrayLike, triangles: npt.ArrayLike) -> None:
        self.points, self.triangles = check_mesh(points, triangles)
        if len(self.triangles) == 0:
            raise InputError("the surface has no triangles, so that no point of it is closest; give at least one")
        self._tree: BoxTree = build_tree(self.points, self.triangles)
        self._pseudonormals: tuple[FloatArray, FloatArray, FloatArray] | None = None

    def __call__(self, queries: npt.ArrayLike, within: FloatArray | None = None) -> Closest:
        """Closest points for queries ``(q, 3)``, mm.

        Parameters
        ----------
        queries : (q, 3) array
        within : (q,) array, optional
            Distances, mm; a query that is not nearer has distance infinity, triangle -1 and weights 0. Small ones are
            quick.
        """
        q = _check_queries(queries)
        triangle, weights = self._found(q, np.full(len(q), np.inf) if within is None else within)
        nodes = self.triangles[triangle]
        foot = np.einsum("qi,qik->qk", weights, self.points[nodes])
        distance = np.linalg.norm(q - foot, axis=1)
        if within is not None:
            distance[triangle < 0] = np.inf
        return Closest(distance, foot, triangle, weights, nodes)

    def any_within(self, queries: npt.ArrayLike, distance: npt.ArrayLike) -> BoolArray:
        """Whether some point of the surface is nearer than a distance, mm, to each of queries ``(q, 3)``.

        Much quicker than the closest points themselves where the distances are small.
        """
        q = _check_queries(queries)
        limit = np.ascontiguousarray(np.broadcast_to(np.asarray(distance, dtype=np.float64), (len(q),)))
        return np.asarray(self._found(q, limit)[0] >= 0)

    def _found(self, q: FloatArray, limit: FloatArray) -> tuple[IntArray, FloatArray]:
        """Closest triangle nearer than a limit for each query, -1 where none is, and the foot's weights."""
        triangle = np.full(len(q), -1, dtype=np.int64)
        weights = np.zeros((len(q), 3))
        if len(q) <= CHUNK:
            _search(1, q, self.points, self.triangles, *self._tree, limit, triangle, weights)
            return triangle, weights
        # What is near each other is searched for one after the other, which takes half the time.
        order = curve_order(q)
        found, shares = triangle.copy(), weights.copy()
        _search(-(-len(q) // CHUNK), q[order], self.points, self.triangles, *self._tree, limit[order], found, shares)
        triangle[order], weights[order] = found, shares
        return triangle, weights

    def signed(self, queries: npt.ArrayLike) -> FloatArray:
        """Distance of queries ``(q, 3)`` from the closed surface, ``(q,)`` mm: negative inside, see :meth:`sided`."""
        return self.sided(queries)[0]

    def sided(self, queries: npt.ArrayLike, within: FloatArray | None = None) -> tuple[FloatArray, Closest]:
        """Distance of queries ``(q, 3)`` from the closed surface, ``(q,)`` mm: negative inside, positive outside;
        and the closest points.

        Where nothing of it is within a distance, this is infinity, whichever the side. The side is told by the normal
        of the triangle, the edge or the vertex the closest point lies on, each the angle-weighted mean of the triangles
        there [1]_.

        Raises
        ------
        InputError
            The surface is open or not consistently wound, so that it has no inside.

        References
        ----------
        .. [1] Baerentzen & Aanaes, Signed distance computation using the angle weighted pseudonormal, IEEE TVCG
           11(3), 2005. doi:10.1109/TVCG.2005.49
        """
        if self._pseudonormals is None:
            if not is_closed(self.triangles):
                raise InputError("the surface is not closed, so that no point lies inside it; close it first")
            if not is_consistently_wound(self.triangles):
                raise InputError("the surface is not consistently wound, so that inside and outside are undefined")
            face = normals(self.points, self.triangles)
            table = edge_table(self.triangles)
            edge = face[table.cells].sum(axis=1)[table.of_cell]
            self._pseudonormals = face, edge, vertex_normals(self.points, self.triangles)
        q = _check_queries(queries)
        closest = self(q, within)
        face, edge, vertex = self._pseudonormals
        normal = face[closest.triangle]
        zero = closest.weights == 0.0
        on_edge = zero.sum(axis=1) == 1
        # The edge opposite corner k runs from corner k + 1.
        side = (np.argmax(zero[on_edge], axis=1) + 1) % 3
        normal[on_edge] = edge[closest.triangle[on_edge], side]
        at_vertex = zero.sum(axis=1) == 2
        corner = np.argmin(zero[at_vertex], axis=1)
        normal[at_vertex] = vertex[self.triangles[closest.triangle[at_vertex], corner]]
        outward = np.einsum("qk,qk->q", q - closest.points, normal)
        inside = (outward < 0.0) & (closest.triangle >= 0)
        return np.where(inside, -closest.distance, closest.distance), closest


def _check_queries(queries: npt.ArrayLike) -> FloatArray:
    q = np.ascontiguousarray(queries, dtype=np.float64)
    if q.ndim != 2 or q.shape[1] != 3:
        raise InputError(f"query points have shape {q.shape}, expected (q, 3)")
    if not np.isfinite(q).all():
        row = int(np.argmin(np.isfinite(q).all(axis=1)))
        raise InputError(f"query point {row} is {q[row].tolist()}, expected finite coordinates")
    return q


@compiled(inner=True)
def closest_on_triangle(q: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray) -> tuple[float, float, float]:
    """Barycentric coordinates of the point of a, b, c closest to q (Ericson, Real-time collision detection, 5.1.5)."""
    abx, aby, abz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    acx, acy, acz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    x, y, z = q[0] - a[0], q[1] - a[1], q[2] - a[2]
    d1, d2 = abx * x + aby * y + abz * z, acx * x + acy * y + acz * z
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    x, y, z = q[0] - b[0], q[1] - b[1], q[2] - b[2]
    d3, d4 = abx * x + aby * y + abz * z, acx * x + acy * y + acz * z
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        return 1.0 - v, v, 0.0
    x, y, z = q[0] - c[0], q[1] - c[1], q[2] - c[2]
    d5, d6 = abx * x + aby * y + abz * z, acx * x + acy * y + acz * z
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        return 1.0 - w, 0.0, w
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 0.0, 1.0 - w, w
    total = va + vb + vc
    v, w = vb / total, vc / total
    return 1.0 - v - w, v, w


@compiled(inner=True, part=True)
def _try(
    q: FloatArray,
    points: FloatArray,
    triangles: IntArray,
    t: int,
    best: float,
    i: int,
    triangle: IntArray,
    weights: FloatArray,
) -> float:
    """Take triangle t for query i where it is nearer than the best; the square of the least distance."""
    a, b, c = points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]]
    wa, wb, wc = closest_on_triangle(q, a, b, c)
    gap = 0.0
    for axis in range(3):
        step = wa * a[axis] + wb * b[axis] + wc * c[axis] - q[axis]
        gap += step * step
    if gap < best or (gap == best and t < triangle[i]):
        triangle[i] = t
        weights[i, 0], weights[i, 1], weights[i, 2] = wa, wb, wc
        return gap
    return best


@compiled(grain=2, writes="triangle weights")
def _search(
    first: int,
    last: int,
    queries: FloatArray,
    points: FloatArray,
    triangles: IntArray,
    low: FloatArray,
    high: FloatArray,
    order: IntArray,
    limit: FloatArray,
    triangle: IntArray,
    weights: FloatArray,
) -> None:
    """Nearer child first; of equally close triangles the smallest number wins, so that threads change nothing.

    Queries next to each other are mostly near each other: what is closest to one bounds the search for the next.
    """
    # Whole numbers of the processor: numba would compile what gets a 1 once more for the number 1.
    nothing, one = np.int64(-1), np.int64(1)
    for chunk in range(first, last):
        stack, bound = np.empty(64, dtype=np.int64), np.empty(64)
        before = nothing
        for i in range(chunk * CHUNK, min((chunk + 1) * CHUNK, len(queries))):
            q = queries[i]
            best = limit[i] * limit[i]
            if before >= 0:
                best = _try(q, points, triangles, before, best, i, triangle, weights)
            stack[0], bound[0] = 1, 0.0
            depth = one
            while True:
                leaf, depth = next_leaf(q, low, high, best, stack, bound, depth)
                if leaf < 0:
                    break
                for k in range(leaf * LEAF, min(leaf * LEAF + LEAF, len(order))):
                    best = _try(q, points, triangles, order[k], best, i, triangle, weights)
            before = triangle[i]
