"""A sparse positive definite matrix in, its Cholesky factor as a band out: for meshes quicker than a general solver."""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.compiled import compiled
from femprep.errors import StageError
from femprep.model import FloatArray


class Banded:
    """Solves with a sparse symmetric positive definite matrix of a surface mesh.

    Vertices numbered from one end of the mesh to the other [1]_ have neighbours of near numbers, so that the factor is
    a narrow band. It is full there, and its rows are multiplied whole, which makes up for more entries than other
    orders leave. The sums are the same by any number of threads; those of LAPACK are not.

    Parameters
    ----------
    matrix : (n, n) sparse array

    Raises
    ------
    StageError
        The matrix is not positive definite.

    References
    ----------
    .. [1] Cuthill & McKee, Reducing the bandwidth of sparse symmetric matrices, Proc. 24th ACM National Conference,
       1969. doi:10.1145/800195.805928
    """

    def __init__(self, matrix: Any) -> None:
        from scipy.sparse.csgraph import reverse_cuthill_mckee

        self._order = np.asarray(reverse_cuthill_mckee(matrix.tocsr(), symmetric_mode=True), dtype=np.int64)
        place = np.empty_like(self._order)
        place[self._order] = np.arange(len(place))
        entries = matrix.tocoo()
        row, column = place[entries.row], place[entries.col]
        lower = row >= column
        row, column = row[lower], column[lower]
        width = int((row - column).max(initial=0))
        self._rows = np.zeros((len(place), width + 1))
        np.add.at(self._rows, (row, width + column - row), entries.data[lower])
        if not factorise(self._rows):
            raise StageError("a matrix of the fit is not positive definite")

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution for right sides ``(n,)`` or ``(n, k)``."""
        x = np.ascontiguousarray(right[self._order].reshape(len(right), -1).T)
        substitute(self._rows, x)
        found = np.empty_like(x)
        found[:, self._order] = x
        return np.asarray(found.T.reshape(right.shape))


@compiled(fast_sums=True)
def factorise(rows: Any) -> bool:
    """The factor ``(n, width + 1)`` in place: row i holds columns i - width to i. False where there is none."""
    width = rows.shape[1] - 1
    for i in range(len(rows)):
        first = max(0, i - width)
        for j in range(first, i):
            start = max(first, j - width)
            total = 0.0
            one, two = rows[i, width + start - i : width + j - i], rows[j, width + start - j : width]
            for k in range(len(one)):
                total += one[k] * two[k]
            rows[i, width + j - i] = (rows[i, width + j - i] - total) / rows[j, width]
        total = 0.0
        for k in range(width + first - i, width):
            total += rows[i, k] * rows[i, k]
        left = rows[i, width] - total
        if not left > 0.0:
            return False
        rows[i, width] = np.sqrt(left)
    return True


@compiled(fast_sums=True)
def substitute(rows: Any, sides: Any) -> None:
    """Solve for right sides ``(k, n)`` in place: with the factor, then with its transpose."""
    width = rows.shape[1] - 1
    for s in range(len(sides)):
        x = sides[s]
        for i in range(len(x)):
            first = max(0, i - width)
            row, before = rows[i, width + first - i : width], x[first:i]
            total = 0.0
            for k in range(len(row)):
                total += row[k] * before[k]
            x[i] = (x[i] - total) / rows[i, width]
        for i in range(len(x) - 1, -1, -1):
            first = max(0, i - width)
            row, before = rows[i, width + first - i : width], x[first:i]
            x[i] /= rows[i, width]
            for k in range(len(row)):
                before[k] -= row[k] * x[i]
