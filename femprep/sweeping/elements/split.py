"""Cells of a cup in, elements of a layered mesh and their boundary facets out: connectivity alone.

Point ``i`` of layer ``l`` has number ``l * V + i``: layer by layer from the inner surface, template vertex first.
Elements are numbered layer by layer in the order of the cup's cells, tetrahedra in the order of the element they split.
Facets: inner surface, outer surface, base rim, apex rim, each in the order of its cells or edges, layer by layer.
"""

from __future__ import annotations

import numpy as np

from femprep.model import IntArray
from femprep.sweeping.cup.prism_split import EVEN, ODD, wedge_split


def prisms(cells: IntArray, count: int, layers: int) -> IntArray:
    """Wedges ``(layers T, 6)`` or hexahedra ``(layers T, 8)`` over cells ``(T, 3 or 4)`` of ``count`` vertices."""
    start = count * np.arange(layers)[:, None, None]
    return np.concatenate([cells + start, cells + start + count], axis=2).reshape(-1, 2 * cells.shape[1])


def wedge_tetrahedra(wedges: IntArray, cells: IntArray, layers: int) -> IntArray:
    """Three tetrahedra for each wedge, ``(3 w, 4)``, split alike on both sides of every face."""
    every = np.tile(wedge_split(cells).reshape(len(cells), -1), (layers, 1))
    return np.take_along_axis(wedges, every, axis=1).reshape(-1, 4)


def hexahedron_tetrahedra(hexahedra: IntArray, odd: IntArray) -> IntArray:
    """Five tetrahedra for each hexahedron, ``(5 h, 4)``; ``odd`` tells which of both ways each is split."""
    return hexahedra[np.arange(len(hexahedra))[:, None, None], np.where(odd[:, None, None] == 1, ODD, EVEN)].reshape(
        -1, 4
    )


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
