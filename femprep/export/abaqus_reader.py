"""An Abaqus or CalculiX deck in, a volume mesh out: nodes, elements, sets and element surfaces."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from femprep.elements import ELEMENTS, FACET_TYPES
from femprep.errors import FileError, InputError
from femprep.export.abaqus import ABAQUS_TYPES
from femprep.export.names import Numbers
from femprep.export.units import UNITS
from femprep.model import IntArray, VolumeMesh

log = logging.getLogger(__name__)

_KINDS = {name: kind for kind, name in ABAQUS_TYPES.items()}


@dataclass
class _Deck:
    """What a deck holds, by the deck's own numbers."""

    nodes: list[np.ndarray] = field(default_factory=list)
    elements: list[tuple[str, IntArray, str]] = field(default_factory=list)
    sets: dict[str, list[Any]] = field(default_factory=dict)
    surfaces: dict[str, list[tuple[str, str]]] = field(default_factory=dict)
    directions: np.ndarray | None = None
    unit: str = "mm"
    left_out: set[str] = field(default_factory=set)


def read(path: Path) -> VolumeMesh:
    """Read the volume mesh of a deck.

    Element sets become regions (the first set an element is in decides, sets of all elements do not count), element
    surfaces become tagged facets. Elements of other types (shells, springs) are left out.

    Raises
    ------
    FileError
        The file is damaged.
    InputError
        It holds no volume elements.
    """
    deck = _parse(path)
    if not deck.nodes or not deck.elements:
        raise InputError(f"holds no volume elements of types {', '.join(_KINDS)}; other types: {sorted(deck.left_out)}")
    nodes = np.concatenate(deck.nodes)
    labels, points = nodes[:, 0].astype(np.int64), nodes[:, 1:4] / UNITS[deck.unit].per_mm
    blocks: dict[str, list[IntArray]] = {}
    for kind, rows, _ in deck.elements:
        blocks.setdefault(kind, []).append(rows)
    tables = {kind: np.concatenate(parts) for kind, parts in blocks.items()}
    element_labels = np.concatenate([table[:, 0] for table in tables.values()])
    cells = {kind: _index(labels, table[:, 1:], "node", path) for kind, table in tables.items()}
    numbers = Numbers()
    region = _regions(deck, element_labels, numbers)
    cell_data = {**_directions(deck, element_labels, path), **_segments(deck, element_labels)}
    facets, facet_tag = _facets(deck, cells, element_labels, numbers)
    if deck.left_out:
        log.warning("elements of types %s are left out", ", ".join(sorted(deck.left_out)))
    return VolumeMesh(
        points=points,
        cells=cells,
        region=region,
        facets=facets,
        facet_tag=facet_tag,
        cell_data=cell_data,
        info={
            "source": {"region": "ELSET", "facet_tag": "SURFACE", "left_out": sorted(deck.left_out)},
            **numbers.info,
        },
    )


def _parse(path: Path) -> _Deck:
    deck = _Deck()
    for keyword, options, lines in _sections(path):
        if keyword == "HEADING":
            deck.unit = next((m[1] for line in lines if (m := re.search(r"Units: length (\w+)", line))), deck.unit)
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
    return _KINDS.get(match[1]) if match else None


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


def _index(labels: IntArray, wanted: IntArray, what: str, path: Path) -> IntArray:
    """Positions of labels."""
    order = np.argsort(labels, kind="stable")
    place = np.minimum(np.searchsorted(labels, wanted, sorter=order), len(labels) - 1)
    found = order[place]
    wrong = labels[found] != wanted
    if np.any(wrong):
        raise FileError(f"{str(path)!r}: {what} {int(np.asarray(wanted)[wrong][0])} is used but not defined")
    return found


def _labels_of(deck: _Deck, name: str, seen: tuple[str, ...] = ()) -> IntArray:
    """Element labels of a set, sets within it opened; a set is named in any case."""
    wanted = next((own for own in deck.sets if own.upper() == name.upper()), None)
    if wanted is None or wanted in seen:
        return np.empty(0, dtype=np.int64)
    parts = [
        _labels_of(deck, member, (*seen, wanted)) if isinstance(member, str) else np.atleast_1d(member)
        for member in deck.sets[wanted]
    ]
    return np.concatenate([np.empty(0, dtype=np.int64), *parts]).astype(np.int64)


