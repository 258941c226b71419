"""Points and swept elements in, whether each stands upright out: the determinants of the edges at its corners."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numba import prange

from femprep.mesh.compiled import compiled
from femprep.model import FloatArray, IntArray

#: A corner and the three ends of its edges, by element type, so that their determinant is positive.
_CORNERS: Final = {
    "tetra": np.array([[0, 1, 2, 3]]),
    "wedge": np.array([[0, 1, 2, 3], [1, 2, 0, 4], [2, 0, 1, 5], [3, 5, 4, 0], [4, 3, 5, 1], [5, 4, 3, 2]]),
    "hexahedron": np.array(
        [
            *([0, 1, 3, 4], [1, 2, 0, 5], [2, 3, 1, 6], [3, 0, 2, 7]),
            *([4, 7, 5, 0], [5, 4, 6, 1], [6, 5, 7, 2], [7, 6, 4, 3]),
        ]
    ),
}


def least_corner(points: FloatArray, cells: IntArray, name: str) -> FloatArray:
    """Least determinant of the three edges at a corner of each element ``(m,)``, mm3; not positive where inverted."""
    out = np.empty(len(cells))
    _least(np.ascontiguousarray(points), np.ascontiguousarray(cells), _CORNERS[name], out)
    return out


@compiled(parallel=True)
def _least(points: Any, cells: Any, corners: Any, out: Any) -> None:
    for e in prange(len(cells)):
        least = np.inf
        for k in range(len(corners)):
            o = cells[e, corners[k, 0]]
            p = cells[e, corners[k, 1]]
            q = cells[e, corners[k, 2]]
            r = cells[e, corners[k, 3]]
            ax = points[p, 0] - points[o, 0]
            ay = points[p, 1] - points[o, 1]
            az = points[p, 2] - points[o, 2]
            bx = points[q, 0] - points[o, 0]
            by = points[q, 1] - points[o, 1]
            bz = points[q, 2] - points[o, 2]
            cx = points[r, 0] - points[o, 0]
            cy = points[r, 1] - points[o, 1]
            cz = points[r, 2] - points[o, 2]
            least = min(least, ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx))
        out[e] = least
