"""What an LS-DYNA deck may define twice, and what of some elements alone."""

from __future__ import annotations

from pathlib import Path

import pytest
from meshes import truncated_ellipsoid, with_fibres

import femprep as fp
from femprep.errors import FileError


@pytest.fixture
def deck(tmp_path: Path) -> Path:
    return fp.write_mesh(with_fibres(truncated_ellipsoid("hexahedron")), tmp_path / "mesh.k")[0]


def line_of(deck: Path, keyword: str) -> str:
    """The first card below a keyword."""
    rows = deck.read_text().split(f"\n{keyword}\n", 1)[1].splitlines()
    return next(row for row in rows if not row.startswith("$"))


def test_a_node_is_defined_once_or_the_same_again(deck: Path) -> None:
    text, card = deck.read_text(), line_of(deck, "*NODE")
    count = len(fp.read_mesh(deck).points)
    deck.write_text(text.replace(card, f"{card}\n{card}", 1))
    assert len(fp.read_mesh(deck).points) == count
    moved = f"{card[:8]}{'77.0':>16}{card[24:]}"
    deck.write_text(text.replace(card, f"{card}\n{moved}", 1))
    with pytest.raises(FileError, match="node 1 is defined 2 times"):
        fp.read_mesh(deck)


def test_an_element_is_defined_once(deck: Path) -> None:
    text, card = deck.read_text(), line_of(deck, "*ELEMENT_SOLID_ORTHO")
    where = text.index(card)
    rows = "\n".join(text[where:].splitlines()[:3])
    deck.write_text(text.replace(rows, f"{rows}\n{rows}", 1))
    with pytest.raises(FileError, match="element 1 is defined 2 times"):
        fp.read_mesh(deck)


def test_a_deck_without_its_end_is_told(deck: Path) -> None:
    whole = fp.read_mesh(deck)
    assert "notices" not in whole.info
    text = deck.read_text()
    deck.write_text(text[: text.index("*SET_SEGMENT")])
    cut = fp.read_mesh(deck)
    assert cut.n_cells == whole.n_cells
    words = [notice["what"] for notice in cut.info["notices"]]
    assert words[0].startswith("the deck has no *END")
    assert words[1:] == ["sets of nodes endo of the file are left out"]  # whose segments are behind the cut


def test_nothing_is_read_behind_the_end(deck: Path) -> None:
    whole = fp.read_mesh(deck)
    deck.write_text(
        deck.read_text() + "*SET_SEGMENT_TITLE\nghost\n        55\n         1         2         3         3\n"
    )
    assert fp.read_mesh(deck).facet_names == whole.facet_names
    (deck.parent / "more.k").write_text("*KEYWORD\n*END\n*SET_SEGMENT_TITLE\nghost\n")
    deck.write_text(deck.read_text().replace("*TITLE\n", "*INCLUDE\nmore.k\n*TITLE\n"))
    assert fp.read_mesh(deck).facet_names == whole.facet_names
