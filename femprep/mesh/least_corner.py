"""Parts of elements (edges, faces, whole elements) in, put together by their smallest corner out: a chunk at a time.

Of parts with the same smallest corner there are few, so that equal ones among them are found by comparing each with
each: several times quicker than sorting all, and in memory that does not grow with the mesh.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.mesh.numbering import row_numbers
from femprep.model import IntArray, TagArray

#: Parts in a chunk, if those of one node are not more: half a gigabyte.
_CHUNK: Final = 2**25
#: Parts with the same smallest corner that are compared each with each; more are sorted first.
_TOGETHER: Final = 400


@dataclass(frozen=True)
class BlockParts:
    """Parts of one block of elements, all with as many corners.

    Attributes
    ----------
    cells : (n, k) array
        The elements.
    corners : (f, c) array
        Which nodes of an element are the corners of each part.
    start : int
        Number of the first element.
    """

    cells: IntArray
    corners: IntArray
    start: int = 0

    def __len__(self) -> int:
        return len(self.cells) * len(self.corners)


@dataclass(frozen=True)
class Chunk:
    """All parts whose smallest corner is one of some successive nodes.

    Attributes
    ----------
    nodes : range
        These nodes.
    end : (len(nodes) + 1,) array
        Where the parts of each node begin in what follows, and where the last one's end.
    others : (p, c - 1) array
        The other corners of each part, ascending.
    number : (p,) array
        Number of each part: block by block, in each part by part, in each element by element.
    element : (p,) array
        Its element.
    """

    nodes: range
    end: IntArray
    others: TagArray
    number: TagArray
    element: TagArray

    def before(self) -> TagArray:
        """Place in the chunk of the last part before each with the same corners, ``(p,)``; -1 where there is none."""
        before = np.full(len(self.number), -1, dtype=np.int32)
        if np.diff(self.end).max() <= _TOGETHER:
            _equal_before(self.end, self.others, before)
            return before
        same = row_numbers(np.column_stack([self.least(), self.others]))
        order = np.argsort(same, kind="stable").astype(np.int32)
        after = np.diff(same[order]) == 0
        before[order[1:][after]] = order[:-1][after]
        return before

    def unpaired(self, before: TagArray) -> TagArray:
        """Numbers of the parts that equal no other one; ``before`` is what the method of this name gives."""
        alone = before < 0
        alone[before[~alone]] = False
        return np.asarray(self.number[alone])

    def least(self) -> IntArray:
        """The smallest corner of each part, ``(p,)``."""
        return np.repeat(np.arange(self.nodes.start, self.nodes.stop), np.diff(self.end))


def by_least_corner(blocks: Sequence[BlockParts], most: int = _CHUNK) -> Iterator[Chunk]:
    """Go through all parts of some blocks by their smallest corners, ascending, at most about so many at a time."""
    total = sum(map(len, blocks))
    if total >= 2**31:
        raise ValueError(f"{total} parts of elements are more than 32 bits can number")
    if total == 0:
        return
    count = np.zeros(max(int(part.cells.max(initial=0)) for part in blocks) + 1, dtype=np.int64)
    for part in blocks:
        _count(part.cells, part.corners, count)
    end = np.append(0, np.cumsum(count))
    low = 0
    while low < len(count):
        high = max(int(np.searchsorted(end, end[low] + most, side="right")) - 1, low + 1)
        size = int(end[high] - end[low])
        others = np.empty((size, blocks[0].corners.shape[1] - 1), dtype=np.int32)
        number, element = np.empty((2, size), dtype=np.int32)
        at, first = end[low:high] - end[low], 0
        for part in blocks:
            _place(part.cells, part.corners, part.start, first, low, at, others, number, element)
            first += len(part)
        yield Chunk(range(low, high), end[low : high + 1] - end[low], others, number, element)
        low = high


def unpaired(blocks: Sequence[BlockParts]) -> IntArray:
    """Numbers of the parts whose corners no other part has, in any order, ascending."""
    single = [chunk.unpaired(chunk.before()) for chunk in by_least_corner(blocks)]
    return np.sort(np.concatenate([np.empty(0, dtype=np.int64), *single]))


def distinct_pairs(blocks: Sequence[BlockParts]) -> IntArray:
    """The parts of two corners, each once, the smaller corner first, in ascending order, ``(m, 2)``."""
    found = [np.empty((0, 2), dtype=np.int64)]
    for chunk in by_least_corner(blocks):
        size = int(chunk.others.max()) + 1
        key = np.sort(chunk.least() * size + chunk.others[:, 0])  # np.unique of a version that hashes is slower
        found.append(np.stack(np.divmod(key[np.append(True, key[1:] != key[:-1])], size), axis=1))
    return np.concatenate(found)


@compiled(writes="count")
def _count(cells: IntArray, corners: IntArray, count: IntArray) -> None:
    """Add up how many parts have each node as their smallest corner."""
    for f in range(len(corners)):
        for i in range(len(cells)):
            least = cells[i, corners[f, 0]]
            for c in range(1, corners.shape[1]):
                least = min(least, cells[i, corners[f, c]])
            count[least] += 1


@compiled(writes="at others number element")
def _place(
    cells: IntArray,
    corners: IntArray,
    start: int,
    first: int,
    low: int,
    at: IntArray,
    others: TagArray,
    number: TagArray,
    element: TagArray,
) -> None:
    """Put each part whose smallest corner is one of ``len(at)`` nodes from ``low`` on to those of the same."""
    width = corners.shape[1]
    own = np.empty(width, dtype=np.int64)
    for f in range(len(corners)):
        for i in range(len(cells)):
            least = cells[i, corners[f, 0]]
            for c in range(1, width):
                least = min(least, cells[i, corners[f, c]])
            if not 0 <= least - low < len(at):
                continue
            for c in range(width):
                node = cells[i, corners[f, c]]
                p = c
                while p > 0 and own[p - 1] > node:
                    own[p] = own[p - 1]
                    p -= 1
                own[p] = node
            to = at[least - low]
            at[least - low] = to + 1
            for c in range(1, width):
                others[to, c - 1] = own[c]
            number[to] = first + f * len(cells) + i
            element[to] = start + i


@compiled(writes="before")
def _equal_before(end: IntArray, others: TagArray, before: TagArray) -> None:
    """Find the last equal part before each among those of the same smallest corner."""
    width = others.shape[1]
    for node in range(len(end) - 1):
        for i in range(end[node], end[node + 1]):
            for j in range(i - 1, end[node] - 1, -1):
                same = True
                for c in range(width):
                    if others[i, c] != others[j, c]:
                        same = False
                        break
                if same:
                    before[i] = j
                    break
