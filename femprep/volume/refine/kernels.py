"""Compiled kernels of the refinement: the diagonal of each tetrahedron, and its eight children."""

from __future__ import annotations

import numba

from femprep.mesh.compiled import compiled
from femprep.model import FloatArray, IntArray, TagArray


@compiled(part=True)
def _square(points: FloatArray, a: int, b: int) -> float:
    x, y, z = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    return float(x * x + y * y + z * z)


@compiled(parallel=True)
def cut_tetrahedra(points: FloatArray, lattice: IntArray, table: IntArray, out: IntArray, diagonal: TagArray) -> None:
    """Cut tetrahedra given by their ten nodes along the shortest diagonal; of equal ones along the first.

    ``out`` ``(8 m, 4)`` takes the children, eight after eight, ``diagonal`` ``(m,)`` which of the three it was.
    """
    for i in numba.prange(len(lattice)):
        chosen = 0
        least = _square(points, lattice[i, 4], lattice[i, 9])
        for d in range(1, 3):
            far = _square(points, lattice[i, 4 + d], lattice[i, 6 + d])
            if far < least:
                chosen, least = d, far
        diagonal[i] = chosen
        for c in range(8):
            for k in range(4):
                out[8 * i + c, k] = lattice[i, table[chosen, c, k]]
