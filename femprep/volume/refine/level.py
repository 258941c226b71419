"""One level of refinement: a mesh in, the mesh of eight elements for each out, its new nodes numbered and placed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from femprep.errors import InputError
from femprep.mesh.compiled import compiled
from femprep.mesh.elements import ELEMENTS, FACET_CORNERS, facet_types
from femprep.mesh.measures.sample_points import family, shape_values
from femprep.mesh.numbering import set_numbers
from femprep.model import FloatArray, IntArray, TagArray
from femprep.volume.refine.templates import FACET_CHILDREN, cut_of


@dataclass(frozen=True)
class Numbered:
    """The nodes of the cut of a mesh.

    Attributes
    ----------
    lattice : dict of str to (m, l) array
        Node of each place of the lattice, by element type.
    facets : dict of str to (f, k) array
        Corners, middles of sides and centre of each facet, by facet type of linear elements.
    middles : (n, 3) array
        All nodes where a straight cut (on quadratic elements one along their curves) puts them, mm.
    """

    lattice: dict[str, IntArray]
    facets: dict[str, IntArray]
    middles: FloatArray


def number_nodes(points: FloatArray, cells: Mapping[str, IntArray], facets: Mapping[str, IntArray]) -> Numbered:
    """Number the nodes of the cut: the mesh's own, the middles of edges, of quadrilateral faces, of hexahedra.

    Raises
    ------
    InputError
        An element names a node twice, or a facet is the face of no element.
    """
    _check_nodes(cells)
    for kind, block in facets.items():
        if len(block) and kind not in facet_types(cells):
            words = f"a facet is a {kind}, of the points {block[0].tolist()}, and no element has such a face"
            raise InputError(f"{words}; facets must be faces")
    quadratic = any(ELEMENTS[name].quadratic for name in cells)
    lattice = {name: [block] for name, block in cells.items()}
    rings = {kind: [block] for kind, block in facets.items()}
    middles = [np.asarray(points)]
    count = len(points)
    if not quadratic:
        pairs = {name: [block[:, pair] for pair in ELEMENTS[name].edges] for name, block in cells.items()}
        sides = {
            kind: [block[:, [i, (i + 1) % block.shape[1]]] for i in range(block.shape[1])]
            for kind, block in facets.items()
        }
        ends, found, on_facets = _shared(pairs, sides, "an edge")
        for name, columns in found.items():
            lattice[name].append(count + columns)
        for kind, columns in on_facets.items():
            rings[kind].append(count + columns)
        middles.append(0.5 * (points[ends[:, 0]] + points[ends[:, 1]]))
        count += len(ends)
    quads = {name: [block[:, face] for face in cut_of(name).quads] for name, block in cells.items()}
    faces = {kind: [block[:, :4]] if FACET_CORNERS[kind] == 4 else [] for kind, block in facets.items()}
    if any(quads.values()):
        _, found, on_facets = _shared(quads, faces, "a face")
        total = 0
        for name, columns in found.items():
            if columns.shape[1]:
                lattice[name].append(count + columns)
                total = max(total, int(columns.max()) + 1)
        for kind, columns in on_facets.items():
            if columns.shape[1]:
                rings[kind].append(count + columns)
        middles.append(_centres(points, cells, found, total))
        count += total
    if "hexahedron" in map(family, cells):
        for name, block in cells.items():
            if family(name) == "hexahedron":
                lattice[name].append(count + np.arange(len(block))[:, None])
                middles.append(_values(name, cut_of(name).lattice[-1], points, block))
                count += len(block)
    width = {"triangle6": "triangle", "quad8": "quad"}
    return Numbered(
        {name: np.ascontiguousarray(np.concatenate(parts, axis=1)) for name, parts in lattice.items()},
        {width.get(kind, kind): np.concatenate(parts, axis=1) for kind, parts in rings.items()},
        np.concatenate(middles),
    )


def cut_cells(points: FloatArray, lattice: Mapping[str, IntArray]) -> tuple[dict[str, IntArray], dict[str, TagArray]]:
    """The children as linear elements, eight after eight, and which way each element was cut, by element type."""
    out, ways = {}, {}
    for name, nodes in lattice.items():
        children = cut_of(name).children
        way = np.zeros(len(nodes), dtype=np.int32)
        cells = np.empty((8 * len(nodes), children.shape[2]), dtype=np.int64)
        if family(name) == "tetra":
            _cut_tetrahedra(len(nodes), np.ascontiguousarray(points), nodes, children, cells, way)
        else:
            for child, columns in enumerate(children[0]):
                cells[child::8] = nodes[:, columns]
        out[family(name)], ways[name] = cells, way
    return out, ways


@compiled(inner=True, part=True)
def _square(points: FloatArray, a: int, b: int) -> float:
    x, y, z = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    return float(x * x + y * y + z * z)


@compiled(grain=8192)
def _cut_tetrahedra(
    first: int, last: int, points: FloatArray, lattice: IntArray, table: IntArray, out: IntArray, diagonal: TagArray
) -> None:
    """Cut tetrahedra given by their ten nodes along the shortest diagonal; of equal ones along the first.

    ``out`` ``(8 m, 4)`` takes the children, eight after eight, ``diagonal`` ``(m,)`` which of the three it was.
    """
    for i in range(first, last):
        chosen = 0
        least = _square(points, lattice[i, 4], lattice[i, 9])
        for d in range(1, 3):
            far = _square(points, lattice[i, 4 + d], lattice[i, 6 + d])
            if far < least:
                chosen, least = d, far
        diagonal[i] = chosen
        for c in range(8):
            for k in range(4):
                out[8 * i + c, k] = lattice[i, table[chosen, c, k]]


def cut_facets(rings: Mapping[str, IntArray]) -> dict[str, IntArray]:
    """Four facets for each, four after four, by facet type."""
    return {kind: nodes[:, FACET_CHILDREN[kind]].reshape(-1, FACET_CORNERS[kind]) for kind, nodes in rings.items()}


def _check_nodes(cells: Mapping[str, IntArray]) -> None:
    for name, block in cells.items():
        corner = np.sort(block[:, : ELEMENTS[name].corners], axis=1)
        twice = (corner[:, 1:] == corner[:, :-1]).any(axis=1)
        if twice.any():
            raise InputError(
                f"{name} {int(np.argmax(twice))} names a node twice, {block[np.argmax(twice)].tolist()}; collapsed "
                "elements cannot be refined, write them as elements of fewer corners"
            )


def _shared(
    own: Mapping[str, list[IntArray]], facets: Mapping[str, list[IntArray]], what: str
) -> tuple[IntArray, dict[str, IntArray], dict[str, IntArray]]:
    """Number sets of nodes that elements share, in lexicographic order.

    Returns the nodes of each, the numbers by element type ``(m, k)``, and those of the facets' by facet type.
    """
    blocks = [np.stack(parts, axis=1) for parts in own.values() if parts]
    rows = np.concatenate([block.reshape(-1, block.shape[2]) for block in blocks])
    size = len(rows)
    beside = [np.stack(parts, axis=1) for parts in facets.values() if parts]
    rows = np.concatenate([rows, *(block.reshape(-1, block.shape[2]) for block in beside)])
    number = set_numbers(rows)
    nodes = np.empty((int(number.max(initial=-1)) + 1, rows.shape[1]), dtype=np.int64)
    nodes[number] = rows
    present = np.zeros(len(nodes), dtype=np.bool_)
    present[number[:size]] = True
    if not present.all():
        corners = nodes[np.argmin(present)].tolist()
        raise InputError(f"a facet has {what} that no element has, of the points {corners}; facets must be faces")

    def parted(table: Mapping[str, list[IntArray]], start: int) -> dict[str, IntArray]:
        found = {}
        for name, parts in table.items():
            length = len(parts[0]) * len(parts) if parts else 0
            found[name] = (
                number[start : start + length].reshape(-1, len(parts)) if parts else np.empty((0, 0), np.int64)
            )
            start += length
        return found

    return nodes, parted(own, 0), parted(facets, size)


def _centres(
    points: FloatArray, cells: Mapping[str, IntArray], found: Mapping[str, IntArray], total: int
) -> FloatArray:
    """Centres of quadrilateral faces, each by the first element that has it."""
    out = np.empty((total, 3))
    for name, columns in reversed(list(found.items())):
        cut = cut_of(name)
        first = len(cut.lattice) - len(cut.quads) - (family(name) == "hexahedron")
        for face in reversed(range(columns.shape[1])):
            out[columns[:, face]] = _values(name, cut.lattice[first + face], points, cells[name])
    return out


def _values(name: str, at: FloatArray, points: FloatArray, block: IntArray) -> FloatArray:
    """Positions at one place of the reference element, ``(m, 3)``; the weights there are multiples of 1/64."""
    weight = np.round(shape_values(name, at) * 64.0) / 64.0
    return np.asarray(sum(w * points[block[:, k]] for k, w in enumerate(weight) if w != 0.0))
