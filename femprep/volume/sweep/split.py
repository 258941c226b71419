"""Cells of a cup in, elements of a layered mesh and their boundary facets out: connectivity alone.

Point ``i`` of layer ``l`` has number ``l * V + i``: layer by layer from the inner surface, template vertex first.
Elements are numbered layer by layer in the order of the cup's cells, tetrahedra in the order of the element they split.
Facets: inner surface, outer surface, base rim, apex rim, each in the order of its cells or edges, layer by layer.
"""

from __future__ import annotations

import numpy as np

from femprep.errors import StageError
from femprep.model import IntArray

#: Tetrahedra of a wedge whose corners rise in number, by its nodes: no side is split in two ways, since every side is
#: split from the inner point of its smaller vertex to the outer point of the larger one.
_WEDGE = np.array([[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]])
#: Tetrahedra of a hexahedron: one between four corners no two of which share an edge, one at each other corner.
_EVEN = np.array([[0, 2, 7, 5], [0, 1, 2, 5], [0, 2, 3, 7], [0, 5, 7, 4], [2, 7, 5, 6]])
_ODD = np.array([[1, 3, 4, 6], [1, 2, 3, 6], [0, 1, 3, 4], [1, 6, 4, 5], [3, 4, 6, 7]])


def prisms(cells: IntArray, count: int, layers: int) -> IntArray:
    """Wedges ``(layers T, 6)`` or hexahedra ``(layers T, 8)`` over cells ``(T, 3 or 4)`` of ``count`` vertices."""
    start = count * np.arange(layers)[:, None, None]
    return np.concatenate([cells + start, cells + start + count], axis=2).reshape(-1, 2 * cells.shape[1])


def wedge_tetrahedra(wedges: IntArray, cells: IntArray, layers: int) -> IntArray:
    """Three tetrahedra for each wedge, ``(3 w, 4)``, split alike on both sides of every face."""
    order = np.argsort(cells, axis=1)
    odd = np.isin(order[:, 0] * 3 + order[:, 1], (1 * 3 + 0, 0 * 3 + 2, 2 * 3 + 1))
    nodes = np.concatenate([order, order + 3], axis=1)[:, _WEDGE]
    # An odd order is a mirror image.
    nodes[odd] = nodes[odd][..., [1, 0, 2, 3]]
    every = np.tile(nodes.reshape(len(cells), -1), (layers, 1))
    return np.take_along_axis(wedges, every, axis=1).reshape(-1, 4)


def hexahedron_tetrahedra(hexahedra: IntArray, odd: IntArray) -> IntArray:
    """Five tetrahedra for each hexahedron, ``(5 h, 4)``; ``odd`` tells which of both ways each is split."""
    return hexahedra[np.arange(len(hexahedra))[:, None, None], np.where(odd[:, None, None] == 1, _ODD, _EVEN)].reshape(
        -1, 4
    )


def checkerboard(cells: IntArray, count: int, layers: int) -> tuple[IntArray, IntArray]:
    """Colours 0 and 1 of vertices so that ends of an edge differ, and for each hexahedron that of its first node.

    Raises
    ------
    StageError
        The quadrilaterals cannot be coloured so: a rim has an odd number of vertices.
    """
    colour = np.full(count, -1, dtype=np.int64)
    colour[cells[0, 0]] = 0
    # Each round colours all cells with a coloured corner; rounds are as many as rows.
    while np.any(colour < 0):
        known = colour[cells] >= 0
        first = np.argmax(known, axis=1)
        reached = known.any(axis=1)
        if not np.any(~known[reached]):
            raise StageError("the cells of the template do not hang together")
        parity = (colour[cells[np.arange(len(cells)), first]] + first) % 2
        for corner in range(4):
            colour[cells[reached, corner]] = (parity[reached] + corner) % 2
    if np.any(colour[cells] == colour[np.roll(cells, 1, axis=1)]):
        raise StageError("the quadrilaterals of the template have no checkerboard; an even number of columns has one")
    odd = (colour[cells[:, 0]][None, :] + np.arange(layers)[:, None]) % 2
    return colour, odd.ravel()


def sides(rim: IntArray, count: int, layers: int, inward: bool) -> IntArray:
    """Quadrilaterals ``(layers c, 4)`` over the closed rim ``(c,)``, outward; ``inward`` for the rim of a hole."""
    one, two = (np.roll(rim, -1), rim) if inward else (rim, np.roll(rim, -1))
    start = count * np.arange(layers)[:, None]
    return np.stack([one + start, two + start, two + start + count, one + start + count], axis=2).reshape(-1, 4)


def rising(quads: IntArray, count: int) -> IntArray:
    """Triangles of sides of wedges, split as the tetrahedra are: from inner smaller to outer larger vertex."""
    smaller = (quads[:, 0] % count < quads[:, 1] % count)[:, None]
    one = np.where(smaller, quads[:, [0, 1, 2]], quads[:, [0, 1, 3]])
    two = np.where(smaller, quads[:, [0, 2, 3]], quads[:, [1, 2, 3]])
    return np.stack([one, two], axis=1).reshape(-1, 3)


def checkered(quads: IntArray, colour: IntArray, count: int) -> IntArray:
    """Triangles of faces of hexahedra, split as the tetrahedra are: along the diagonal of even points."""
    odd = ((colour[quads[:, 0] % count] + quads[:, 0] // count) % 2 == 1)[:, None]
    one = np.where(odd, quads[:, [0, 1, 3]], quads[:, [0, 1, 2]])
    two = np.where(odd, quads[:, [1, 2, 3]], quads[:, [0, 2, 3]])
    return np.stack([one, two], axis=1).reshape(-1, 3)
