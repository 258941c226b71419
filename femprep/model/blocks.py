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
    return np.unique(np.concatenate([np.empty(0, dtype=np.int64), *(block.ravel() for block in blocks.values())]))
