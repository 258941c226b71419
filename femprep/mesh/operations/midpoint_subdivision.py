"""A closed triangle mesh in, one with four times as many triangles out: each cut at the middles of its sides."""

from __future__ import annotations

import numpy as np

from femprep.mesh.patches import PatchSurface
from femprep.mesh.topology import edge_table, quarters
from femprep.model import FloatArray, IntArray


def midpoint_subdivision(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """Cut each triangle into four.

    Parameters
    ----------
    points : (n, 3) array
        Vertices, mm.
    triangles : (m, 3) array

    Returns
    -------
    straight : (n + e, 3) array
        The vertices, then the middles of the ``e`` sides as they are.
    curved : (n + e, 3) array
        The same, with the middles moved to the smooth surface through the vertices.
    triangles : (4 m, 3) array
    """
    table = edge_table(triangles)
    middle = points[table.nodes].mean(axis=1)
    curved = PatchSurface(points, triangles).project(middle, table.nodes[:, 0])[0]
    cells = quarters(table, triangles, len(points))
    return np.concatenate([points, middle]), np.concatenate([points, curved]), cells
