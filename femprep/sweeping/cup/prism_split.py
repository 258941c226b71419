"""Cells of a cup in, the way the prisms over them are split into tetrahedra out, alike on both sides of every face."""

from __future__ import annotations

import numpy as np

from femprep.errors import StageError
from femprep.model import IntArray

#: Tetrahedra of a wedge whose corners rise in number, by its nodes: no side is split in two ways, since every side is
#: split from the inner point of its smaller vertex to the outer point of the larger one.
_WEDGE = np.array([[0, 1, 2, 5], [0, 1, 5, 4], [0, 4, 5, 3]])
#: Tetrahedra of a hexahedron: one between four corners no two of which share an edge, one at each other corner.
EVEN = np.array([[0, 2, 7, 5], [0, 1, 2, 5], [0, 2, 3, 7], [0, 5, 7, 4], [2, 7, 5, 6]])
ODD = np.array([[1, 3, 4, 6], [1, 2, 3, 6], [0, 1, 3, 4], [1, 6, 4, 5], [3, 4, 6, 7]])


def wedge_split(cells: IntArray) -> IntArray:
    """Nodes ``(T, 3, 4)`` of the three tetrahedra of the wedge over each triangle, inner corners counted first."""
    order = np.argsort(cells, axis=1)
    odd = np.isin(order[:, 0] * 3 + order[:, 1], (1 * 3 + 0, 0 * 3 + 2, 2 * 3 + 1))
    nodes = np.concatenate([order, order + 3], axis=1)[:, _WEDGE]
    # An odd order is a mirror image.
    nodes[odd] = nodes[odd][..., [1, 0, 2, 3]]
    return np.asarray(nodes)


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
