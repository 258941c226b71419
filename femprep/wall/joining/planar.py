"""Rings of points in a plane in, well-shaped triangles between them out: a constrained Delaunay triangulation.

The rings are kept as they are, edge by edge, so that the triangles fit onto the surfaces that end there. Points are
added inside at the spacing of the rings, and relaxed.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from femprep.errors import StageError
from femprep.model import BoolArray, FloatArray, IntArray, Plane
from femprep.model.products import inner, product
from femprep.wall.joining.solid import plane_frame, triangulate_rings

#: Added points keep this share of the local spacing from the rings and from each other.
_FROM_RING, _APART = 0.62, 0.8
#: Rounds of relaxing the added points.
_ROUNDS = 4


def fill_rings(rings: Sequence[FloatArray]) -> tuple[FloatArray, IntArray]:
    """Triangulate the area between an outer ring and the rings inside it.

    Parameters
    ----------
    rings : sequence of (k, 2) arrays
        Simple polygons, the outer one first, in any sense; the others lie inside it and apart.

    Returns
    -------
    points : (n, 2) array
        The points of the rings in their order, then the added ones.
    triangles : (m, 3) array
        Counter-clockwise. Every edge of a ring is the edge of one triangle.

    Raises
    ------
    StageError
        The rings cross, so that an edge of one is no edge of the triangulation.
    """
    points = np.concatenate(rings)
    starts = np.cumsum([0, *(len(ring) for ring in rings)])
    loops = [np.arange(a, b) for a, b in pairwise(starts.tolist())]
    # Counter-clockwise outside, clockwise within.
    loops = [loop if (_area(points[loop]) > 0) == (i == 0) else loop[::-1] for i, loop in enumerate(loops)]
    edges = np.concatenate([np.stack([loop, np.roll(loop, -1)], axis=1) for loop in loops])
    mesh = _Delaunay(points, triangulate_rings(points, loops), {(int(a), int(b)) for a, b in edges})
    added = _inner_points(points, edges)
    for point in added:
        mesh.insert(point)
    for _ in range(_ROUNDS):
        mesh.relax(len(points))
    triangles = mesh.triangles()
    missing = [edge for edge in mesh.fixed if edge not in mesh.opposite]
    if missing:
        where = mesh.points[missing[0][0]]
        raise StageError(f"rings of the rim cross near {np.round(where, 2).tolist()} (mm in the plane)")
    return np.array(mesh.points), triangles


def flat_cap(rings: Sequence[FloatArray], plane: Plane) -> tuple[FloatArray, IntArray]:
    """Fill rings of points ``(k, 3)`` in a plane: points added in it, and triangles over all, the rings' first."""
    frame = plane_frame(plane)[:2]
    at, cap = fill_rings([product(ring - plane.point, frame.T) for ring in rings])
    added = product(at[sum(map(len, rings)) :], frame) + plane.point
    return plane.feet(added), cap


def _area(ring: FloatArray) -> float:
    x, y = ring.T
    return float(0.5 * (inner(x, np.roll(y, -1)) - inner(np.roll(x, -1), y)))


def _inner_points(points: FloatArray, edges: IntArray) -> FloatArray:
    """Points of a hexagonal lattice between the rings, thinned to the spacing of the rings nearby."""
    start, stop = points[edges[:, 0]], points[edges[:, 1]]
    length = np.linalg.norm(stop - start, axis=1)
    middle = 0.5 * (start + stop)
    fine = 0.9 * float(length.mean())
    low, high = points.min(axis=0), points.max(axis=0)
    rows = np.arange(low[1], high[1] + fine, fine * np.sqrt(0.75))
    columns = np.arange(low[0], high[0] + fine, fine)
    lattice = np.stack(np.broadcast_arrays(columns, rows[:, None]), axis=2)
    lattice[1::2, :, 0] += 0.5 * fine
    lattice = lattice.reshape(-1, 2)
    lattice = lattice[_inside(lattice, start, stop)]
    if not len(lattice):
        return np.empty((0, 2))
    # Spacing wished for at a point: of the rim edges, weighted by how near they are.
    gap = np.linalg.norm(lattice[:, None] - middle[None], axis=2)
    weight = 1.0 / (np.maximum(gap, 0.1 * fine) ** 2) ** 2
    size = (weight * length).sum(axis=1) / weight.sum(axis=1)
    far = _distance(lattice, start, stop) > _FROM_RING * size
    lattice, size = lattice[far], size[far]
    chosen: list[int] = []
    for i in range(len(lattice)):
        if not chosen or np.linalg.norm(lattice[chosen] - lattice[i], axis=1).min() > _APART * size[i]:
            chosen.append(i)
    return np.asarray(lattice[chosen])


