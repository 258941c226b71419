"""A sparse positive definite matrix in, its Cholesky factor as a band out: for meshes quicker than a general solver."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from femprep.errors import StageError
from femprep.mesh.compiled import compiled
from femprep.model import FloatArray

#: Columns of zeros after each row, so that four rows can be read as far as the last of them reaches.
SPARE: Final = 3


class Banded:
    """Solves with a sparse symmetric positive definite matrix of a surface mesh.

    Vertices numbered from one end of the mesh to the other [1]_ have neighbours of near numbers, so that the factor is
    a narrow band. It is full there, and its rows are multiplied whole, which makes up for more entries than other
    orders leave. The sums are the same on every machine and by any number of threads; those of LAPACK are not.

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
        rows = matrix.tocsr()
        degree = np.diff(rows.indptr).astype(np.int64)
        # Not SciPy's: where several have as few neighbours, it begins where the processor's sorting puts first.
        self._order = cuthill_mckee(
            rows.indptr.astype(np.int64), rows.indices.astype(np.int64), degree, np.argsort(degree, kind="stable")
        )
        place = np.empty_like(self._order)
        place[self._order] = np.arange(len(place))
        entries = matrix.tocoo()
        row, column = place[entries.row], place[entries.col]
        upper = row <= column
        row, column = row[upper], column[upper]
        width = int((column - row).max(initial=0))
        self._rows = np.zeros((len(place), width + 1 + SPARE))
        np.add.at(self._rows, (row, column - row), entries.data[upper])
        if not factorise(self._rows):
            raise StageError("a matrix of the fit is not positive definite")

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution for right sides ``(n,)`` or ``(n, k)``."""
        x = np.ascontiguousarray(right[self._order].reshape(len(right), -1).T)
        substitute(self._rows, x)
        found = np.empty_like(x)
        found[:, self._order] = x
        return np.asarray(found.T.reshape(right.shape))


@compiled()
def cuthill_mckee(starts: Any, columns: Any, degree: Any, seeds: Any) -> Any:
    """Numbers of the rows of a sparse symmetric matrix, from one end of its graph to the other.

    Neighbours of each row follow it, those of few neighbours first, of several the one of the smallest number; each
    piece begins with the first of its rows among ``seeds``.
    """
    order = np.empty(len(degree), dtype=np.int64)
    known = np.zeros(len(degree), dtype=np.bool_)
    done = count = 0
    for seed in seeds:
        if not known[seed]:
            known[seed] = True
            order[count] = seed
            count += 1
        while done < count:
            here = order[done]
            done += 1
            first = count
            for k in range(starts[here], starts[here + 1]):
                j = columns[k]
                if known[j]:
                    continue
                known[j] = True
                # Into its place among those found here.
                at = count
                while at > first and (degree[order[at - 1]], order[at - 1]) > (degree[j], j):
                    order[at] = order[at - 1]
                    at -= 1
                order[at] = j
                count += 1
    return order[::-1].copy()


@compiled(part=True)
def dot(a: Any, b: Any, length: int) -> float:
    """Sum of products of two rows by eight sums that run beside each other, in an order that is written down."""
    s0 = s1 = s2 = s3 = s4 = s5 = s6 = s7 = 0.0
    k = 0
    while k + 8 <= length:
        s0 += a[k] * b[k]
        s1 += a[k + 1] * b[k + 1]
        s2 += a[k + 2] * b[k + 2]
        s3 += a[k + 3] * b[k + 3]
        s4 += a[k + 4] * b[k + 4]
        s5 += a[k + 5] * b[k + 5]
        s6 += a[k + 6] * b[k + 6]
        s7 += a[k + 7] * b[k + 7]
        k += 8
    while k < length:
        s0 += a[k] * b[k]
        k += 1
    return ((s0 + s4) + (s1 + s5)) + ((s2 + s6) + (s3 + s7))


@compiled()
def factorise(rows: Any) -> bool:
    """The upper factor in place: row i holds columns i to i + width, and spare zeros. False where there is none.

    Each row is freed of four rows above it at a time, entry by entry: that fills vector units without a sum whose order
    would depend on their width.
    """
    width = rows.shape[1] - 1 - SPARE
    for i in range(len(rows)):
        row = rows[i]
        k = max(0, i - width)
        while k + 4 <= i:
            at = i - k
            one, two, three, four = rows[k, at:], rows[k + 1, at - 1 :], rows[k + 2, at - 2 :], rows[k + 3, at - 3 :]
            a, b, c, d = one[0], two[0], three[0], four[0]
            for j in range(min(k + 4 + width, len(rows)) - i):
                row[j] -= a * one[j] + b * two[j] + c * three[j] + d * four[j]
            k += 4
        while k < i:
            one = rows[k, i - k :]
            a = one[0]
            for j in range(min(k + 1 + width, len(rows)) - i):
                row[j] -= a * one[j]
            k += 1
        if not row[0] > 0.0:
            return False
        root = np.sqrt(row[0])
        for j in range(min(width + 1, len(rows) - i)):
            row[j] /= root
    return True


@compiled()
def substitute(rows: Any, sides: Any) -> None:
    """Solve for right sides ``(k, n)`` in place: with the transposed factor, then with the factor."""
    width = rows.shape[1] - 1 - SPARE
    for s in range(len(sides)):
        x = sides[s]
        for i in range(len(x)):
            row, after = rows[i, 1:], x[i + 1 :]
            x[i] /= rows[i, 0]
            for k in range(min(width, len(after))):
                after[k] -= row[k] * x[i]
        for i in range(len(x) - 1, -1, -1):
            x[i] = (x[i] - dot(rows[i, 1:], x[i + 1 :], min(width, len(x) - 1 - i))) / rows[i, 0]
