"""The text of an Abaqus or CalculiX deck in; its nodes, elements, sets and surfaces, by its own numbers, out."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from femprep.errors import FileError
from femprep.export.abaqus.springs import PARTNERS, SPRINGS
from femprep.export.abaqus.write import ABAQUS_TYPES
from femprep.mesh.elements import ELEMENTS
from femprep.model import IntArray

KINDS = {name: kind for kind, name in ABAQUS_TYPES.items()}


@dataclass
class Deck:
    """What a deck holds, by the deck's own numbers."""

    nodes: list[np.ndarray] = field(default_factory=list)
    elements: list[tuple[str, IntArray, str]] = field(default_factory=list)
    sets: dict[str, list[Any]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    directions: np.ndarray | None = None
    unit: str = "mm"
    left_out: set[str] = field(default_factory=set)


def parse(path: Path) -> Deck:
    """Read the sections of a deck that make a mesh.

    Raises
    ------
    FileError
        A section does not hold what it should.
    """
    deck = Deck()
    for keyword, options, lines in _sections(path):
        if keyword == "HEADING":
            deck.unit = next((m[1] for line in lines if (m := re.search(r"Units: length (\w+)", line))), deck.unit)
        elif PARTNERS in options.get("NSET", "").lower() or SPRINGS in options.get("ELSET", "").lower():
            continue  # they hold the mesh, and are no part of it
        elif keyword == "NODE" and lines:
            table = _table(lines, path)
            deck.nodes.append(np.pad(table, ((0, 0), (0, max(0, 4 - table.shape[1])))))
        elif keyword == "ELEMENT" and lines:
            kind = _kind(options.get("TYPE", ""))
            if kind is None:
                deck.left_out.add(options.get("TYPE", "?"))
                continue
            values = np.array([int(text) for line in lines for text in _fields(line)], dtype=np.int64)
            width = ELEMENTS[kind].nodes + 1
            if values.size % width:
                raise FileError(
                    f"{str(path)!r}: *ELEMENT {options['TYPE']} holds {values.size} numbers, not {width} each"
                )
            deck.elements.append((kind, values.reshape(-1, width), options.get("ELSET", "")))
            if options.get("ELSET"):
                deck.sets.setdefault(options["ELSET"], []).append(values[::width])
        elif keyword == "ELSET":
            deck.sets.setdefault(options.get("ELSET", ""), []).extend(_members(lines, "GENERATE" in options))
        elif keyword == "DISTRIBUTION" and options.get("LOCATION", "").upper() == "ELEMENT":
            found = [_fields(line) for line in lines if not line.startswith(",")]
            if found and all(len(row) == 7 and row[0].isdigit() for row in found):
                deck.directions = np.array(found, dtype=np.float64)
        elif keyword == "SURFACE" and options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
            pairs = [tuple(_fields(line)[:2]) for line in lines]
            deck.surfaces.setdefault(options.get("NAME", ""), []).extend(p for p in pairs if len(p) == 2)
    return deck


def _sections(path: Path) -> Iterator[tuple[str, dict[str, str], list[str]]]:
    """Keyword, its options and its data lines; comments only where they say the units."""
    keyword = ""
    options: dict[str, str] = {}
    lines: list[str] = []
    with path.open(encoding="utf-8", errors="replace") as file:
        for raw in file:
            line = raw.strip()
            if line.startswith("**"):
                if "Units:" in line:
                    lines.append(line)
            elif line.startswith("*"):
                if keyword:
                    yield keyword, options, lines
                head, *rest = [part.strip() for part in line[1:].split(",")]
                keyword, lines = head.upper(), []
                pairs = (part.partition("=") for part in rest)
                options = {name.strip().upper(): value.strip().strip('"') for name, _, value in pairs}
            elif line:
                lines.append(line)
    if keyword:
        yield keyword, options, lines


def _kind(name: str) -> str | None:
    """Our type of an Abaqus element: C3D4, and with them their variants C3D4H, C3D8R, C3D10MH..."""
    match = re.fullmatch(r"(C3D\d+)[A-Z]*", name.upper())
    return KINDS.get(match[1]) if match else None


def _fields(line: str) -> list[str]:
    return [text for part in line.split(",") if (text := part.strip())]


def _table(lines: list[str], path: Path) -> np.ndarray:
    rows = [_fields(line) for line in lines]
    if len({len(row) for row in rows}) != 1:
        raise FileError(f"{str(path)!r}: the lines of *NODE hold different numbers of values")
    return np.array(rows, dtype=np.float64)


def _members(lines: list[str], generate: bool) -> list[Any]:
    if not generate:
        return [text if not text.lstrip("-").isdigit() else int(text) for line in lines for text in _fields(line)]
    found: list[Any] = []
    for line in lines:
        first, last, *step = (int(text) for text in _fields(line))
        found.append(np.arange(first, last + 1, *step))
    return found
