"""Blocks of cells or facets by their type, rows counted over all of them, in; rows and nodes of each out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from femprep.model.arrays import BoolArray, IntArray


def block_rows(blocks: Mapping[str, IntArray]) -> Iterator[tuple[str, IntArray, slice]]:
    """Go through blocks: type, nodes, and which rows they are of arrays over all blocks."""
    first = 0
    for kind, block in blocks.items():
        yield kind, block, slice(first, first + len(block))
        first += len(block)


def chosen_rows(blocks: Mapping[str, IntArray], chosen: BoolArray) -> dict[str, IntArray]:
    """The rows of each block that a mask over all blocks chooses."""
    return {kind: block[chosen[rows]] for kind, block, rows in block_rows(blocks)}


def nodes_of(blocks: Mapping[str, IntArray]) -> IntArray:
    """Numbers of all nodes of some blocks, ascending."""
    used = np.zeros(max((int(block.max(initial=-1)) for block in blocks.values()), default=-1) + 1, dtype=bool)
    for block in blocks.values():
        used[block] = True
    return np.flatnonzero(used)


def numbers_among(nodes: IntArray, count: int) -> IntArray:
    """Number of each of ``count`` nodes among some of them, which come in that order, ``(count,)``; -1 of others."""
    number = np.full(count, -1, dtype=np.int64)
    number[nodes] = np.arange(len(nodes))
    return number