def _inside(where: FloatArray, start: FloatArray, stop: FloatArray) -> BoolArray:
    """Whether points lie between the rings: a ray from each crosses an odd number of edges."""
    y = where[:, 1:2]
    spans = (start[:, 1] > y) != (stop[:, 1] > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        x = start[:, 0] + (y - start[:, 1]) * (stop[:, 0] - start[:, 0]) / (stop[:, 1] - start[:, 1])
    return np.asarray((spans & (where[:, 0:1] < x)).sum(axis=1) % 2 == 1)


def _distance(where: FloatArray, start: FloatArray, stop: FloatArray) -> FloatArray:
    """Distance of points from the nearest of the edges."""
    along = stop - start
    share = ((where[:, None] - start) * along).sum(axis=2) / (along**2).sum(axis=1)
    foot = start + np.clip(share, 0.0, 1.0)[..., None] * along
    return np.asarray(np.linalg.norm(where[:, None] - foot, axis=2).min(axis=1))


class _Delaunay:
    """A triangulation kept Delaunay by flips (Lawson 1977), but for fixed edges.

    ``opposite[u, v]`` is the third corner of the triangle to the left of the edge from u to v.
    """

    def __init__(self, points: FloatArray, triangles: IntArray, fixed: set[tuple[int, int]]) -> None:
        self.points: list[tuple[float, float]] = [(float(x), float(y)) for x, y in points]
        self.fixed = fixed
        self.opposite: dict[tuple[int, int], int] = {}
        self._last: tuple[int, int] | None = None
        for a, b, c in triangles.tolist():
            self._add(a, b, c)
        self._legalise(list(self.opposite))

    def triangles(self) -> IntArray:
        """All triangles, each starting at its smallest corner, sorted."""
        return np.array(sorted((u, v, w) for (u, v), w in self.opposite.items() if u < v and u < w), dtype=np.int64)

    def insert(self, point: FloatArray) -> None:
        """Add a point inside the triangulation."""
        p = (float(point[0]), float(point[1]))
        found = self._locate(p)
        if found is None:
            return
        a, b, c = found
        number = len(self.points)
        self.points.append(p)
        self._remove(a, b, c)
        for u, v in ((a, b), (b, c), (c, a)):
            self._add(u, v, number)
        self._last = (a, b)
        self._legalise([(a, b), (b, c), (c, a)])

    def _locate(self, p: tuple[float, float]) -> tuple[int, int, int] | None:
        """The triangle a point lies in: walk towards it, then look at all, for a walk may end at a ring."""
        points = self.points
        edge = self._last
        for _ in range(len(self.opposite)):
            if edge is None or edge not in self.opposite:
                break
            a, b = edge
            c = self.opposite[edge]
            out = [(v, u) for u, v in ((a, b), (b, c), (c, a)) if self._turn(points[u], points[v], p) <= 0]
            if not out:
                return a, b, c
            edge = next((step for step in out if step in self.opposite and step != (b, a)), None)
        for (a, b), c in self.opposite.items():
            corners = ((a, b), (b, c), (c, a))
            if a < b and a < c and all(self._turn(points[u], points[v], p) > 0 for u, v in corners):
                return a, b, c
        return None

    def relax(self, first: int) -> None:
        """Move the points from number ``first`` on to the middle of their neighbours where no triangle gets worse."""
        around: dict[int, list[tuple[int, int]]] = {}
        for (u, v), w in self.opposite.items():
            if w >= first:
                around.setdefault(w, []).append((u, v))
        for vertex in sorted(around):
            star = around[vertex]
            corners = [self.points[u] for u, _ in star]
            goal = (sum(x for x, _ in corners) / len(corners), sum(y for _, y in corners) / len(corners))
            old = self.points[vertex]
            for share in (1.0, 0.5, 0.25):
                place = (old[0] + share * (goal[0] - old[0]), old[1] + share * (goal[1] - old[1]))
                if min(self._shape(u, v, place) for u, v in star) >= min(self._shape(u, v, old) for u, v in star):
                    self.points[vertex] = place
                    break
        self._legalise(list(self.opposite))

    def _shape(self, u: int, v: int, p: tuple[float, float]) -> float:
        """Area over the sum of squared sides, signed: a quality that is smooth and knows a turned triangle."""
        a, b = self.points[u], self.points[v]
        sides = sum((q[0] - r[0]) ** 2 + (q[1] - r[1]) ** 2 for q, r in ((a, b), (b, p), (p, a)))
        return self._turn(a, b, p) / sides

    @staticmethod
    def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
        return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])

    def _add(self, a: int, b: int, c: int) -> None:
        self.opposite[a, b], self.opposite[b, c], self.opposite[c, a] = c, a, b

    def _remove(self, a: int, b: int, c: int) -> None:
        del self.opposite[a, b], self.opposite[b, c], self.opposite[c, a]

    def _legalise(self, edges: list[tuple[int, int]]) -> None:
        """Flip edges, and those around them in turn, until the circle of every triangle is empty."""
        points = self.points
        while edges:
            u, v = edges.pop()
            w, x = self.opposite.get((u, v)), self.opposite.get((v, u))
            if w is None or x is None:
                continue
            a, b, c, d = points[u], points[v], points[w], points[x]
            if self._turn(c, d, b) <= 0 or self._turn(d, c, a) <= 0:
                continue
            rows = [(p[0] - d[0], p[1] - d[1]) for p in (a, b, c)]
            (ax, ay), (bx, by), (cx, cy) = rows
            sa, sb, sc = ax * ax + ay * ay, bx * bx + by * by, cx * cx + cy * cy
            circle = ax * (by * sc - sb * cy) - ay * (bx * sc - sb * cx) + sa * (bx * cy - by * cx)
            # The margin keeps four points on one circle from flipping for ever.
            if circle <= 1e-10 * (sa + sb + sc) ** 2:
                continue
            self._remove(u, v, w)
            self._remove(v, u, x)
            self._add(w, x, v)
            self._add(x, w, u)
            edges.extend([(v, w), (w, u), (u, x), (x, v)])
