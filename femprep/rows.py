"""Rows of integers in, a number for each out, equal for equal rows: sorted in buckets of equal first numbers."""

from __future__ import annotations

import numba
import numpy as np
import numpy.typing as npt

from femprep.compiled import compiled

IntArray = npt.NDArray[np.int64]


def bucketed(rows: IntArray, size: int) -> IntArray:
    """Number from 0 of each row, in lexicographic order.

    Quick where first numbers repeat a few times each, as those of the faces or edges of a mesh do.

    Parameters
    ----------
    rows : (m, k) array
        Numbers from 0.
    size : int
        One more than the largest number of the first column.
    """
    number = np.empty(len(rows), dtype=np.int64)
    _number(np.ascontiguousarray(rows), size, number)
    return number


@compiled(parallel=True)
def sort_each(rows: IntArray) -> None:
    """Sort the numbers of each of short rows, in place; several times as fast as numpy for a few numbers."""
    for i in numba.prange(len(rows)):
        for j in range(1, rows.shape[1]):
            value, k = rows[i, j], j
            while k > 0 and rows[i, k - 1] > value:
                rows[i, k] = rows[i, k - 1]
                k -= 1
            rows[i, k] = value


@compiled(part=True)
def _compare(rows: IntArray, a: int, b: int) -> int:
    """Negative, zero or positive as row a comes before, equals or comes after row b; first numbers are equal."""
    for k in range(1, rows.shape[1]):
        if rows[a, k] != rows[b, k]:
            return -1 if rows[a, k] < rows[b, k] else 1
    return 0


@compiled(parallel=True)
def _number(rows: IntArray, size: int, number: IntArray) -> None:
    start = np.zeros(size + 1, dtype=np.int64)
    for i in range(len(rows)):
        start[rows[i, 0] + 1] += 1
    for v in range(size):
        start[v + 1] += start[v]
    place = start[:-1].copy()
    order = np.empty(len(rows), dtype=np.int64)
    for i in range(len(rows)):
        order[place[rows[i, 0]]] = i
        place[rows[i, 0]] += 1
    found = np.zeros(size + 1, dtype=np.int64)
    for v in numba.prange(size):
        first, last = start[v], start[v + 1]
        gap = 1
        while 3 * gap < last - first:
            gap = 3 * gap + 1
        while gap > 0:  # Shell's sort: in place, and good for buckets of a few rows as for larger ones
            for i in range(first + gap, last):
                row, j = order[i], i
                while j >= first + gap and _compare(rows, order[j - gap], row) > 0:
                    order[j] = order[j - gap]
                    j -= gap
                order[j] = row
            gap //= 3
        count = 0
        for i in range(first, last):
            if i == first or _compare(rows, order[i - 1], order[i]) != 0:
                count += 1
            number[order[i]] = count - 1
        found[v + 1] = count
    for v in range(size):
        found[v + 1] += found[v]
    for i in numba.prange(len(rows)):
        number[i] += found[rows[i, 0]]
