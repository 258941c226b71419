"""Blocks of cells: their rows over all blocks, chosen ones, and their nodes."""

from __future__ import annotations

import numpy as np

from femprep.model.blocks import block_rows, chosen_rows, nodes_of

BLOCKS = {"tetra": np.array([[0, 1, 2, 3], [1, 2, 3, 9]]), "wedge": np.array([[4, 5, 6, 7, 8, 3]])}


def test_rows_run_through_all_blocks() -> None:
    found = [(kind, block is BLOCKS[kind], rows.start, rows.stop) for kind, block, rows in block_rows(BLOCKS)]
    assert found == [("tetra", True, 0, 2), ("wedge", True, 2, 3)]


def test_a_mask_over_all_blocks_chooses_rows_of_each() -> None:
    found = chosen_rows(BLOCKS, np.array([False, True, True]))
    assert {kind: block.tolist() for kind, block in found.items()} == {
        "tetra": [[1, 2, 3, 9]],
        "wedge": [[4, 5, 6, 7, 8, 3]],
    }
    assert nodes_of(found).tolist() == [1, 2, 3, 4, 5, 6, 7, 8, 9]


def test_no_blocks_have_no_nodes() -> None:
    assert nodes_of({}).tolist() == []
