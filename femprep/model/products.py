"""Products and solutions of small matrices in an order that is written down: the same bits on every machine.

A linear algebra library sums in the order, and rounds as, the processor's vector units make it, and one with threads
cuts long sums where threads begin. Where positions come of it, these are taken instead. They are for one short side:
three columns, a handful of unknowns.
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.model.arrays import FloatArray

#: Steps of Newton's iteration at most; it doubles its digits, and ill-conditioned matrices take some to begin.
_STEPS = 60
#: Where the determinant is less than this share of the cubed size, no rotation is near.
_FLAT = 1e-9


def product(a: npt.ArrayLike, b: npt.ArrayLike) -> FloatArray:
    """``a @ b`` for ``(..., k)`` and ``(k,)`` or ``(k, m)``, with few k: summed from the first to the last."""
    left, right = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    columns = left if right.ndim == 1 else left[..., None, :]
    total = columns[..., 0] * right[0]
    for k in range(1, len(right)):
        total = total + columns[..., k] * right[k]
    return np.asarray(total)


def inner(a: npt.ArrayLike, b: npt.ArrayLike) -> float:
    """Sum of the products of two arrays of one shape, however long."""
    return float((np.asarray(a, dtype=np.float64) * np.asarray(b, dtype=np.float64)).sum())


def weighted(weights: npt.ArrayLike, values: FloatArray) -> FloatArray:
    """Sum of rows ``(n, k)`` by weights ``(n,)``; ``(j, k)`` by several sets of them, ``(n, j)``."""
    share = np.asarray(weights, dtype=np.float64)
    if share.ndim == 1:
        return np.asarray((share[:, None] * values).sum(axis=0))
    return np.asarray((share[:, :, None] * values[:, None, :]).sum(axis=0))


def length(vector: npt.ArrayLike) -> float:
    """Length of one vector."""
    square = np.asarray(vector, dtype=np.float64) ** 2
    return float(np.sqrt(square.sum()))


#: Squares of numbers this small have few digits left.
_SHORTEST: Final = 1e-150


def unit_vectors(vectors: FloatArray) -> FloatArray:
    """Vectors ``(..., k)`` with length 1; one of length zero, or too short for its squares, is zero."""
    size = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.divide(vectors, size, out=np.zeros_like(vectors), where=size > _SHORTEST))


def solve_definite(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Solutions ``(..., k, m)`` of symmetric positive definite systems ``(..., k, k)`` with few k, by elimination."""
    a, x = np.array(matrix, dtype=np.float64), np.array(right, dtype=np.float64)
    size = a.shape[-1]
    for k in range(size):
        for i in range(k + 1, size):
            share = a[..., i, k] / a[..., k, k]
            a[..., i, k:] -= share[..., None] * a[..., k, k:]
            x[..., i, :] -= share[..., None] * x[..., k, :]
    for k in range(size - 1, -1, -1):
        for i in range(k + 1, size):
            x[..., k, :] -= a[..., k, i, None] * x[..., i, :]
        x[..., k, :] /= a[..., k, k, None]
    return x


def inverse(matrix: npt.ArrayLike) -> FloatArray:
    """Inverse ``(3, 3)`` of a matrix of three rows, by their cross products."""
    a = np.asarray(matrix, dtype=np.float64)
    columns = np.stack([np.cross(a[1], a[2]), np.cross(a[2], a[0]), np.cross(a[0], a[1])], axis=1)
    return np.asarray(columns / (a[0] * columns[:, 0]).sum())


def nearest_orthogonal(matrix: npt.ArrayLike) -> FloatArray | None:
    """The orthogonal matrix ``(3, 3)`` nearest to one of the same hand, by Newton's iteration; None where it is flat.

    References
    ----------
    N. J. Higham, "Computing the polar decomposition - with applications", 1986, doi 10.1137/0907079.
    """
    x = np.asarray(matrix, dtype=np.float64)
    size = float(np.sqrt((x * x).sum() / 3.0))
    if not size > 0.0:
        return None
    x = x / size
    if abs(float((x[0] * np.cross(x[1], x[2])).sum())) < _FLAT:
        return None
    for _ in range(_STEPS):
        following = 0.5 * (x + inverse(x).T)
        if float(np.abs(following - x).max()) < 1e-15:
            break
        x = following
    return x
