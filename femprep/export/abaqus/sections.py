"""The text of an Abaqus or CalculiX deck in, files it takes in with it; its sections, one after the other, out."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from femprep.errors import FileError
from femprep.export.deck.includes import OpenedFile

#: What begins the second line of a keyword, and no line of data.
_OPTIONS: Final = re.compile(r"[A-Za-z][\w ]*=|(GENERATE|INTERNAL|UNSORTED)\b", re.IGNORECASE)


@dataclass(frozen=True)
class Section:
    """A keyword with what follows it.

    Attributes
    ----------
    keyword : str
        In capitals.
    options : dict of str to str
        By their names, in capitals.
    lines : list of str
        Data lines; comments only where they say the units.
    """

    keyword: str
    options: dict[str, str]
    lines: list[str]


def sections(path: Path) -> Iterator[Section]:
    """The sections of a deck.

    Raises
    ------
    FileError
        A file that the deck takes in is not there.
    """
    section: Section | None = None
    for line in _lines(OpenedFile(path)):
        if line.startswith("*") and not line.startswith("**"):
            if section is not None:
                yield section
            section = Section(*_head(line), [])
        elif section is not None:
            section.lines.append(line)
    if section is not None:
        yield section


def _lines(opened: OpenedFile) -> Iterator[str]:
    """Lines that count, those of ``*INCLUDE`` and of ``INPUT=`` in their places."""
    with opened.path.open(encoding="utf-8", errors="replace") as file:
        for line in _whole(raw.strip() for raw in file):
            if line.startswith("**"):
                if "Units:" in line:
                    yield line
            elif line.startswith("*"):
                keyword, options = _head(line)
                if keyword != "INCLUDE":
                    yield line
                elif not options.get("INPUT"):
                    raise FileError(f"{str(opened.path)!r}: *INCLUDE names no file; write it as *INCLUDE, INPUT=name")
                if "INPUT" in options:
                    yield from _lines(opened.take_in(options["INPUT"]))
            elif line:
                yield line


def _whole(lines: Iterable[str]) -> Iterator[str]:
    """Lines, those of keywords that end with a comma together with the options in the next."""
    before = ""
    for line in lines:
        if before and _OPTIONS.match(line):
            before += line
        else:
            if before:
                yield before
            before = line
        if not (before.startswith("*") and before.endswith(",")):
            yield before
            before = ""
    if before:
        yield before


def _head(line: str) -> tuple[str, dict[str, str]]:
    """Keyword and options of a line."""
    head, *rest = [part.strip() for part in line[1:].split(",")]
    pairs = (part.partition("=") for part in rest)
    return head.upper(), {name.strip().upper(): value.strip().strip('"') for name, _, value in pairs}
