"""The text of an LS-DYNA keyword file in, files it takes in with it; its keywords, each with its cards, out."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from femprep.errors import FileError
from femprep.export.deck.includes import OpenedFile
from femprep.export.deck.listed import require_listed

#: Keywords that move, copy or merge nodes or parts.
_MAKING: Final = frozenset(
    {"*NODE_TRANSFORM", "*PART_MOVE", "*PART_DUPLICATE", "*NODE_MERGE", "*NODE_MERGE_SET", "*NODE_MERGE_TOLERANCE"}
)
#: Words behind a keyword by which cards have other columns.
_LONG: Final = frozenset({"%", "+", "LONG=Y", "LONG=S", "LONG=K", "I10=Y"})


def card_lines(opened: OpenedFile) -> Iterator[str]:
    """Lines of a file up to its ``*END``, those of the files it takes in in their places.

    Raises
    ------
    FileError
        Such a file is not there, or is to be moved or renumbered; or nodes or elements are others than those listed.
    """
    including = False
    for line in opened.path.read_text(encoding="utf-8", errors="replace").splitlines():
        if line.startswith("*"):
            keyword, *rest = line.upper().split()
            require_listed(opened.path, keyword, _MAKING)
            if set(rest) & _LONG:
                raise FileError(
                    f"{str(opened.path)!r}: long cards ({line[:40].strip()}) are not read; write standard ones"
                )
            if keyword == "*END":  # what is behind it is no part of the file
                if opened.by is None:
                    yield line
                return
            including = keyword == "*INCLUDE"
            if keyword.startswith("*INCLUDE_"):
                raise FileError(f"{str(opened.path)!r}: {keyword} is not followed; put what it takes in into one file")
        if not including:
            yield line
        elif line.strip() and line[0] not in "*$":
            yield from card_lines(opened.take_in(line))


def card_sections(text: str) -> Iterator[tuple[str, list[str]]]:
    """Keywords with the cards below them, comments left out."""
    keyword, cards = "", list[str]()
    for line in text.splitlines():
        if line.startswith("$") or not (line.strip() or keyword == "*PART"):  # a title may be blank
            continue
        if line.startswith("*"):
            if keyword:
                yield keyword, cards
            keyword, cards = line.split()[0].upper(), []
        else:
            cards.append(line)
    if keyword:
        yield keyword, cards
