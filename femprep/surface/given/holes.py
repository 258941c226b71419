"""The rim of a hole in, triangles that fill it without further points out."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.model import FloatArray, IntArray

#: Rims of more edges are filled from their middle corner outwards by halves, which costs less than trying all ways.
_ALL_WAYS: Final = 80


def extent(rim: FloatArray) -> float:
    """Greatest distance between two corners of a rim ``(n, 3)``, mm."""
    step = max(1, len(rim) // 200)
    some = rim[::step]
    return float(np.linalg.norm(some[:, None] - some[None], axis=2).max())


def perimeter(rim: FloatArray) -> float:
    """Length of a rim ``(n, 3)``, mm."""
    return float(np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1).sum())


def filled(points: FloatArray, loop: IntArray) -> IntArray:
    """Triangles ``(n - 2, 3)`` of least area on the corners of a rim [1]_.

    Parameters
    ----------
    points : (k, 3) array
    loop : (n,) array
        Corners in the order in which the triangles around run along them.

    References
    ----------
    .. [1] Barequet & Sharir, Filling gaps in the boundary of a polyhedron, Comput. Aided Geom. Des. 12(2), 1995.
       doi:10.1016/0167-8396(94)00011-G
    """
    ring = loop[::-1]  # the other way round than the triangles beside it
    if len(ring) > _ALL_WAYS:
        half = len(ring) // 2
        return np.concatenate(
            [filled(points, ring[: half + 1][::-1]), filled(points, np.r_[ring[half:], ring[0]][::-1])]
        )
    p, n = points[ring], len(ring)
    cost, split = np.zeros((n, n)), np.zeros((n, n), dtype=np.int64)
    for gap in range(2, n):
        for i in range(n - gap):
            k = i + gap
            middle = np.arange(i + 1, k)
            area = 0.5 * np.linalg.norm(np.cross(p[middle] - p[i], p[k] - p[i]), axis=1)
            total = cost[i, middle] + cost[middle, k] + area
            best = int(total.argmin())
            cost[i, k], split[i, k] = total[best], middle[best]
    found, open_ = [], [(0, n - 1)]
    while open_:
        i, k = open_.pop()
        if k - i < 2:
            continue
        m = int(split[i, k])
        found.append((ring[i], ring[m], ring[k]))
        open_ += [(i, m), (m, k)]
    return np.array(found, dtype=np.int64).reshape(-1, 3)
