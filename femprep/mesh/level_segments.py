"""A surface and a value per vertex in, the segments in which it meets the level 0 out."""

from __future__ import annotations

import numpy as np

from femprep.mesh.topology import edge_table
from femprep.model import FloatArray, IntArray


def level_segments(points: FloatArray, triangles: IntArray, value: FloatArray) -> tuple[FloatArray, IntArray]:
    """Cut a surface where a value, linear in each triangle, is 0: by a plane, where it is the height over one.

    Parameters
    ----------
    points : (n, k) array
        Vertices.
    triangles : (m, 3) array
        Corner numbers.
    value : (n,) array
        0 counts as above, so that no triangle is cut at a corner.

    Returns
    -------
    crossings : (c, k) array
        Points where edges cross the level, in the order of the edges.
    segments : (s, 2) array
        Their numbers at both ends of what lies in each cut triangle, in the order of these; those of a surface that is
        consistently wound run on from each other.
    """
    above = value >= 0.0
    cut = triangles[above[triangles].sum(axis=1) % 3 != 0]
    table = edge_table(cut)
    crossed = above[table.nodes[:, 0]] != above[table.nodes[:, 1]]
    a, b = table.nodes[crossed].T
    share = value[a] / (value[a] - value[b])
    # Two sides of each cut triangle are crossed; the one that leads upwards comes first, which orients the segments.
    number = (np.cumsum(crossed) - 1)[table.of_cell]
    sides = crossed[table.of_cell]
    upward = sides & above[np.roll(cut, -1, axis=1)]
    downward = sides & above[cut]
    segments = np.stack([number[upward], number[downward]], axis=1)
    return points[a] + share[:, None] * (points[b] - points[a]), segments
