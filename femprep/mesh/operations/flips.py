"""Triangles on a smooth surface in, the same vertices joined by better ones out: edges flipped while that helps."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.mesh.energies.distortion import Ideal
from femprep.mesh.topology import edge_table
from femprep.model import FloatArray, IntArray

#: Passes at most; each flips edges that share no triangle.
_PASSES: Final = 50
#: Fewest edges at a vertex.
_DEGREE: Final = 4
#: Fall of the measure that makes a flip worth it: no flips to and fro by rounding.
_WORTH: Final = 1e-6


def flip_edges(
    points: FloatArray, normals: FloatArray, cells: IntArray, area: FloatArray, size: float
) -> tuple[IntArray, int]:
    """Flip edges of a closed surface while the distortion of the two triangles beside them falls.

    Parameters
    ----------
    points, normals : (V, 3) arrays
        Vertices and the smooth surface's unit normals.
    cells : (T, 3) array
        Triangles. None is folded by a flip; one that is, is unfolded if a flip can.
    area : (V,) array
        Area asked of triangles at each vertex.
    size : float
        What the area counts beside the shape.

    Returns
    -------
    cells : (T, 3) array
    flips : int
    """
    cells = cells.copy()
    count = len(points)
    total = 0
    for _ in range(_PASSES):
        table = edge_table(cells)
        one, two = table.cells.T
        # The corner of each cell that faces the edge, and the edge's ends in the order of the first cell.
        side_one = np.argmax(table.of_cell[one] == np.arange(len(one))[:, None], axis=1)
        side_two = np.argmax(table.of_cell[two] == np.arange(len(two))[:, None], axis=1)
        a, b = cells[one, side_one], cells[one, (side_one + 1) % 3]
        c, d = cells[one, (side_one + 2) % 3], cells[two, (side_two + 2) % 3]
        degree = np.bincount(table.nodes.ravel(), minlength=count)
        present = table.nodes[:, 0] * count + table.nodes[:, 1]
        free = ~np.isin(np.minimum(c, d) * count + np.maximum(c, d), present)
        free &= (degree[a] > _DEGREE) & (degree[b] > _DEGREE)
        now = _measure(points, normals, cells, area, size)
        edges = np.flatnonzero(free)
        if not len(edges):
            break
        first, second = np.stack([a, d, c], axis=1)[edges], np.stack([d, b, c], axis=1)[edges]
        then = _measure(points, normals, first, area, size) + _measure(points, normals, second, area, size)
        before = (now[one] + now[two])[edges]
        better = np.isfinite(then) & (then < before - _WORTH * np.minimum(before, 1e9))
        gain = np.where(np.isfinite(before), before, 1e30) - then
        edges, first, second, gain = edges[better], first[better], second[better], gain[better]
        used = np.zeros(count, dtype=bool)
        flipped = 0
        for k in np.argsort(-gain, kind="stable"):
            e = edges[k]
            corners = (a[e], b[e], c[e], d[e])
            if used[list(corners)].any():
                continue
            used[list(corners)] = True
            cells[one[e]], cells[two[e]] = first[k], second[k]
            flipped += 1
        total += flipped
        if not flipped:
            break
    return cells, total


def _measure(points: FloatArray, normals: FloatArray, cells: IntArray, area: FloatArray, size: float) -> FloatArray:
    return Ideal.even(cells, area[cells].mean(axis=1)).each(points, normals, size)
