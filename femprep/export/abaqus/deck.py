"""An Abaqus or CalculiX deck in; its nodes, elements, sets and surfaces, by its own numbers, out.

Numbers are those of a part, and each part begins anew: they are told apart by a multiple of :data:`PART`. A part lies
where its instance puts it.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from femprep.errors import FileError, InputError
from femprep.export.abaqus.named import ByName, SetName
from femprep.export.abaqus.sections import Section, sections
from femprep.export.abaqus.springs import PARTNERS, SPRINGS
from femprep.export.abaqus.write import ABAQUS_TYPES
from femprep.export.deck.listed import require_listed
from femprep.export.deck.reals import reals
from femprep.mesh.elements import ELEMENTS
from femprep.model import FloatArray, IntArray

KINDS = {name: kind for kind, name in ABAQUS_TYPES.items()}
#: What numbers of one part are ahead of those of the part before; what is in no part comes first.
PART: Final = 10**12
#: Keywords that make nodes or elements, or move nodes.
_MAKING: Final = frozenset({"NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYMMETRIC MODEL GENERATION"})
#: Numbers of elements or nodes, none of them beyond those of a part.
_NUMBERS: Final = re.compile(r"(?:[0-9]{1,12}\s*(?:,\s*|$))*")
#: What no set can be called.
_FRACTION: Final = re.compile(r"[-+]?\d*\.\d*|-\d+")


@dataclass
class Deck:
    """What a deck holds, by the deck's own numbers."""

    nodes: list[np.ndarray] = field(default_factory=list)
    elements: list[tuple[str, IntArray]] = field(default_factory=list)
    #: Sets by name: ranges and arrays of numbers, numbers and names of sets.
    sets: ByName = field(default_factory=ByName)
    #: Sets of nodes by name, likewise; None for those of the nodes of something.
    node_sets: ByName = field(default_factory=ByName)
    #: Surfaces by name: numbers or names of sets, and a face of each.
    surfaces: ByName = field(default_factory=ByName)
    #: Sets that have a material.
    sections: list[SetName] = field(default_factory=list)
    #: How many rows of each surface name no face of a solid.
    faceless: Counter[str] = field(default_factory=Counter)
    directions: np.ndarray | None = None
    #: Distributions of directions of something else than elements by their numbers.
    unread: int = 0
    #: How many nodes have fewer than three coordinates.
    short: int = 0
    unit: str = "mm"
    left_out: set[str] = field(default_factory=set)
    #: First number of each part, by its name in capitals, and of the part of each instance.
    parts: dict[str, int] = field(default_factory=dict)
    instances: dict[str, int] = field(default_factory=dict)
    #: How the part of each instance is moved and turned, by its first number.
    moves: dict[int, list[FloatArray]] = field(default_factory=dict)


def parse(path: Path) -> Deck:
    """Read the sections of a deck that make a mesh.

    Raises
    ------
    FileError
        A section does not hold what it should.
    """
    deck, here = Deck(), 0
    for section in sections(path):
        keyword, options, lines = section.keyword, section.options, section.lines
        first = deck.instances.get(options.get("INSTANCE", "").upper(), here)
        require_listed(path, keyword, _MAKING)
        if (keyword == "SYSTEM" and lines) or (keyword == "NODE" and options.get("SYSTEM", "R").upper() != "R"):
            raise FileError(
                f"{str(path)!r}: nodes in axes of their own (*SYSTEM) are not read; write them in global ones"
            )
        if keyword == "HEADING":
            deck.unit = next((m[1] for line in lines if (m := re.search(r"Units: length (\w+)", line))), deck.unit)
        elif keyword == "PART":
            here = deck.parts.setdefault(options.get("NAME", "").upper(), PART * (len(deck.parts) + 1))
        elif keyword == "INSTANCE":
            here = _place(deck, options, lines, path)
        elif keyword in ("END PART", "END INSTANCE"):
            here = 0
        elif PARTNERS in options.get("NSET", "").lower() or SPRINGS in options.get("ELSET", "").lower():
            continue  # they hold the mesh, and are no part of it
        elif keyword == "NODE" and lines:
            table = _table(lines, deck)
            table[:, 0] += first
            deck.nodes.append(table)
            if "NSET" in options:
                deck.node_sets.add(SetName(options["NSET"], here), [table[:, 0].astype(np.int64)])
        elif keyword == "ELEMENT" and lines:
            _add_elements(deck, section, first, here, path)
        elif keyword == "ELSET":
            members = _members(deck, lines, first, "GENERATE" in options)
            deck.sets.add(SetName(options.get("ELSET", ""), here), members)
        elif keyword == "NSET":
            of_elements = "ELSET" in options
            own = [None] if of_elements else _members(deck, lines, first, "GENERATE" in options)
            deck.node_sets.add(SetName(options.get("NSET", ""), here), own)
        elif keyword == "SOLID SECTION":
            deck.sections.append(SetName(options.get("ELSET", ""), here))
        elif keyword == "DISTRIBUTION" and options.get("LOCATION", "").upper() == "ELEMENT":
            found = [_fields(line) for line in lines if not line.startswith(",")]
            if any(len(row) != 7 or not row[0].isdigit() for row in found):
                deck.unread += any(len(row) == 7 for row in found)
            elif found:
                deck.directions = reals(found)
                deck.directions[:, 0] += first
        elif keyword == "SURFACE" and options.get("TYPE", "ELEMENT").upper() == "ELEMENT":
            name, rows = options.get("NAME", ""), [_fields(line)[:2] for line in lines]
            pairs = [(_member(deck, row[0], first), row[1].upper()) for row in rows if len(row) == 2]
            known = [(member, face) for member, face in pairs if re.fullmatch(r"S[1-6]", face)]
            deck.surfaces.add(SetName(name, here), known)
            deck.faceless[name] += len(rows) - len(known)
    for table in deck.nodes if deck.moves else ():
        for first, given in deck.moves.items():  # last: an instance may hold nodes of its own
            own = table[:, 0] // PART == first // PART
            table[own, 1:4] = _moved(table[own, 1:4], given)
    return deck


