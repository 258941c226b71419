"""Directions of an Abaqus deck: one for each element, or not read, and that is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from meshes import truncated_ellipsoid, with_fibres

import femprep as fp
from femprep.errors import FileError


@pytest.fixture
def deck(tmp_path: Path) -> Path:
    return fp.write_mesh(with_fibres(truncated_ellipsoid("hexahedron")), tmp_path / "mesh.inp")[0]


def changed(deck: Path, old: str, new: str) -> Path:
    """The deck with what begins a row of its distribution made something else."""
    head, table = deck.read_text().split("*DISTRIBUTION,", 1)
    assert f"\n{old}," in table
    deck.write_text(f"{head}*DISTRIBUTION,{table.replace(f'{chr(10)}{old},', f'{chr(10)}{new},', 1)}")
    return deck


def test_all_are_read(deck: Path) -> None:
    found = fp.read_mesh(deck)
    np.testing.assert_allclose(np.linalg.norm(found.cell_data["fiber"], axis=1), 1.0, atol=1e-4)
    assert "notices" not in found.info


def test_an_element_with_two_is_refused(deck: Path) -> None:
    """The one that then has none got what was in the memory."""
    with pytest.raises(FileError, match="gives element 4 several directions"):
        fp.read_mesh(changed(deck, "5", "4"))


def test_an_element_with_none_is_told(deck: Path) -> None:
    found = fp.read_mesh(changed(deck, "5", "**5"))
    assert "fiber" not in found.cell_data
    (notice,) = found.info["notices"]
    assert notice["what"] == (
        f"directions of the last distribution are left out: it has {found.n_cells - 1}, for {found.n_cells} elements"
    )


def test_directions_of_sets_are_told(deck: Path) -> None:
    """Abaqus takes them, too; one row of them made the whole distribution as if it were not there."""
    found = fp.read_mesh(changed(deck, "5", "lv"))
    assert "fiber" not in found.cell_data
    (notice,) = found.info["notices"]
    assert notice["what"].endswith("are no number of an element and two directions are left out: 1")
