"""Rows of integers in, a number for each out, equal for equal rows: of millions of rows without sorting them all."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.model import BoolArray, IntArray

#: Rows that begin with the same number at most, where they are sorted by themselves.
_TOGETHER: Final = 400
#: Fewer rows than this are packed and sorted as quickly.
_FEW: Final = 20_000


def row_numbers(rows: IntArray) -> IntArray:
    """Number from 0 for each row of integers, equal for equal rows, in their lexicographic order.

    What ``np.unique(rows, axis=0, return_inverse=True)`` gives, many times faster. Rows that begin with the same number
    are sorted by themselves, where these are few everywhere, as edges and faces of elements are at each node; otherwise
    rows are packed into one number each, compressed on the way where they would not fit.
    """
    least = rows.min(initial=0)
    rows = rows - least if least < 0 else rows
    size = int(rows.max(initial=0)) + 1
    if _FEW < len(rows) < 2**31 and rows.shape[1] > 1 and size <= len(rows):
        count = np.bincount(rows[:, 0], minlength=size)
        if count.max() <= _TOGETHER:
            number = np.empty(len(rows), dtype=np.int64)
            _number(np.ascontiguousarray(rows), np.cumsum(count), int(count.max()), number)
            return number
    key, span = np.zeros(len(rows), dtype=np.int64), 1
    for column in rows.T:
        if span > 2**62 // size:
            key = np.unique(key, return_inverse=True)[1].ravel()
            span = len(rows)
        key = key * size + column
        span *= size
    return np.asarray(np.unique(key, return_inverse=True)[1].ravel(), dtype=np.int64)


def set_numbers(*blocks: IntArray) -> IntArray:
    """Number from 0 for each row of integers of some blocks, equal for rows of the same numbers in any order."""
    rows = np.concatenate(blocks)
    rows.sort(axis=1)
    return row_numbers(rows)


def none_of(rows: IntArray, others: IntArray) -> BoolArray:
    """Which rows of integers ``(m, k)`` have the numbers of none of others ``(n, k)``, in any order, ``(m,)``."""
    number = set_numbers(rows, others)
    known = np.zeros(int(number.max(initial=-1)) + 1, dtype=np.bool_)
    known[number[len(rows) :]] = True
    return np.asarray(~known[number[: len(rows)]])


def twins(rows: IntArray) -> tuple[IntArray, IntArray]:
    """Rows of integers that have the same numbers, in any order: of each two of them the earlier, and the later."""
    number = set_numbers(rows)
    order = np.argsort(number, kind="stable")
    same = number[order[1:]] == number[order[:-1]]
    return order[:-1][same], order[1:][same]


@compiled()
def _number(rows: IntArray, end: IntArray, most: int, number: IntArray) -> None:
    """Fill in the numbers; ``end`` ``(n,)`` is how many rows begin with each number or a smaller one."""
    count, width = rows.shape
    order = np.empty(count, dtype=np.int32)
    at = end.copy()
    for i in range(count - 1, -1, -1):  # backward: the rows of each number keep their order
        at[rows[i, 0]] -= 1
        order[at[rows[i, 0]]] = i
    own = np.empty((most, width), dtype=np.int64)
    place = np.empty(most, dtype=np.int32)
    following = 0
    low = 0
    for high in end:
        size = high - low
        for k in range(size):
            i = order[low + k]
            p = k
            while p > 0:
                smaller = False
                for c in range(1, width):
                    if rows[i, c] != own[p - 1, c]:
                        smaller = rows[i, c] < own[p - 1, c]
                        break
                if not smaller:
                    break
                for c in range(1, width):
                    own[p, c] = own[p - 1, c]
                place[p] = place[p - 1]
                p -= 1
            for c in range(1, width):
                own[p, c] = rows[i, c]
            place[p] = i
        for k in range(size):
            same = k > 0
            if same:
                for c in range(1, width):
                    if own[k, c] != own[k - 1, c]:
                        same = False
                        break
            if not same:
                following += 1
            number[place[k]] = following - 1
        low = high
