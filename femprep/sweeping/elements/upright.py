"""Points and swept elements in, whether each stands upright out: the determinants of the edges at its corners."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numba import prange

from femprep.mesh.compiled import compiled
from femprep.mesh.energies.simplex import determinant
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
            o, p, q, r = corners[k]
            least = min(least, determinant(points, cells[e, o], cells[e, p], cells[e, q], cells[e, r]))
        out[e] = least
