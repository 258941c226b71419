"""The element types: node order, faces, edges. Names are meshio's; the order is VTK's and Abaqus'.

An element is positive when its Jacobian is: the nodes 0-1-2(-3) of its first face run counter-clockwise seen from the
opposite nodes. Faces are listed in Abaqus' order (S1, S2, ...) and wound outward.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from femprep.mesh.least_corner import BlockParts, unpaired
from femprep.mesh.numbering import row_numbers
from femprep.model import IntArray, TagArray
from femprep.model.blocks import block_rows, chosen_rows
from femprep.model.element_nodes import ELEMENT_NODES, FACET_NODES


@dataclass(frozen=True)
class ElementType:
    """One element type.

    Attributes
    ----------
    name : str
        meshio's name.
    corners, nodes : int
        Numbers of corner nodes and of all nodes.
    edges : tuple of pairs
        Corner nodes of each edge; a quadratic element carries its mid-side nodes in this order after the corners.
    faces : tuple of tuples
        Corner nodes of each face, outward, in Abaqus' order.
    """

    name: str
    corners: int
    nodes: int
    edges: tuple[tuple[int, int], ...]
    faces: tuple[tuple[int, ...], ...]

    @property
    def quadratic(self) -> bool:
        """Whether it has mid-side nodes."""
        return self.nodes > self.corners

    def face_nodes(self, face: int) -> tuple[int, ...]:
        """All nodes of a face: its corners, then the mid-side nodes of its edges in turn."""
        corner = self.faces[face]
        if not self.quadratic:
            return corner
        middle = {frozenset(edge): self.corners + i for i, edge in enumerate(self.edges)}
        ring = zip(corner, corner[1:] + corner[:1])
        return corner + tuple(middle[frozenset(pair)] for pair in ring)


_TET_EDGES = ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))
_TET_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))
_WEDGE_EDGES = ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5))
_WEDGE_FACES = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_HEX_EDGES = (
    *((0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6)),
    *((6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)),
)
_HEX_FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))

#: Volume elements by name.
ELEMENTS: Final[Mapping[str, ElementType]] = MappingProxyType(
    {
        element.name: element
        for element in (
            ElementType("tetra", 4, ELEMENT_NODES["tetra"], _TET_EDGES, _TET_FACES),
            ElementType("tetra10", 4, ELEMENT_NODES["tetra10"], _TET_EDGES, _TET_FACES),
            ElementType("wedge", 6, ELEMENT_NODES["wedge"], _WEDGE_EDGES, _WEDGE_FACES),
            ElementType("wedge15", 6, ELEMENT_NODES["wedge15"], _WEDGE_EDGES, _WEDGE_FACES),
            ElementType("hexahedron", 8, ELEMENT_NODES["hexahedron"], _HEX_EDGES, _HEX_FACES),
            ElementType("hexahedron20", 8, ELEMENT_NODES["hexahedron20"], _HEX_EDGES, _HEX_FACES),
        )
    }
)

#: Quadratic type by the linear one of the same shape.
QUADRATIC: Final[Mapping[str, str]] = MappingProxyType(
    {"tetra": "tetra10", "wedge": "wedge15", "hexahedron": "hexahedron20"}
)
#: Facet type by its number of nodes.
FACET_TYPES: Final[Mapping[int, str]] = MappingProxyType({count: name for name, count in FACET_NODES.items()})

#: Number of corner nodes of a facet type.
FACET_CORNERS: Final[Mapping[str, int]] = MappingProxyType({"triangle": 3, "quad": 4, "triangle6": 3, "quad8": 4})


@dataclass(frozen=True)
class ElementFaces:
    """The faces of all elements of one facet type.

    Attributes
    ----------
    nodes : (f, q) array
        All nodes of each face, outward from its element.
    element : (f,) array
        Number of the element, over all blocks in their order.
    face : (f,) array
        Which face of that element it is, from 0, in Abaqus' order.
    """

    nodes: IntArray
    element: IntArray
    face: IntArray


def element_faces(cells: Mapping[str, IntArray]) -> dict[str, ElementFaces]:
    """List every face of every element, by facet type; interior faces come twice, once from each side."""
    size = dict.fromkeys(FACET_TYPES.values(), 0)
    parts = []
    for name, block, own in block_rows(cells):
        kind = ELEMENTS[name]
        for face in range(len(kind.faces)):
            nodes = kind.face_nodes(face)
            facet = FACET_TYPES[len(nodes)]
            parts.append((facet, size[facet], block, nodes, own.start, face))
            size[facet] += len(block)
    width = {name: count for count, name in FACET_TYPES.items()}
    found = {
        facet: ElementFaces(np.empty((size[facet], width[facet]), np.int64), *np.empty((2, size[facet]), np.int64))
        for facet in dict.fromkeys(part[0] for part in parts)
    }
    for facet, start, block, nodes, number, face in parts:
        rows = slice(start, start + len(block))
        for column, node in enumerate(nodes):
            found[facet].nodes[rows, column] = block[:, node]
        found[facet].element[rows] = np.arange(number, number + len(block))
        found[facet].face[rows] = face
    return found


def near_others(cells: IntArray, label: TagArray) -> IntArray:
    """Elements ``(k,)`` with three corners or more that those of other labels have too: the few that may share faces.

    Parameters
    ----------
    cells : (n, p) array
        Their corners.
    label : (n,) array
        A number for each.
    """
    labels = np.unique(label)
    shared = np.zeros((int(cells.max(initial=-1)) + 1, len(labels)), dtype=np.bool_)
    shared[cells, np.searchsorted(labels, label)[:, None]] = True
    return np.flatnonzero((shared.sum(axis=1) > 1)[cells].sum(axis=1) >= 3)


def face_parts(cells: Mapping[str, IntArray]) -> dict[str, list[BlockParts]]:
    """The corners of all faces of all elements, by facet type, numbered in the order of ``element_faces``."""
    parts: dict[str, list[BlockParts]] = {}
    for name, block, own in block_rows(cells):
        for facet, faces in _faces_by_type(ELEMENTS[name]).items():
            corners = np.array([ELEMENTS[name].faces[face] for face in faces])
            parts.setdefault(facet, []).append(BlockParts(block, corners, own.start))
    return parts


def boundary_faces(cells: Mapping[str, IntArray]) -> dict[str, ElementFaces]:
    """The faces that belong to one element only, by facet type, in the order of ``element_faces``."""
    return {facet: faces_of(cells, facet, unpaired(parts)) for facet, parts in face_parts(cells).items()}


def faces_of(cells: Mapping[str, IntArray], facet: str, number: IntArray) -> ElementFaces:
    """The faces of one facet type with some numbers, ascending, in the order of ``element_faces``."""
    found, first = [], 0
    for name, block, own in block_rows(cells):
        faces = _faces_by_type(ELEMENTS[name]).get(facet)
        if faces is None:
            continue
        low, high = np.searchsorted(number, [first, first + len(faces) * len(block)])
        which, row = np.divmod(number[low:high] - first, max(len(block), 1))
        nodes = np.array([ELEMENTS[name].face_nodes(face) for face in faces])
        found.append((block[row[:, None], nodes[which]], own.start + row, np.array(faces)[which]))
        first += len(faces) * len(block)
    return ElementFaces(*(np.concatenate(arrays) for arrays in zip(*found)))


def facet_types(cells: Mapping[str, IntArray]) -> set[str]:
    """The facet types that faces of some elements are."""
    return {facet for name in cells for facet in _faces_by_type(ELEMENTS[name])}


def _faces_by_type(kind: ElementType) -> dict[str, list[int]]:
    """Numbers of the faces of an element type, by the facet type they are."""
    found: dict[str, list[int]] = {}
    for face in range(len(kind.faces)):
        found.setdefault(FACET_TYPES[len(kind.face_nodes(face))], []).append(face)
    return found


def match_facets(cells: Mapping[str, IntArray], facets: Mapping[str, IntArray]) -> tuple[IntArray, IntArray]:
    """Find the element, and which of its faces, each facet lies on.

    Parameters
    ----------
    cells, facets : mapping of str to array
        Blocks of elements and of facets, as in ``VolumeMesh``.

    Returns
    -------
    element, face : (n_facets,) arrays
        Element number over all blocks and face number from 0; -1 for a facet that no element has. An interface facet
        gets the element on whose outside its winding is, where the windings tell, else the first.
    """
    # Only faces whose corners all lie on facets can match, and only elements with three such corners have them: few, so
    # that the sorting below is quick.
    touched = np.zeros(
        max((int(block.max(initial=0)) for block in (*cells.values(), *facets.values())), default=0) + 1, np.int8
    )
    for kind, nodes in facets.items():
        touched[nodes[:, : FACET_CORNERS[kind]]] = 1
    near = [sum(touched[block[:, i]] for i in range(ELEMENTS[name].corners)) >= 3 for name, block in cells.items()]
    mask = np.concatenate([np.empty(0, dtype=np.bool_), *near])
    faces, numbered = element_faces(chosen_rows(cells, mask)), np.flatnonzero(mask)
    elements, numbers = [], []
    for kind, nodes in facets.items():
        element = np.full(len(nodes), -1, dtype=np.int64)
        number = np.full(len(nodes), -1, dtype=np.int64)
        if kind in faces:
            corners = FACET_CORNERS[kind]
            wanted, have = nodes[:, :corners], faces[kind].nodes[:, :corners]
            row = first_row(_ring(have), _ring(wanted))
            missed = row < 0
            if missed.any():
                row[missed] = first_row(np.sort(have, axis=1), np.sort(wanted[missed], axis=1))
            element[row >= 0] = numbered[faces[kind].element[row[row >= 0]]]
            number[row >= 0] = faces[kind].face[row[row >= 0]]
        elements.append(element)
        numbers.append(number)
    if not elements:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    return np.concatenate(elements), np.concatenate(numbers)


def _ring(nodes: IntArray) -> IntArray:
    """Each row turned so that its smallest number comes first: equal for equal rings of the same sense."""
    count = nodes.shape[1]
    turn = (np.argmin(nodes, axis=1)[:, None] + np.arange(count)) % count
    return np.take_along_axis(nodes, turn, axis=1)


def first_row(have: IntArray, wanted: IntArray) -> IntArray:
    """For each wanted row, the first row of ``have`` that equals it, or -1."""
    inverse = row_numbers(np.concatenate([have, wanted]))
    first = np.full(len(have) + len(wanted), -1, dtype=np.int64)
    first[inverse[: len(have)][::-1]] = np.arange(len(have))[::-1]
    return np.asarray(first[inverse[len(have) :]], dtype=np.int64)
