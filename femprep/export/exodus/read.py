"""An Exodus II file (Cubit, MOOSE, 4C) in, its mesh out: element blocks are regions, side sets are tagged facets.

Names of variables, node order and sides are those of Schoof & Yarberry, EXODUS II: A Finite Element Data Model,
SAND92-2137 (1994), doi:10.2172/10102115.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.export.deck.parts import DeckParts
from femprep.export.deck.unread import with_node_sets
from femprep.export.exodus.store import Variables, opened
from femprep.mesh.elements import ELEMENTS, FACET_TYPES
from femprep.model import FloatArray, IntArray, VolumeMesh
from femprep.model.arrays import integers
from femprep.model.notice import Notice, noted

#: Our element types by the first letters of Exodus' and the number of nodes.
_VOLUME: Final[Mapping[tuple[str, int], str]] = {
    ("TET", 4): "tetra",
    ("TET", 10): "tetra10",
    ("WED", 6): "wedge",
    ("WED", 15): "wedge15",
    ("HEX", 8): "hexahedron",
    ("HEX", 20): "hexahedron20",
}
#: First letters of elements that are surfaces.
_SURFACE: Final = ("TRI", "QUA", "SHE")
#: Where our nodes are in Exodus' order, which has the vertical edges before the upper ones.
_ORDER: Final[Mapping[str, list[int]]] = {
    "wedge15": [*range(9), 12, 13, 14, 9, 10, 11],
    "hexahedron20": [*range(12), 16, 17, 18, 19, 12, 13, 14, 15],
}
#: What blocks (``eb``) and side sets (``ss``) list their elements as.
_LISTS: Final[Mapping[str, str]] = {"eb": "connect", "ss": "elem_ss"}
#: Our number of each of Exodus' sides, by the number of corners.
_SIDES: Final[Mapping[int, list[int]]] = {4: [1, 2, 3, 0], 6: [2, 3, 4, 0, 1], 8: [2, 3, 4, 5, 0, 1]}


@dataclass(frozen=True)
class _Block:
    """Elements of one block: nodes from 0 in our order, our type of them, None where we have none."""

    kind: str | None
    nodes: IntArray
    word: str


def read(path: Path) -> VolumeMesh:
    """Read a mesh with the data of its first step in time.

    Blocks of triangles and quadrilaterals are facets as well. Variables whose names end with X, Y and Z become vectors.

    Raises
    ------
    FileError
        It is neither HDF5 nor of netCDF's classic kind.
    InputError
        It holds no volume elements, or a side set names sides that are not there.
    """
    with opened(path) as file:
        parts, steps = DeckParts(), file.steps()
        points = _points(file)
        blocks = list(_blocks(file))
        data = _element_data(file, blocks)
        for block, tag, values in zip(blocks, _tags(file, "eb", len(blocks), parts, facet=False), data):
            if block.kind is not None and block.kind in ELEMENTS:
                parts.cells.append((block.kind, block.nodes, np.full(len(block.nodes), tag, np.int32), values))
            elif block.kind is not None:
                parts.facets.append((block.kind, block.nodes, tag))
            elif len(block.nodes):
                parts.left_out.add(block.word)
        count = len(_ids(file, "ss"))
        for number, tag in enumerate(_tags(file, "ss", count, parts, facet=True), 1):
            parts.facets += [(kind, nodes, tag) for kind, nodes in _sides(file, number, blocks)]
        nodal = _joined({name: _of_nodes(file, i, len(points)) for i, name in _variables(file, "nod")})
        node_sets = dict(_node_sets(file))
    mesh = with_node_sets(parts.mesh(points, "element blocks", "side sets").with_data(point=nodal), node_sets)
    if steps > 1:
        words = "of {amount} steps in time the first is read"
        mesh = replace(mesh, info=noted(mesh.info, Notice.of("left out", words, amount=steps)))
    return mesh


def _points(file: Variables) -> FloatArray:
    together = file.read("coord")
    if together is not None:
        columns = list(together)
    else:
        columns = [values for axis in "xyz" if (values := file.read(f"coord{axis}")) is not None]
    if len(columns) != 3 or len({len(column) for column in columns}) != 1:
        raise InputError(f"has coordinates of {len(columns)} axes, or of different lengths; a mesh of three is needed")
    return np.column_stack(columns)


def _ids(file: Variables, what: str) -> list[int]:
    """Numbers that the file gives to its blocks (``eb``) or side sets (``ss``)."""
    found = file.read(f"{what}_prop1")
    if found is None:
        found = np.empty(0, dtype=np.int32)
    ids = np.atleast_1d(found)
    if f"{_LISTS[what]}{len(ids) + 1}" in file:
        raise InputError(f"it has a {_LISTS[what]}{len(ids) + 1}, and {len(ids)} numbers in {what}_prop1")
    if ids.ndim != 1 or ids.dtype.kind not in "iu" or np.any((ids < 0) | (ids > np.iinfo(np.int32).max)):
        raise InputError(f"its {what}_prop1 are no numbers that tags can have")
    return [int(one) for one in ids]


def _tags(file: Variables, what: str, count: int, parts: DeckParts, *, facet: bool) -> list[int]:
    """Tags of blocks or side sets, by their names where they have some."""
    ids = _ids(file, what) or list(range(1, count + 1))
    names = file.names(f"{what}_names", count)
    return [parts.numbers.of(name or f"tag_{own}", own, facet=facet) for own, name in zip(ids, names)]


def _blocks(file: Variables) -> Iterator[_Block]:
    for number in range(1, len(_ids(file, "eb")) + 1):
        name = f"connect{number}"
        rows = file.read(name)
        if rows is None:  # of no elements
            yield _Block(None, np.empty((0, 0), dtype=np.int64), "")
            continue
        if rows.ndim != 2 or rows.dtype.kind not in "iu":
            raise InputError(f"its {name} is no list of elements")
        word = file.type_of(name)
        kind = _VOLUME.get((word[:3], rows.shape[1]))
        if kind is None and word.startswith(_SURFACE):
            kind = FACET_TYPES.get(rows.shape[1])
        nodes = rows.astype(np.int64) - 1
        yield _Block(kind, nodes[:, np.array(_ORDER[kind])] if kind is not None and kind in _ORDER else nodes, word)


def _sides(file: Variables, number: int, blocks: list[_Block]) -> Iterator[tuple[str, IntArray]]:
    """Facets of one side set, by type; those on elements that are left out are, too."""
    elements, sides = file.read(f"elem_ss{number}"), file.read(f"side_ss{number}")
    if elements is None and sides is None:
        return
    if elements is None or sides is None or elements.shape != sides.shape or elements.ndim != 1:
        raise InputError(f"side set {number} lists other elements than sides")
    elements, sides = (integers(one, f"side set {number}") for one in (elements, sides))
    ends = np.cumsum([len(block.nodes) for block in blocks])
    place = elements - 1
    if place.size and (place.min() < 0 or place.max() >= ends[-1]):
        raise InputError(f"side set {number} names an element that is not there")
    of = np.searchsorted(ends, place, side="right")
    for i, block in enumerate(blocks):
        if block.kind is None or block.kind not in ELEMENTS:
            continue
        element = ELEMENTS[block.kind]
        order = _SIDES[element.corners]
        rows, own = place[of == i] - (ends[i] - len(block.nodes)), sides[of == i]
        if np.any((own < 1) | (own > len(order))):
            raise InputError(f"side set {number} names a side that a {block.kind} has not")
        for side in np.unique(own):
            face = list(element.face_nodes(order[side - 1]))
            yield FACET_TYPES[len(face)], block.nodes[rows[own == side]][:, face]


def _node_sets(file: Variables) -> Iterator[tuple[str, IntArray | None]]:
    """Names of the sets of nodes, or their numbers, and the rows of their points."""
    ids = file.read("ns_prop1")
    numbers = [] if ids is None else np.atleast_1d(ids).tolist()
    for i, (number, name) in enumerate(zip(numbers, file.names("ns_names", len(numbers))), 1):
        nodes = file.read(f"node_ns{i}")
        yield name or str(number), None if nodes is None or nodes.dtype.kind not in "iu" else nodes.astype(np.int64) - 1


def _variables(file: Variables, what: str) -> list[tuple[int, str]]:
    """Numbers, from 1, and names of the variables of nodes (``nod``) or elements (``elem``)."""
    rows = file.read(f"name_{what}_var")
    count = 0 if rows is None else len(rows)
    return [(i, name) for i, name in enumerate(file.names(f"name_{what}_var", count), 1) if name]


def _of_nodes(file: Variables, number: int, count: int) -> np.ndarray | None:
    values = file.read(f"vals_nod_var{number}", first=True)
    if values is None and (together := file.read("vals_nod_var", first=True)) is not None:
        values = together[number - 1]
    if values is not None and values.shape != (count,):
        raise InputError(f"variable {number} of nodes has {values.shape} values, for {count} nodes")
    return values


def _element_data(file: Variables, blocks: list[_Block]) -> Iterator[dict[str, np.ndarray]]:
    """Variables of each block's elements."""
    variables = _variables(file, "elem")
    for number, block in enumerate(blocks, 1):
        found = {name: file.read(f"vals_elem_var{i}eb{number}", first=True) for i, name in variables}
        for name, values in found.items():
            if values is not None and values.shape != (len(block.nodes),):
                raise InputError(f"{name} has {values.shape} values, for {len(block.nodes)} elements of a block")
        yield _joined(found)


def _joined(found: Mapping[str, np.ndarray | None]) -> dict[str, np.ndarray]:
    """The arrays that are there, three of them whose names end with X, Y and Z as one of vectors."""
    there = {name: values for name, values in found.items() if values is not None}
    for name in list(there):
        stem, last = name[:-1], name[-1:]
        axes = [f"{stem}{axis}" for axis in ("xyz" if last == "x" else "XYZ")]
        if last in ("x", "X") and stem and all(axis in there for axis in axes):
            vector = np.column_stack([there.pop(axis) for axis in axes])
            there[re.sub(r"[_\W]+$", "", stem) or stem] = vector
    return there
