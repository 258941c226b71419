"""Vertices of a smooth closed surface in, points projected onto it out: blended cubic patches, one about each vertex.

A fitted surface is smooth, its triangles are not, and to evaluate its map from the sphere takes long. Here each
vertex carries the cubic height over its tangent plane that fits its first two rings of neighbours; between vertices the
patches are blended. The error is of fourth order in the edge length.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.mesh.banded import SPARE, factorise, substitute
from femprep.mesh.compiled import compiled
from femprep.mesh.measures.triangles import vertex_normals
from femprep.mesh.tangents import tangents
from femprep.mesh.topology import adjacency
from femprep.model import FloatArray, IntArray, Plane

#: Reach of a patch in mean edge lengths of its vertex: wide enough that two or three overlap everywhere.
_REACH = 1.1
#: A vertex with fewer neighbours in two rings than this gets quadratic heights only.
_CUBIC = 12


def plane_table(planes: Iterable[Plane]) -> FloatArray:
    """Normal and offset of each plane, ``(p, 4)``: what :meth:`PatchSurface.settle` and kernels take."""
    return np.array([[*plane.normal, plane.offset] for plane in planes]).reshape(-1, 4)


class PatchSurface:
    """A smooth surface through given vertices, prepared for projections.

    Parameters
    ----------
    points : (n, 3) array
        Vertices, mm.
    triangles : (m, 3) array
        Consistently wound.

    Attributes
    ----------
    points : (n, 3) array
        The vertices.
    triangles : (m, 3) array
        The triangles.
    arrays : tuple of arrays
        What the compiled kernels take: vertices, frames, coefficients, reaches, neighbours.
    """

    def __init__(self, points: npt.ArrayLike, triangles: npt.ArrayLike) -> None:
        self.points: FloatArray = np.ascontiguousarray(points, dtype=np.float64)
        self.triangles: IntArray = np.ascontiguousarray(triangles, dtype=np.int64)
        matrix = adjacency(self.triangles, len(self.points))
        ring = _rows(matrix)
        double = _rows(matrix @ matrix + matrix)
        normal = vertex_normals(self.points, self.triangles)
        frames = np.ascontiguousarray(np.concatenate([tangents(normal), normal[:, None]], axis=1))
        present = ring >= 0
        span = np.linalg.norm(self.points[ring] - self.points[:, None], axis=2) * present
        reach = _REACH * span.sum(axis=1) / np.maximum(present.sum(axis=1), 1)
        self.arrays = (self.points, frames, _heights(self.points, frames, double), reach, ring)

    def nearest(self, queries: npt.ArrayLike) -> IntArray:
        """Number of the closest vertex for queries ``(q, 3)``."""
        from scipy.spatial import cKDTree

        return np.asarray(cKDTree(self.points).query(np.asarray(queries, dtype=np.float64))[1], dtype=np.int64)

    def bend(self) -> FloatArray:
        """How the unit normal changes with the point at each vertex, ``(n, 3, 3)`` 1/mm: minus the shape operator."""
        _, frames, heights, _, _ = self.arrays
        second = np.zeros((len(self.points), 2, 2))
        second[:, 0, 0], second[:, 1, 1] = 2.0 * heights[:, 2], 2.0 * heights[:, 4]
        second[:, 0, 1] = second[:, 1, 0] = heights[:, 3]
        return -np.einsum("nai,nab,nbj->nij", frames[:, :2], second, frames[:, :2])

    def project(self, queries: npt.ArrayLike, near: IntArray | None = None) -> tuple[FloatArray, FloatArray]:
        """Feet of points near the surface on it, and the unit normals there; arguments as of :meth:`settle`."""
        points, normals, _ = self.settle(queries, near)
        return points, normals

    def settle(
        self,
        queries: npt.ArrayLike,
        near: IntArray | None = None,
        flat: npt.ArrayLike | None = None,
        planes: npt.ArrayLike | None = None,
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """Put points near the surface onto it, and those of a rim onto their plane as well, exactly.

        Parameters
        ----------
        queries : (q, 3) array
            mm.
        near : (q,) array, optional
            A vertex near each query, from which its closest one is found; by default all are searched.
        flat : (q,) array, optional
            0 for a point of the surface, k for one of its curve in the plane number k, counted from 1.
        planes : (p, 4) array, optional
            Unit normal and offset of each plane.

        Returns
        -------
        points, normals : (q, 3) arrays
            Feet and unit normals of the surface there.
        near : (q,) array
            The vertex closest to each.
        """
        points = np.array(queries, dtype=np.float64, order="C")
        normals = np.empty_like(points)
        start = self.nearest(points) if near is None else np.array(near, dtype=np.int64)
        kind = np.zeros(len(points), dtype=np.int64) if flat is None else np.asarray(flat, dtype=np.int64)
        table = np.zeros((0, 4)) if planes is None else np.ascontiguousarray(planes, dtype=np.float64)
        settle_all(len(points), points, normals, start, kind, table, self.arrays)
        return points, normals, start


def _rows(matrix: Any) -> IntArray:
    """Columns of each row of a sparse matrix, without the diagonal, padded by -1."""
    matrix.setdiag(0)
    matrix.eliminate_zeros()
    matrix.sort_indices()
    length = np.diff(matrix.indptr)
    table = np.full((len(length), int(length.max(initial=0))), -1, dtype=np.int64)
    row = np.repeat(np.arange(len(length)), length)
    table[row, np.arange(len(row)) - matrix.indptr[row]] = matrix.indices
    return table


def _heights(points: FloatArray, frames: FloatArray, near: IntArray) -> FloatArray:
    """Coefficients ``(n, 9)`` of u, v, u^2, uv, v^2, u^3, u^2 v, u v^2, v^3 that fit the neighbours' heights."""
    found = np.zeros((len(points), 9))
    _fit_heights(len(points), points, frames, near, found)
    return found


