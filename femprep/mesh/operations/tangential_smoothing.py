"""Vertices of a mesh in, the same vertices spread more evenly along its surface out: compiled loops."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.mesh.energies.simplex import sides_and_normal
from femprep.model import FloatArray, IntArray

#: Share of the way to the middle of its neighbours that a vertex goes in one pass.
_PACE: Final = 0.7


def smooth_tangentially(points: FloatArray, triangles: IntArray, passes: int) -> FloatArray:
    """Move vertices ``(n, 3)`` along the surface to the middle of their neighbours, larger triangles drawing more."""
    points = np.array(points, dtype=np.float64, order="C")
    _spread(points, np.ascontiguousarray(triangles), passes, _PACE)
    return points


@compiled(writes="points")
def _spread(points: Any, triangles: Any, passes: int, pace: float) -> None:
    count = len(points)
    size = np.empty(count)
    normal = np.empty((count, 3))
    middle = np.empty((count, 3))
    weight = np.empty(count)
    for _ in range(passes):
        size[:] = 0.0
        normal[:] = 0.0
        for t in range(len(triangles)):
            i, j, k = triangles[t]
            _, _, (nx, ny, nz) = sides_and_normal(points, i, j, k)
            area = np.sqrt(nx * nx + ny * ny + nz * nz)
            for v in (i, j, k):
                size[v] += area
                normal[v, 0] += nx
                normal[v, 1] += ny
                normal[v, 2] += nz
        middle[:] = 0.0
        weight[:] = 0.0
        for t in range(len(triangles)):
            for c in range(3):
                v = triangles[t, c]
                for w in (triangles[t, (c + 1) % 3], triangles[t, (c + 2) % 3]):
                    weight[v] += size[w]
                    for k in range(3):
                        middle[v, k] += size[w] * points[w, k]
        for v in range(count):
            square = 1e-300
            across = 0.0
            for k in range(3):
                square += normal[v, k] * normal[v, k]
                across += (middle[v, k] / weight[v] - points[v, k]) * normal[v, k]
            for k in range(3):
                points[v, k] += pace * (middle[v, k] / weight[v] - points[v, k] - across / square * normal[v, k])
