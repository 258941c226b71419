"""An Abaqus or CalculiX deck in, a volume mesh out: nodes, elements, sets and element surfaces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.errors import FileError, InputError
from femprep.export.abaqus.deck import KINDS, PART, Deck, parse
from femprep.export.abaqus.named import ByName, SetName
from femprep.export.deck.fibres import segment_of
from femprep.export.deck.groups import naming_groups
from femprep.export.deck.names import Numbers
from femprep.export.deck.parts import DeckParts
from femprep.export.deck.units import UNITS
from femprep.export.deck.unread import with_node_sets
from femprep.mesh.elements import ELEMENTS, FACET_TYPES
from femprep.model import BoolArray, IntArray, VolumeMesh
from femprep.model.arrays import integers
from femprep.model.blocks import block_rows
from femprep.model.notice import Notice, noted


def read(path: Path) -> VolumeMesh:
    """Read the volume mesh of a deck, of several parts too, each where its instance puts it.

    Element sets become regions: of several that an element is in one with a material decides, else the first one, and
    one of all elements last. Elements of several parts that are in no set are named after their part; sets and surfaces
    of one name in several parts have the part before it. Element surfaces become tagged facets. Elements of other types
    (shells, springs) are left out.

    Raises
    ------
    FileError
        The file is damaged.
    InputError
        It holds no volume elements.
    """
    deck = parse(path)
    if not deck.nodes or not deck.elements:
        raise InputError(f"holds no volume elements of types {', '.join(KINDS)}; other types: {sorted(deck.left_out)}")
    nodes = _last(np.concatenate(deck.nodes))
    labels, points = integers(nodes[:, 0], "the list of nodes"), nodes[:, 1:4] / UNITS[deck.unit].per_mm
    tables = _tables(deck)
    element_labels = np.concatenate([table[:, 0] for table in tables.values()])
    cells = {kind: _index(labels, table[:, 1:], "node", path) for kind, table in tables.items()}
    parts = DeckParts(left_out=deck.left_out)
    region, told = _regions(deck, element_labels, parts.numbers)
    data = {**_directions(deck, element_labels, path), **_segments(deck, element_labels)}
    for kind, block, own in block_rows(cells):
        parts.cells.append((kind, block, region[own], {name: values[own] for name, values in data.items()}))
    parts.facets += _facets(deck, cells, element_labels, parts.numbers)
    mesh = parts.mesh(points, "ELSET", "SURFACE")
    mesh = replace(mesh, info=noted(mesh.info, *told, *_notices(deck, mesh)))
    return with_node_sets(mesh, _node_sets(deck, labels))


def _node_sets(deck: Deck, labels: IntArray) -> dict[str, IntArray | None]:
    """Rows of the nodes of each set of nodes; None for those of the nodes of elements."""
    parts, sets = {first: name.lower() for name, first in deck.parts.items()}, deck.node_sets
    return {
        written: None
        if any(one is None for one in sets.members(name))
        else _rows_of(labels, _labels_of(sets, labels, name))
        for name, written in sets.shown(parts)
    }


def _tables(deck: Deck) -> dict[str, IntArray]:
    """Labels and nodes of the elements of each type."""
    blocks: dict[str, list[IntArray]] = {}
    kept = _are_last(np.concatenate([rows[:, 0] for _, rows in deck.elements]))
    for kind, rows in deck.elements:
        own, kept = kept[: len(rows)], kept[len(rows) :]
        if own.any():
            blocks.setdefault(kind, []).append(rows[own])
    return {kind: np.concatenate(parts) for kind, parts in blocks.items()}


def _last(table: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """The rows of a table that count."""
    return table[_are_last(table[:, 0])]


def _are_last(labels: npt.NDArray[Any]) -> BoolArray:
    """Which definitions count: the last one of a label, as in Abaqus."""
    _, from_end = np.unique(labels[::-1], return_index=True)
    found = np.zeros(len(labels), dtype=np.bool_)
    found[len(labels) - 1 - from_end] = True
    return found


def _notices(deck: Deck, mesh: VolumeMesh) -> Iterator[Notice]:
    """What was taken, and what was left out."""
    more = sum(map(len, deck.nodes)) - len(mesh.points), sum(len(rows) for _, rows in deck.elements) - mesh.n_cells
    if any(more):
        words = (
            f"definitions of {more[0]} nodes and {more[1]} elements are repeated: the last one was taken, as in Abaqus"
        )
        yield Notice.of("assumed", words)
    if deck.short:
        yield Notice.of(
            "assumed", f"{deck.short} nodes have fewer than three coordinates: 0 for the others, as in Abaqus"
        )
    for name, count in deck.faceless.items():
        if count:
            words = f"rows of the surface {name!r} are left out, which name no face S1 to S6 of elements: {{amount}}"
            yield Notice.of("left out", words, amount=count)
    if deck.unread:
        words = "distributions whose rows are no number of an element and two directions are left out: {amount}"
        yield Notice.of("left out", words, amount=deck.unread)
    if deck.directions is not None and "fiber" not in mesh.cell_data:
        count = len(deck.directions)
        words = f"directions of the last distribution are left out: it has {count}, for {mesh.n_cells} elements"
        yield Notice.of("left out", words)


def _index(labels: IntArray, wanted: IntArray, what: str, path: Path) -> IntArray:
    """Positions of labels."""
    found, known = _found(labels, wanted)
    if not np.all(known):
        raise FileError(f"{str(path)!r}: {what} {int(np.asarray(wanted)[~known][0]) % PART} is used but not defined")
    return found


def _labels_of(sets: ByName, labels: IntArray, name: SetName, seen: tuple[SetName, ...] = ()) -> IntArray:
    """Labels of a set, sets within it opened; of ranges those that there are."""
    kept = sets.find(name)
    if kept is None or kept in seen:
        return np.empty(0, dtype=np.int64)
    parts = [np.empty(0, dtype=np.int64)]
    for member in sets.members(kept):
        if isinstance(member, SetName):
            parts.append(_labels_of(sets, labels, member, (*seen, kept)))
        elif isinstance(member, range):
            within = (labels >= member.start) & (labels < member.stop) & ((labels - member.start) % member.step == 0)
            parts.append(np.sort(labels[within]))
        else:
            parts.append(np.atleast_1d(member))
    return np.concatenate(parts).astype(np.int64)


def _rows_of(labels: IntArray, members: IntArray) -> IntArray:
    """Positions of those labels that exist."""
    rows, known = _found(labels, members)
    return rows[known]


def _found(labels: IntArray, wanted: IntArray) -> tuple[IntArray, BoolArray]:
    """Row of each label wanted among others, and whether it is there."""
    order = np.argsort(labels, kind="stable")
    rows = order[np.minimum(np.searchsorted(labels, wanted, sorter=order), len(labels) - 1)]
    return np.asarray(rows, dtype=np.int64), labels[rows] == wanted


def _segments(deck: Deck, labels: IntArray) -> dict[str, np.ndarray]:
    """AHA segments from the sets ``aha_1``, ``aha_2``..."""
    values = np.zeros(len(labels), dtype=np.int32)
    for name, _ in deck.sets.shown({}):
        if segment := segment_of(name.text):
            values[_rows_of(labels, _labels_of(deck.sets, labels, name))] = segment
    return {"aha": values} if values.any() else {}


def _directions(deck: Deck, labels: IntArray, path: Path) -> dict[str, np.ndarray]:
    """Fibre and sheet from a distribution of two vectors over all elements."""
    if deck.directions is None or len(deck.directions) != len(labels):
        return {}
    rows = _index(labels, deck.directions[:, 0].astype(np.int64), "element", path)
    times = np.bincount(rows, minlength=len(labels))
    if np.any(times > 1):
        twice = labels[np.argmax(times)] % PART
        raise FileError(f"{str(path)!r}: its distribution gives element {twice} several directions; keep one of them")
    found = np.empty((len(labels), 6))
    found[rows] = deck.directions[:, 1:]
    return {"fiber": found[:, :3], "sheet": found[:, 3:]}


def _regions(deck: Deck, labels: IntArray, numbers: Numbers) -> tuple[np.ndarray, list[Notice]]:
    """Region of each element, and what to say of sets that share elements; sets that have a material come first."""
    parts = {first: name.lower() for name, first in deck.parts.items() if (labels // PART == first // PART).any()}
    materials = {deck.sets.find(name) for name in deck.sections}
    groups = []
    for name, written in sorted(deck.sets.shown(parts), key=lambda one: one[0] not in materials):
        rows = _rows_of(labels, np.unique(_labels_of(deck.sets, labels, name)))
        if segment_of(name.text) is None and not (len(rows) == len(labels) and name.text in {"EALL", "ALL"}):
            groups.append((written, rows))
    chosen, told = naming_groups(groups, len(labels))
    region = np.zeros(len(labels), dtype=np.int64)
    for number in np.unique(chosen[chosen >= 0]).tolist():
        region[chosen == number] = numbers.of(groups[number][0])
    for first, part in parts.items() if len(parts) > 1 else ():
        free = (region == 0) & (labels // PART == first // PART)
        if free.any():
            region[free] = numbers.of(part)
    return region.astype(np.int32), told


def _facets(
    deck: Deck, cells: dict[str, IntArray], labels: IntArray, numbers: Numbers
) -> Iterator[tuple[str, IntArray, int]]:
    """Type, nodes and tag of the facets of each surface, some at a time."""
    kinds = np.concatenate([np.full(len(block), kind) for kind, block in cells.items()])
    parts = {first: name.lower() for name, first in deck.parts.items()}
    for kept, name in deck.surfaces.shown(parts):
        members, faces = [], []
        for first, face in deck.surfaces.members(kept):
            own = _labels_of(deck.sets, labels, first) if isinstance(first, SetName) else np.array([first])
            members.append(own)
            faces.append(np.full(len(own), int(face[1]) - 1))
        if not members:
            continue
        wanted, face_numbers = np.concatenate(members), np.concatenate(faces)
        rows, known = _found(labels, wanted)
        rows, face_numbers = rows[known], face_numbers[known]
        for kind, block, own_rows in block_rows(cells):
            for number in range(len(ELEMENTS[kind].faces)):
                chosen = rows[(kinds[rows] == kind) & (face_numbers == number)]
                found = block[chosen - own_rows.start][:, ELEMENTS[kind].face_nodes(number)]
                if len(found):
                    yield FACET_TYPES[found.shape[1]], found, numbers.of(name, facet=True)