@compiled(grain=64, writes="found")
def _fit_heights(first: int, last: int, points: Any, frames: Any, near: Any, found: Any) -> None:
    for i in range(first, last):
        _fit_height(points, frames[i], i, near[i], found[i])


@compiled(inner=True)
def _fit_height(points: Any, frame: Any, i: int, near: Any, found: Any) -> None:
    """Weighted least squares, in lengths by the mean distance of the neighbours: nearer ones count more."""
    local = np.zeros((len(near), 3))
    count = 0
    square = 0.0
    while count < len(near) and near[count] >= 0:
        for a in range(3):
            for k in range(3):
                local[count, a] += (points[near[count], k] - points[i, k]) * frame[a, k]
        square += local[count, 0] ** 2 + local[count, 1] ** 2
        count += 1
    if square == 0.0:
        return
    size = np.sqrt(square / count)
    # Entry of row a and column b at [a, b - a], as a band of full width.
    normal = np.zeros((9, 9 + SPARE))
    right = np.zeros((1, 9))
    for n in range(count):
        u, v, height = local[n, 0] / size, local[n, 1] / size, local[n, 2] / size
        terms = (u, v, u * u, u * v, v * v, u * u * u, u * u * v, u * v * v, v * v * v)
        weight = 1.0 / (0.3 + u * u + v * v)
        for a in range(9):
            right[0, a] += weight * terms[a] * height
            for b in range(a, 9):
                normal[a, b - a] += weight * terms[a] * terms[b]
    trace = 0.0
    for a in range(9):
        trace += normal[a, 0]
    # Little ridge for all; one that rules the cubic terms out where there are too few neighbours for them.
    for a in range(9):
        normal[a, 0] += trace * (1e3 if a >= 5 and count < _CUBIC else 1e-7)
    factorise(normal)
    substitute(normal, right)
    for a in range(9):
        found[a] = right[0, a] / (1.0 if a < 2 else size if a < 5 else size * size)


@compiled(inner=True)
def walk(x: float, y: float, z: float, near: int, points: Any, ring: Any) -> int:
    """The closest vertex, from one nearby: to closer neighbours until there is none."""
    best = (points[near, 0] - x) ** 2 + (points[near, 1] - y) ** 2 + (points[near, 2] - z) ** 2
    moved = True
    while moved:
        moved = False
        here = near
        for k in range(ring.shape[1]):
            j = ring[here, k]
            if j < 0:
                break
            gap = (points[j, 0] - x) ** 2 + (points[j, 1] - y) ** 2 + (points[j, 2] - z) ** 2
            if gap < best:
                best = gap
                near = j
                moved = True
    return near