def _place(deck: Deck, options: dict[str, str], lines: Sequence[str], path: Path) -> int:
    """Note where an instance puts its part: moved, then turned round an axis. Returns the part's first number."""
    name, part = options.get("NAME", ""), options.get("PART", "").upper()
    if part not in deck.parts:
        raise FileError(f"{str(path)!r}: instance {name!r} is of part {options.get('PART')!r}, which is not there")
    first = deck.parts[part]
    if first in deck.instances.values():
        raise FileError(f"{str(path)!r}: part {options['PART']!r} is placed twice; each copy needs a part of its own")
    deck.instances[name.upper()] = first
    if lines:
        deck.moves[first] = [reals([_fields(line)])[0] for line in lines]
    return first


def _moved(points: FloatArray, given: Sequence[FloatArray]) -> FloatArray:
    """Points moved by the first row of an instance, then turned by the second: two points of an axis, degrees."""
    points = points + given[0]
    if len(given) == 1:
        return points
    start, end, angle = given[1][:3], given[1][3:6], given[1][6]
    turn = Rotation.from_rotvec(np.radians(angle) * (end - start) / np.linalg.norm(end - start))
    return np.asarray(start + turn.apply(points - start))


def _add_elements(deck: Deck, section: Section, first: int, here: int, path: Path) -> None:
    name = section.options.get("TYPE", "?")
    kind = _kind(name)
    if kind is None:
        deck.left_out.add(name)
        return
    values = np.array([int(text) for line in section.lines for text in _fields(line)], dtype=np.int64)
    width = ELEMENTS[kind].nodes + 1
    if values.size % width:
        raise FileError(f"{str(path)!r}: *ELEMENT {name} holds {values.size} numbers, not {width} each")
    rows = values.reshape(-1, width) + first
    deck.elements.append((kind, rows))
    if section.options.get("ELSET"):
        deck.sets.add(SetName(section.options["ELSET"], here), [rows[:, 0]])


def _kind(name: str) -> str | None:
    """Our type of an Abaqus element: C3D4, and with them their variants C3D4H, C3D8R, C3D10MH..."""
    match = re.fullmatch(r"(C3D\d+)[A-Z]*", name.upper())
    return KINDS.get(match[1]) if match else None


def _fields(line: str) -> list[str]:
    return [text for part in line.split(",") if (text := part.strip())]


def _table(lines: Sequence[str], deck: Deck) -> np.ndarray:
    """Numbers and coordinates of nodes; those that are not given are 0, as in Abaqus, and counted."""
    rows = [[text.strip() for text in line.split(",", 4)[:4]] for line in lines]
    short = [row for row in rows if len(row) < 4 or not all(row)]
    deck.short += len(short)
    for row in short:
        row[1:] = [text or "0" for text in row[1:]] + ["0"] * (4 - len(row))
    return reals(rows)


def _member(deck: Deck, text: str, first: int) -> SetName | int:
    """The number of an element or the name of a set; ``instance.number`` is one of that instance."""
    instance, _, own = text.rpartition(".")
    if instance.upper() in deck.instances:
        text, first = own, deck.instances[instance.upper()]
    if _FRACTION.fullmatch(text):
        raise InputError(f"it lists an element {text}, expected a whole number")
    return first + int(text) if text.isdigit() else SetName(text, first)


def _members(deck: Deck, lines: list[str], first: int, generate: bool) -> list[Any]:
    if not generate and all(map(_NUMBERS.fullmatch, lines)):  # most are, and long
        return [first + np.array([int(text) for line in lines for text in line.split(",") if text.strip()], np.int64)]
    if not generate:
        return [_member(deck, text, first) for line in lines for text in _fields(line)]
    return [_generated(line, first) for line in lines]


def _generated(line: str, first: int) -> range:
    """The numbers from one to another, of which a deck may have but a few."""
    given = _fields(line)
    numbers = [int(text) for text in given if text.isdigit()]
    if len(numbers) != len(given) or len(given) not in (2, 3) or numbers[0] > numbers[1] or 0 in numbers[2:]:
        raise InputError(f"GENERATE holds {line!r}, expected the first number, a last one not below it, and a step")
    low, high, step = (*numbers, 1)[:3]
    return range(first + low, first + min(high, PART - 1) + 1, step)