def _rows_of(labels: IntArray, members: IntArray) -> IntArray:
    """Positions of those labels that exist."""
    order = np.argsort(labels, kind="stable")
    rows = order[np.minimum(np.searchsorted(labels, members, sorter=order), len(labels) - 1)]
    return np.asarray(rows[labels[rows] == members], dtype=np.int64)


def _segments(deck: _Deck, labels: IntArray) -> dict[str, np.ndarray]:
    """AHA segments from the sets ``aha_1``, ``aha_2``..."""
    values = np.zeros(len(labels), dtype=np.int32)
    for name in deck.sets:
        match = re.fullmatch(r"aha_(\d+)", name.lower())
        if match:
            values[_rows_of(labels, _labels_of(deck, name))] = int(match[1])
    return {"aha": values} if values.any() else {}


def _directions(deck: _Deck, labels: IntArray, path: Path) -> dict[str, np.ndarray]:
    """Fibre and sheet from a distribution of two vectors over all elements."""
    if deck.directions is None or len(deck.directions) != len(labels):
        return {}
    rows = _index(labels, deck.directions[:, 0].astype(np.int64), "element", path)
    found = np.empty((len(labels), 6))
    found[rows] = deck.directions[:, 1:]
    return {"fiber": found[:, :3], "sheet": found[:, 3:]}


def _regions(deck: _Deck, labels: IntArray, numbers: Numbers) -> np.ndarray:
    region = np.zeros(len(labels), dtype=np.int64)
    for name in deck.sets:
        if re.fullmatch(r"aha_\d+", name.lower()):
            continue
        rows = _rows_of(labels, np.unique(_labels_of(deck, name)))
        if len(rows) == len(labels) and name.upper() in {"EALL", "ALL"}:
            continue
        free = rows[region[rows] == 0]
        if free.size:
            region[free] = numbers.of(name)
    return region.astype(np.int32)


def _facets(
    deck: _Deck, cells: dict[str, IntArray], labels: IntArray, numbers: Numbers
) -> tuple[dict[str, IntArray], np.ndarray]:
    kinds = np.concatenate([np.full(len(block), kind) for kind, block in cells.items()])
    starts = dict(zip(cells, np.cumsum([0, *(len(block) for block in cells.values())])))
    order = np.argsort(labels, kind="stable")
    nodes: dict[str, list[IntArray]] = {}
    tags: dict[str, list[np.ndarray]] = {}
    for name, pairs in deck.surfaces.items():
        members, faces = [], []
        for first, face in pairs:
            own = np.array([int(first)]) if first.isdigit() else _labels_of(deck, first)
            if re.fullmatch(r"S[1-6]", face.upper()):
                members.append(own)
                faces.append(np.full(len(own), int(face[1]) - 1))
        if not members:
            continue
        wanted, face_numbers = np.concatenate(members), np.concatenate(faces)
        rows = order[np.minimum(np.searchsorted(labels, wanted, sorter=order), len(labels) - 1)]
        known = labels[rows] == wanted
        rows, face_numbers = rows[known], face_numbers[known]
        for kind, block in cells.items():
            for number in range(len(ELEMENTS[kind].faces)):
                chosen = rows[(kinds[rows] == kind) & (face_numbers == number)]
                found = block[chosen - starts[kind]][:, ELEMENTS[kind].face_nodes(number)]
                if len(found):
                    facet_kind = FACET_TYPES[found.shape[1]]
                    nodes.setdefault(facet_kind, []).append(found)
                    tag = np.full(len(found), numbers.of(name, facet=True), dtype=np.int32)
                    tags.setdefault(facet_kind, []).append(tag)
    facets = {kind: np.concatenate(parts) for kind, parts in nodes.items()}
    all_tags = [np.concatenate(tags[kind]) for kind in facets]
    return facets, np.concatenate([np.empty(0, dtype=np.int32), *all_tags])
