"""Elements in, the sparsity pattern of their matrices out: sorted once, filled element by element for every problem."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from femprep.mesh.compiled import compiled
from femprep.model import FloatArray, IntArray, TagArray


class Pattern:
    """Where the entries of a symmetric matrix lie whose rows sum to zero.

    Parameters
    ----------
    blocks : sequence of (cells, first, second)
        Nodes ``(k, p)`` of the elements of a type, and the local numbers of the two nodes of each pair of nodes.
    n : int
        Number of nodes.
    """

    def __init__(self, blocks: Sequence[tuple[IntArray, IntArray, IntArray]], n: int) -> None:
        self.n = n
        count = np.zeros(n + 1, dtype=np.int64)
        for cells, first, second in blocks:
            _count_pairs(cells, first, second, count)
        start = np.cumsum(count)
        above = np.empty(int(start[-1]), dtype=np.int32)
        at = start[:-1].copy()
        for cells, first, second in blocks:
            _list_pairs(cells, first, second, at, above)
        kept = np.empty(n, dtype=np.int64)
        _sort_rows(start, above, kept)
        self.indptr, self.indices, self._upper = _rows(start, above, kept)
        del above
        self._place = []
        for cells, first, second in blocks:
            place = np.empty((len(cells), len(first)), dtype=np.int32)
            _find_pairs(cells, first, second, self._upper, self.indptr, self.indices, place)
            self._place.append(place)

    def zeros(self) -> FloatArray:
        """The entries of a matrix, none of them filled yet."""
        return np.zeros(len(self.indices))

    def add(self, data: FloatArray, block: int, part: slice, values: FloatArray) -> None:
        """Add values ``(c, pairs)`` of some elements of a block to the entries."""
        _add(np.ascontiguousarray(values), self._place[block][part], data)

    def matrix(self, data: FloatArray) -> sp.csr_array:
        """The matrix, once all elements were added."""
        _complete(self.indptr, self.indices, self._upper, data)
        return sp.csr_array((data, self.indices, self.indptr), shape=(self.n, self.n))


@compiled()
def _count_pairs(cells: IntArray, first: IntArray, second: IntArray, count: IntArray) -> None:
    """Count the pairs of each node in which it has the smaller number, at the place behind it."""
    for e in range(len(cells)):
        for k in range(len(first)):
            a, b = cells[e, first[k]], cells[e, second[k]]
            if a != b:  # a collapsed wedge or hexahedron names a node twice
                count[min(a, b) + 1] += 1


@compiled()
def _list_pairs(cells: IntArray, first: IntArray, second: IntArray, at: IntArray, above: TagArray) -> None:
    """The larger number of each pair, those of a node together."""
    for e in range(len(cells)):
        for k in range(len(first)):
            a, b = cells[e, first[k]], cells[e, second[k]]
            if a != b:
                low = min(a, b)
                above[at[low]] = max(a, b)
                at[low] += 1


@compiled()
def _sort_rows(start: IntArray, above: TagArray, kept: IntArray) -> None:
    """Each row sorted, every number once, at its beginning; how many are left of each."""
    for i in range(len(kept)):
        low, size = start[i], 0
        for p in range(low, start[i + 1]):
            value = above[p]
            # Rows are short, and the numbers already there are sorted.
            a, b = low, low + size
            while a < b:
                middle = (a + b) // 2
                if above[middle] < value:
                    a = middle + 1
                else:
                    b = middle
            if a < low + size and above[a] == value:
                continue
            for q in range(low + size, a, -1):
                above[q] = above[q - 1]
            above[a] = value
            size += 1
        kept[i] = size


@compiled()
def _rows(start: IntArray, above: TagArray, kept: IntArray) -> tuple[TagArray, TagArray, TagArray]:
    """Row ends and columns of the whole matrix, and where in each row the columns above the diagonal begin."""
    n = len(kept)
    degree = np.zeros(n, dtype=np.int64)
    for i in range(n):
        degree[i] += kept[i] + 1
        for p in range(start[i], start[i] + kept[i]):
            degree[above[p]] += 1
    indptr = np.zeros(n + 1, dtype=np.int32)
    for i in range(n):
        indptr[i + 1] = indptr[i] + degree[i]
    indices = np.empty(indptr[n], dtype=np.int32)
    at = indptr[:-1].copy()
    upper = np.empty(n, dtype=np.int32)
    for i in range(n):
        # Those below the diagonal are there: rows come in their order.
        indices[at[i]] = i
        at[i] += 1
        upper[i] = at[i]
        for p in range(start[i], start[i] + kept[i]):
            indices[at[i]] = above[p]
            at[i] += 1
            indices[at[above[p]]] = i
            at[above[p]] += 1
    return indptr, indices, upper


@compiled()
def _find_pairs(
    cells: IntArray,
    first: IntArray,
    second: IntArray,
    upper: TagArray,
    indptr: TagArray,
    indices: TagArray,
    place: TagArray,
) -> None:
    """Where in the matrix each pair of an element's nodes is, above the diagonal; -1 for a node with itself."""
    for e in range(len(cells)):
        for k in range(len(first)):
            low, high = cells[e, first[k]], cells[e, second[k]]
            if low == high:
                place[e, k] = -1
                continue
            if low > high:
                low, high = high, low
            a, b = upper[low], indptr[low + 1]
            while a < b:
                middle = (a + b) // 2
                if indices[middle] < high:
                    a = middle + 1
                else:
                    b = middle
            place[e, k] = a


@compiled()
def _add(values: FloatArray, place: TagArray, data: FloatArray) -> None:
    for e in range(len(values)):
        for k in range(values.shape[1]):
            if place[e, k] >= 0:
                data[place[e, k]] += values[e, k]


@compiled()
def _complete(indptr: TagArray, indices: TagArray, upper: TagArray, data: FloatArray) -> None:
    """Entries below the diagonal from those above, and on it what makes each row's sum zero."""
    n = len(upper)
    at = indptr[:-1].copy()
    for i in range(n):
        for p in range(upper[i], indptr[i + 1]):
            j = indices[p]
            data[at[j]] = data[p]
            at[j] += 1
    for i in range(n):
        above, below = 0.0, 0.0
        for p in range(upper[i], indptr[i + 1]):
            above += data[p]
        for p in range(indptr[i], upper[i] - 1):
            below += data[p]
        data[upper[i] - 1] = -above - below
