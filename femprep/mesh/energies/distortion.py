"""Triangles and their ideal shapes in, how far they are from those and the gradient of that out: compiled loops.

The measure of a triangle is the square of its inverse mean ratio [1]_, which is 1 where it is its ideal one scaled and
turned, and how far its area is from the ideal one's. It is infinite where a triangle is folded, unless its area is
replaced by a positive function of it [2]_, so that the same descent unfolds.

References
----------
.. [1] Knupp, Algebraic mesh quality metrics, SIAM J. Sci. Comput. 23(1), 2001. doi:10.1137/S1064827500371499
.. [2] Escobar et al., Simultaneous untangling and smoothing of tetrahedral meshes, Comput. Methods Appl. Mech. Eng.
   192, 2003. doi:10.1016/S0045-7825(03)00299-8
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.mesh.energies.simplex import sides_and_normal
from femprep.mesh.measures.triangles import area_vectors, corners
from femprep.model import BoolArray, FloatArray, IntArray
from femprep.model.products import unit_vectors

#: Cosine between a triangle's normal and that of the surface at its corners below which it counts as folded.
_UPRIGHT = 0.1


@dataclass(frozen=True, eq=False)
class Ideal:
    """Ideal shapes of triangles.

    Attributes
    ----------
    cells : (m, 3) array
        Corners.
    metric : (m, 3) array
        Inverse of the Gram matrix of the two ideal sides at the first corner: 11, 12, 22.
    area : (m,) array
        Twice the ideal area.
    weight : (m,) array
        What each triangle counts.
    spanned : bool
        Whether areas are those of the smooth surface which triangles span, by its normals, not their own flat ones,
        which would be small again where a large triangle cuts off a sharp end.
    """

    cells: IntArray
    metric: FloatArray
    area: FloatArray
    weight: FloatArray
    spanned: bool

    @classmethod
    def even(cls, cells: IntArray, area: FloatArray) -> Ideal:
        """Equilateral triangles or squares of given areas ``(m,)``; a square is seen from each of its corners."""
        if cells.shape[1] == 3:
            # Gram matrix of two unit sides at 60 degrees; area sqrt(3) / 4.
            double, side = 2.0 * area, np.sqrt(4.0 / np.sqrt(3.0) * area)
            metric = np.array([4.0, -2.0, 4.0]) / 3.0 / (side * side)[:, None]
            return cls(np.ascontiguousarray(cells), metric, double, np.full(len(cells), 1.0 / len(cells)), True)
        parts = np.concatenate([np.roll(cells, -k, axis=1)[:, [0, 1, 3]] for k in range(4)])
        whole = np.tile(area, 4)
        metric = np.array([1.0, 0.0, 1.0]) / whole[:, None]
        return cls(np.ascontiguousarray(parts), metric, whole, np.full(len(parts), 1.0 / len(parts)), True)

    @classmethod
    def of(cls, points: FloatArray, cells: IntArray, scale: FloatArray) -> Ideal:
        """The triangles of another mesh, their lengths multiplied by ``scale`` ``(m,)``; each counts by its area."""
        p = corners(points, cells) * scale[:, None, None]
        a, b = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
        aa, ab, bb = (np.einsum("ij,ij->i", x, y) for x, y in ((a, a), (a, b), (b, b)))
        det = aa * bb - ab * ab
        area = np.sqrt(det)
        metric = np.stack([bb, -ab, aa], axis=1) / det[:, None]
        return cls(np.ascontiguousarray(cells), metric, area, area / area.sum(), False)

    def measure(
        self, points: FloatArray, normals: FloatArray, bend: FloatArray, size: float, delta: float = 0.0
    ) -> tuple[float, FloatArray]:
        """The weighted sum over the triangles and its gradient ``(n, 3)``.

        Parameters
        ----------
        points, normals : (n, 3) arrays
            Vertices and unit normals of their surface.
        bend : (n, 3, 3) array
            How the normal changes with the point, symmetric.
        size : float
            What the area counts beside the shape.
        delta : float
            Share of the ideal area below which areas are replaced by a positive function of them; 0: never, the sum is
            infinite where a triangle is folded.
        """
        each = np.empty(len(self.cells))
        total, slopes = self._measured(points, normals, size, delta, each)
        # In the order of the points: it decides in which order sums are taken.
        gradient, by_normal = (np.copy(x, order="F" if points.flags.fnc else "C") for x in slopes)
        return total, gradient + np.einsum("nij,nj->ni", bend, by_normal)

    def each(self, points: FloatArray, normals: FloatArray, size: float) -> FloatArray:
        """The measure of each triangle ``(m,)``, not weighted; infinite for one that is folded."""
        each = np.full(len(self.cells), np.inf)
        self._measured(points, normals, size, 0.0, each)
        return each

    def _measured(
        self, points: FloatArray, normals: FloatArray, size: float, delta: float, each: FloatArray
    ) -> tuple[float, FloatArray]:
        """The weighted sum, and its slopes by points and by normals ``(2, n, 3)``; ``each`` is filled in."""
        slopes = np.zeros((2, *points.shape))
        ideal = self.cells, self.metric, self.area, self.weight, self.spanned
        rows = np.ascontiguousarray(points), np.ascontiguousarray(normals)  # one order: the kernel is compiled once
        return float(_measure(*rows, ideal, size, delta, each, *slopes)), slopes

    def least(self, points: FloatArray, normals: FloatArray) -> float:
        """The least area as a share of the ideal one, negative where a triangle is folded."""
        return float(self._shares(points, normals).min())

    def folded(self, points: FloatArray, normals: FloatArray) -> BoolArray:
        """Whether each triangle is folded."""
        return self._shares(points, normals) <= 0.0

    def _shares(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        up = unit_vectors(normals[self.cells].sum(axis=1))
        return np.asarray(2.0 * np.einsum("ij,ij->i", area_vectors(points, self.cells), up) / self.area)


@compiled(writes="each gradient by_normal")
def _measure(
    points: Any, normals: Any, ideal: Any, size: float, delta: float, each: Any, gradient: Any, by_normal: Any
) -> float:
    cells, metric, area, weight, spanned = ideal
    total = 0.0
    for t in range(len(cells)):
        i = cells[t, 0]
        j = cells[t, 1]
        k = cells[t, 2]
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = sides_and_normal(points, i, j, k)
        nx = normals[i, 0] + normals[j, 0] + normals[k, 0]
        ny = normals[i, 1] + normals[j, 1] + normals[k, 1]
        nz = normals[i, 2] + normals[j, 2] + normals[k, 2]
        length = np.sqrt(nx * nx + ny * ny + nz * nz) + 1e-300
        # The surface's own area: a flat triangle over a sharp end is smaller than what it spans.
        ux = nx / 3.0
        uy = ny / 3.0
        uz = nz / 3.0
        nx /= length
        ny /= length
        nz /= length
        double = np.sqrt(cx * cx + cy * cy + cz * cz)
        up = cx * nx + cy * ny + cz * nz
        rate = 1.0
        over = 1.0
        fall = 0.0
        wx = nx
        wy = ny
        wz = nz
        if delta > 0.0:
            det = up / area[t]
            root = np.sqrt(det * det + 4.0 * delta * delta)
            rate = 0.5 * (1.0 + det / root)
            det = 0.5 * (det + root)
        else:
            if not up > _UPRIGHT * double:
                each[t] = np.inf
                total = np.inf
                continue
            det = double / area[t]
            nx = cx / double
            ny = cy / double
            nz = cz / double
            wx = nx
            wy = ny
            wz = nz
            if spanned:
                tilt = max(ux * nx + uy * ny + uz * nz, _UPRIGHT)
                over = 1.0 / tilt
                # Derivative of |c|^2 / (c . u) by c, and by u.
                wx = over * (2.0 * nx - over * ux)
                wy = over * (2.0 * ny - over * uy)
                wz = over * (2.0 * nz - over * uz)
                fall = -det * over * over / 3.0 if tilt > _UPRIGHT else 0.0
        m11 = metric[t, 0]
        m12 = metric[t, 1]
        m22 = metric[t, 2]
        sides = (
            m11 * (ax * ax + ay * ay + az * az)
            + 2.0 * m12 * (ax * bx + ay * by + az * bz)
            + m22 * (bx * bx + by * by + bz * bz)
        )
        skew = 0.5 * sides / det
        span = det * over
        square = span * span
        each[t] = skew * skew + size * (0.5 * (square + 1.0 / square) - 1.0)
        total += weight[t] * each[t]
        # By the sum of squared sides, by the area of the triangle, and by that of what it spans.
        gs = weight[t] * skew / det
        gd = -2.0 * weight[t] * skew * skew / det * rate / area[t]
        gw = weight[t] * size * (span - 1.0 / (square * span))
        ga = gw * rate / area[t]
        if fall != 0.0:
            for n in range(3):
                v = cells[t, n]
                by_normal[v, 0] += gw * fall * nx
                by_normal[v, 1] += gw * fall * ny
                by_normal[v, 2] += gw * fall * nz
        vx = gd * nx + ga * wx
        vy = gd * ny + ga * wy
        vz = gd * nz + ga * wz
        gax = gs * 2.0 * (m11 * ax + m12 * bx) + by * vz - bz * vy
        gay = gs * 2.0 * (m11 * ay + m12 * by) + bz * vx - bx * vz
        gaz = gs * 2.0 * (m11 * az + m12 * bz) + bx * vy - by * vx
        gbx = gs * 2.0 * (m12 * ax + m22 * bx) + vy * az - vz * ay
        gby = gs * 2.0 * (m12 * ay + m22 * by) + vz * ax - vx * az
        gbz = gs * 2.0 * (m12 * az + m22 * bz) + vx * ay - vy * ax
        gradient[j, 0] += gax
        gradient[j, 1] += gay
        gradient[j, 2] += gaz
        gradient[k, 0] += gbx
        gradient[k, 1] += gby
        gradient[k, 2] += gbz
        gradient[i, 0] -= gax + gbx
        gradient[i, 1] -= gay + gby
        gradient[i, 2] -= gaz + gbz
    return total
