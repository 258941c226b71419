"""An element of the sweep in, the simplices it is judged by out: its tetrahedra, or the frames at its corners.

Every measure of a shape here is that of a simplex of four nodes of a prism, with weights for its six edges: a
tetrahedron against the regular one, or the frame of edges at a corner of a wedge or a hexahedron against the ideal
corner. One kernel serves them all.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from femprep.model import FloatArray, IntArray
from femprep.sweeping.cup.prism_split import EVEN, ODD, checkerboard, wedge_split


class Simplices(NamedTuple):
    """What the elements over the cells of a template are judged by.

    The inverse mean ratio of a simplex, cubed, is ``(sum of weight x squared edge)^3 / (27 scale^2 upright det^2)``,
    with the determinant of its edges from node 0; the weight of the edge (0, 3) also is multiplied by ``upright``.

    Attributes
    ----------
    nodes : (kinds, s, 4) array
        Nodes of the simplices in the prism over a cell: its inner corners first, then the outer ones.
    kinds : (T, 2) array
        Which row of ``nodes`` holds for a cell, in even and in odd layers.
    weights : (6,) array
        Weights of the edges.
    scale : float
    upright : (T,) array
        For frames one over the square of the ideal height over the side at each cell, for tetrahedra 1.
    """

    nodes: IntArray
    kinds: IntArray
    weights: FloatArray
    scale: float
    upright: FloatArray


def tetrahedra(cells: IntArray, count: int) -> Simplices:
    """The tetrahedra that prisms over triangles or quadrilaterals ``(T, 3 or 4)`` are split into."""
    if cells.shape[1] == 3:
        split = wedge_split(cells)
        nodes, kind = np.unique(split.reshape(len(split), -1), axis=0, return_inverse=True)
        kinds = np.repeat(kind.reshape(-1, 1), 2, axis=1)
        table = nodes.reshape(-1, 3, 4)
    else:
        _, odd = checkerboard(cells, count, 2)
        kinds, table = odd.reshape(2, -1).T, np.stack([EVEN, ODD])
    return Simplices(np.ascontiguousarray(table), np.ascontiguousarray(kinds), np.ones(6), 4.0, np.ones(len(cells)))


def corners(cells: IntArray, height: FloatArray) -> Simplices:
    """The frames at the corners of wedges or hexahedra, of ideal height over side ``(T,)`` each."""
    n = cells.shape[1]
    rows = []
    for i in range(n):
        after, before = (i + 1) % n, (i - 1) % n
        rows.append((i, after, before, i + n))
        rows.append((i + n, before + n, after + n, i))
    side, across, scale = (2.0 / 3.0, 2.0 / 3.0, 2.0 / np.sqrt(3.0)) if n == 3 else (1.0, 0.0, 1.0)
    weights = np.array([side, side, 1.0, across, 0.0, 0.0])
    kinds = np.zeros((len(cells), 2), dtype=np.int64)
    return Simplices(np.array([rows]), kinds, weights, float(scale), 1.0 / height**2)
