"""Rows of integers in, a number for each out, equal for equal rows, or the distinct ones: sorted in buckets of equal
first numbers."""

from __future__ import annotations

import numba
import numpy as np
import numpy.typing as npt

from femprep.mesh.compiled import compiled

IntArray = npt.NDArray[np.int64]


def bucketed(rows: IntArray, size: int) -> IntArray:
    """Number from 0 of each row, in lexicographic order.

    Quick where first numbers repeat a few times each, as those of the faces or edges of a mesh do.

    Parameters
    ----------
    rows : (m, k) array
        Numbers from 0; k at least 2.
    size : int
        One more than the largest number. Its power k - 1 must be an integer of 64 bits.
    """
    number = np.empty(len(rows), dtype=np.int64)
    _number(np.ascontiguousarray(rows), size, int(rows[:, 0].max(initial=-1)) + 1, number)
    return number


def distinct_pairs(one: IntArray, two: IntArray) -> IntArray:
    """The pairs ``(one, two)`` of numbers from 0, each once, in lexicographic order, ``(e, 2)``."""
    largest = int(one.max(initial=-1))
    return np.asarray(_distinct(one, two, largest + 1))


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


@compiled(parallel=True)
def _distinct(one: IntArray, two: IntArray, buckets: int) -> IntArray:
    start = np.zeros(buckets + 1, dtype=np.int64)
    for i in range(len(one)):
        start[one[i] + 1] += 1
    for v in range(buckets):
        start[v + 1] += start[v]
    place = start[:-1].copy()
    other = np.empty(len(one), dtype=np.int64)
    for i in range(len(one)):
        other[place[one[i]]] = two[i]
        place[one[i]] += 1
    found = np.zeros(buckets + 1, dtype=np.int64)
    for v in numba.prange(buckets):
        first, last = start[v], start[v + 1]
        _sort(other[first:last])
        count = 0
        for i in range(first, last):
            if i == first or other[i] != other[i - 1]:
                count += 1
        found[v + 1] = count
    for v in range(buckets):
        found[v + 1] += found[v]
    out = np.empty((found[buckets], 2), dtype=np.int64)
    for v in numba.prange(buckets):
        at = found[v]
        for i in range(start[v], start[v + 1]):
            if i == start[v] or other[i] != other[i - 1]:
                out[at, 0], out[at, 1] = v, other[i]
                at += 1
    return out


@compiled(part=True)
def _sort(values: IntArray) -> None:
    """Shell's sort: in place, and good for a few numbers as for more."""
    gap = 1
    while 3 * gap < len(values):
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(gap, len(values)):
            value, j = values[i], i
            while j >= gap and values[j - gap] > value:
                values[j] = values[j - gap]
                j -= gap
            values[j] = value
        gap //= 3


@compiled(parallel=True)
def _number(rows: IntArray, size: int, buckets: int, number: IntArray) -> None:
    start = np.zeros(buckets + 1, dtype=np.int64)
    for i in range(len(rows)):
        start[rows[i, 0] + 1] += 1
    for v in range(buckets):
        start[v + 1] += start[v]
    place = start[:-1].copy()
    # Row by row in the order of the buckets: which it is, and all its numbers but the first as one.
    order, key = np.empty(len(rows), dtype=np.int64), np.empty(len(rows), dtype=np.int64)
    for i in range(len(rows)):
        packed = rows[i, 1]
        for k in range(2, rows.shape[1]):
            packed = packed * size + rows[i, k]
        at = place[rows[i, 0]]
        order[at], key[at] = i, packed
        place[rows[i, 0]] = at + 1
    found = np.zeros(buckets + 1, dtype=np.int64)
    for v in numba.prange(buckets):
        first, last = start[v], start[v + 1]
        gap = 1
        while 3 * gap < last - first:
            gap = 3 * gap + 1
        while gap > 0:  # Shell's sort: in place, and good for buckets of a few rows as for larger ones
            for i in range(first + gap, last):
                row, value, j = order[i], key[i], i
                while j >= first + gap and key[j - gap] > value:
                    order[j], key[j] = order[j - gap], key[j - gap]
                    j -= gap
                order[j], key[j] = row, value
            gap //= 3
        count = 0
        for i in range(first, last):
            if i == first or key[i - 1] != key[i]:
                count += 1
            number[order[i]] = count - 1
        found[v + 1] = count
    for v in range(buckets):
        found[v + 1] += found[v]
    for i in numba.prange(len(rows)):
        number[i] += found[rows[i, 0]]