@compiled(inner=True)
def project(
    x: float, y: float, z: float, near: int, points: Any, frames: Any, coefficients: Any, reach: Any, ring: Any
) -> tuple[float, float, float, float, float, float, int]:
    """Foot of a point, unit normal there, and the closest vertex: two rounds of blended feet."""
    nx = frames[near, 2, 0]
    ny = frames[near, 2, 1]
    nz = frames[near, 2, 2]
    for _ in range(2):
        near = walk(x, y, z, near, points, ring)
        total = 0.0
        fx = 0.0
        fy = 0.0
        fz = 0.0
        nx = 0.0
        ny = 0.0
        nz = 0.0
        for k in range(-1, ring.shape[1]):
            s = near if k < 0 else ring[near, k]
            if s < 0:
                break
            dx = x - points[s, 0]
            dy = y - points[s, 1]
            dz = z - points[s, 2]
            t = 1.0 - (dx * dx + dy * dy + dz * dz) / (reach[s] * reach[s])
            weight = t * t if t > 0.0 else 0.0
            if k < 0:
                # Never nothing, also for a point far from all vertices.
                weight = max(weight, 1e-6)
            if weight == 0.0:
                continue
            u = dx * frames[s, 0, 0] + dy * frames[s, 0, 1] + dz * frames[s, 0, 2]
            v = dx * frames[s, 1, 0] + dy * frames[s, 1, 1] + dz * frames[s, 1, 2]
            w = dx * frames[s, 2, 0] + dy * frames[s, 2, 1] + dz * frames[s, 2, 2]
            c = coefficients[s]
            h = u * (c[0] + u * (c[2] + u * c[5] + v * c[6])) + v * (c[1] + u * c[3] + v * (c[4] + u * c[7] + v * c[8]))
            hu = c[0] + u * (2.0 * c[2] + 3.0 * u * c[5] + 2.0 * v * c[6]) + v * (c[3] + v * c[7])
            hv = c[1] + v * (2.0 * c[4] + 3.0 * v * c[8] + 2.0 * u * c[7]) + u * (c[3] + u * c[6])
            slope = 1.0 / (1.0 + hu * hu + hv * hv)
            drop = (w - h) * slope
            length = np.sqrt(slope)
            mx = frames[s, 2, 0] - hu * frames[s, 0, 0] - hv * frames[s, 1, 0]
            my = frames[s, 2, 1] - hu * frames[s, 0, 1] - hv * frames[s, 1, 1]
            mz = frames[s, 2, 2] - hu * frames[s, 0, 2] - hv * frames[s, 1, 2]
            total += weight
            fx += weight * drop * mx
            fy += weight * drop * my
            fz += weight * drop * mz
            nx += weight * length * mx
            ny += weight * length * my
            nz += weight * length * mz
        x -= fx / total
        y -= fy / total
        z -= fz / total
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        nx /= length
        ny /= length
        nz /= length
    return x, y, z, nx, ny, nz, near


@compiled(inner=True)
def settle(
    point: Any,
    normal: Any,
    near: int,
    flat: int,
    planes: Any,
    points: Any,
    frames: Any,
    coefficients: Any,
    reach: Any,
    ring: Any,
) -> int:
    """Put a point onto its surface, in place; a rim point onto the plane as well. Returns the closest vertex."""
    rounds = 1 if flat == 0 else 4
    for r in range(rounds):
        x, y, z, nx, ny, nz, near = project(
            point[0], point[1], point[2], near, points, frames, coefficients, reach, ring
        )
        point[0] = x
        point[1] = y
        point[2] = z
        normal[0] = nx
        normal[1] = ny
        normal[2] = nz
        if flat > 0:
            plane = planes[flat - 1]
            gap = plane[0] * x + plane[1] * y + plane[2] * z - plane[3]
            tilt = plane[0] * nx + plane[1] * ny + plane[2] * nz
            # Along the surface while both are near a right angle, else straight: at the end straight, exactly.
            rise = 1.0 - tilt * tilt
            along = r < rounds - 1 and rise > 0.05
            for k in range(3):
                if along:
                    point[k] -= gap * (plane[k] - tilt * normal[k]) / rise
                else:
                    point[k] -= gap * plane[k]
    return near


@compiled(grain=128, writes="moving normals near")
def settle_all(
    first: int, last: int, moving: Any, normals: Any, near: Any, flat: Any, planes: Any, surface: Any
) -> None:
    """Put all points onto their surface and planes, in place."""
    points, frames, coefficients, reach, ring = surface
    for v in range(first, last):
        near[v] = settle(moving[v], normals[v], near[v], flat[v], planes, points, frames, coefficients, reach, ring)
