"""An LS-DYNA keyword file in; its nodes, parts, solids, beams and sets, by its own numbers, out."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from femprep.errors import FileError
from femprep.export.deck.includes import OpenedFile
from femprep.export.deck.reals import real
from femprep.export.lsdyna.cards import card_lines, card_sections
from femprep.mesh.elements import ELEMENTS


class SolidCard(NamedTuple):
    """A solid element, with the components of its directions a and d where it has them."""

    label: int
    part: int
    nodes: list[int]
    axes: list[float]


@dataclass
class KeywordDeck:
    """What a keyword file holds, by its own numbers."""

    #: Number and coordinates of each node.
    nodes: list[tuple[int, list[float]]] = field(default_factory=list)
    solids: list[SolidCard] = field(default_factory=list)
    #: Number, part and two nodes of each beam.
    beams: list[list[int]] = field(default_factory=list)
    titles: dict[int, str] = field(default_factory=dict)
    #: Name and segments of each set of those, four nodes each; a triangle's last one twice.
    segments: list[tuple[str, list[list[int]]]] = field(default_factory=list)
    solid_sets: dict[str, list[int]] = field(default_factory=dict)
    #: Cards of each set of nodes.
    node_sets: dict[str, list[str]] = field(default_factory=dict)
    other_sets: list[str] = field(default_factory=list)
    left_out: set[str] = field(default_factory=set)
    #: Whether it has its ``*END``.
    ended: bool = False
    #: Speed along Purkinje fibres, m/s, where a comment of ours tells it.
    speed: str | None = None

    @property
    def names(self) -> dict[int, str]:
        """Names of parts by their titles, of ours without the type of their elements; parts of one title stay apart."""
        times, found = Counter(self.titles.values()), {}
        for part, title in self.titles.items():
            words = title.split()
            name = " ".join(words[:-1] if len(words) > 1 and words[-1] in ELEMENTS else words) or "tag"
            found[part] = name if title and times[title] == 1 else f"{name}_{part}"
        return found


def parse(path: Path) -> KeywordDeck:
    """Read the keywords that make a mesh.

    Raises
    ------
    FileError
        It is no keyword file, or not in columns.
    """
    text = "\n".join(card_lines(OpenedFile(path)))
    if "*KEYWORD" not in text.upper():
        raise FileError(f"{str(path)!r} is no LS-DYNA keyword file: it has no *KEYWORD")
    deck = KeywordDeck(ended=re.search(r"^\*END\s*$", text, re.MULTILINE | re.IGNORECASE) is not None)
    if told := re.search(r"Purkinje fibres; conduction (\S+) m/s", text):
        deck.speed = told[1]
    for keyword, cards in card_sections(text):
        if any("," in card for card in cards[:1]) and keyword.startswith(("*NODE", "*ELEMENT", "*SET")):
            raise FileError(f"{str(path)!r}: cards with commas ({keyword}) are not read; write them in columns")
        if keyword == "*NODE":
            deck.nodes += [
                (int(card[:8]), [real(card[8 + 16 * i : 24 + 16 * i], card) for i in range(3)]) for card in cards
            ]
        elif keyword == "*PART":
            pairs = [pair for pair in zip(cards[::2], cards[1::2]) if pair[1].strip()]
            deck.titles.update({int(card[:10]): title.strip() for title, card in pairs})
        elif keyword in ("*ELEMENT_SOLID", "*ELEMENT_SOLID_ORTHO"):
            deck.solids += _solids(cards, keyword.endswith("ORTHO"))
        elif keyword == "*ELEMENT_BEAM":
            deck.beams += [integers_of(card, 8)[:4] for card in cards]
        elif keyword.startswith("*ELEMENT_"):
            deck.left_out.add(keyword)
        elif keyword.startswith("*SET_"):
            _add_set(deck, keyword, cards)
    return deck


def _add_set(deck: KeywordDeck, keyword: str, cards: list[str]) -> None:
    if keyword in ("*SET_SEGMENT", "*SET_SEGMENT_TITLE"):
        first = int(keyword.endswith("TITLE"))
        name = cards[0].strip() if first else f"tag_{int(cards[0][:10])}"
        deck.segments.append((name, [integers_of(card[:40], 10) for card in cards[first + 1 :]]))
    elif keyword == "*SET_SOLID_TITLE":
        deck.solid_sets[cards[0].strip().lower()] = [n for card in cards[2:] for n in integers_of(card, 10) if n]
    elif keyword == "*SET_NODE_LIST_TITLE":
        deck.node_sets[cards[0].strip()] = cards[2:]
    elif cards:
        name = cards[0].strip() if keyword.endswith("TITLE") else cards[0][:10].strip()
        deck.other_sets.append(f"{keyword} {name}")


def _solids(cards: list[str], ortho: bool) -> list[SolidCard]:
    """Number, part, nodes and axes of each element; ten nodes stand on a card of their own."""
    found, row = [], 0
    while row < len(cards):
        label, part, *nodes = integers_of(cards[row], 8)
        row += 1
        if not nodes:
            nodes = integers_of(cards[row], 8)
            row += 1
        axes = []
        if ortho:
            axes = [real(card[16 * i : 16 * i + 16], card) for card in cards[row : row + 2] for i in range(3)]
            row += 2
        found.append(SolidCard(label, part, nodes, axes))
    return found


def integers_of(card: str, width: int) -> list[int]:
    """Whole numbers of a card, each of so many columns."""
    return [int(card[i : i + width]) for i in range(0, len(card.rstrip()), width)]
