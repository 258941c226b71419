"""Fixed voxels in, the harmonic function between them out: nested relaxation on an isotropic grid (2.6)."""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.model import BoolArray, FloatArray
from femprep.model.functions import sine_cosine

#: Sweeps of successive over-relaxation on each grid: many where they are cheap.
_COARSE_SWEEPS, _SWEEPS = 80, 32
#: Over-relaxation on the finer grids: less than Young's factor, whose error first grows.
_FACTOR = 1.85
#: A grid with fewer voxels along an edge than this is not halved again.
_COARSEST = 24


@compiled()
def _relax(value: Any, free: Any, factor: float, sweeps: int) -> None:
    """Relax the free voxels in the colours of a checkerboard: those of one only see those of the other."""
    ni, nj, nk = value.shape
    for half in range(2 * sweeps):
        for i in range(1, ni - 1):
            for j in range(1, nj - 1):
                for k in range(1 + (i + j + half) % 2, nk - 1, 2):
                    if free[i, j, k]:
                        mean = (
                            value[i - 1, j, k]
                            + value[i + 1, j, k]
                            + value[i, j - 1, k]
                            + value[i, j + 1, k]
                            + value[i, j, k - 1]
                            + value[i, j, k + 1]
                        ) / 6.0
                        value[i, j, k] += factor * (mean - value[i, j, k])


def solve_laplace(inner: BoolArray, outer: BoolArray) -> FloatArray:
    """Solve Laplace's equation on voxels: 1 on the inner ones, 0 on the outer ones and on the grid's border.

    Relaxation by checkerboard, over-relaxed, starts on a grid of a few voxels and is carried to ever finer ones, so
    that each only has to mend what the coarser could not see.

    Parameters
    ----------
    inner, outer : (n, n, n) bool arrays
        Voxels of fixed value; inner ones win where both are set.

    Returns
    -------
    (n, n, n) array
        The solution, in 0 to 1.
    """
    shape = inner.shape
    if min(shape) >= 2 * _COARSEST:
        pad = [(0, n % 2) for n in shape]
        blocks = tuple((n + n % 2) // 2 for n in shape)
        fine = (blocks[0], 2, blocks[1], 2, blocks[2], 2)
        # A thin object has to survive; a voxel is outside only if all of it is.
        coarse_inner: BoolArray = np.asarray(np.pad(inner, pad).reshape(fine).any(axis=(1, 3, 5)))
        coarse_outer: BoolArray = np.asarray(np.pad(outer, pad, constant_values=True).reshape(fine).all(axis=(1, 3, 5)))
        coarse = solve_laplace(coarse_inner, coarse_outer)
        value = np.empty(tuple(2 * n for n in blocks))
        for offset in np.ndindex(2, 2, 2):
            value[offset[0] :: 2, offset[1] :: 2, offset[2] :: 2] = coarse
        value = np.ascontiguousarray(value[: shape[0], : shape[1], : shape[2]])
        sweeps, factor = _SWEEPS, _FACTOR
    else:
        value = np.zeros(shape)
        # Young's factor for the longest wave that fits in.
        sweeps, factor = _COARSE_SWEEPS, 2.0 / (1.0 + float(sine_cosine(np.pi / max(shape))[0]))
    value[outer] = 0.0
    value[inner] = 1.0
    free = ~(inner | outer)
    _relax(value, free, factor, sweeps)
    return value
