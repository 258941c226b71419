"""A smooth surface and a cup's vertices on it in, what the cells between them cut off out: pulls on the vertices.

Vertices that lie on a surface do not make a mesh that follows it: cells may bridge a narrow end or a bulge, and then
every vertex slides out of it, since the elements are better so.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from femprep.mesh.level_segments import level_segments
from femprep.mesh.patches import PatchSurface
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FloatArray, IntArray, split_quads
from femprep.model.products import product

#: A cell may pass a point of the surface by this share of an edge.
SLACK: Final = 0.3
#: What a point counts that is passed by one edge more, beside a simplex's cubed inverse mean ratio; where squares of
#: those count, the larger one.
STRENGTH: Final = (500.0, 5000.0)

#: Row starts by vertex, numbers of the points that pull it; of each point its triangle's corners, their shares, where
#: it lies; slack and strength.
Pulls = tuple[IntArray, IntArray, IntArray, FloatArray, FloatArray, float, float]


class FollowedPoints:
    """Points of a smooth surface between its planes, vertices and rims, that a mesh of it must not pass by.

    Parameters
    ----------
    surface : PatchSurface
    planes : (p, 4) array
        Normal and offset of each plane.
    """

    def __init__(self, surface: PatchSurface, planes: FloatArray) -> None:
        heights = [product(surface.points, plane[:3]) - plane[3] for plane in planes]
        inside = np.all([height < 0.0 for height in heights], axis=0)
        rims = [level_segments(surface.points, surface.triangles, height)[0] for height in heights]
        self.points = np.concatenate([surface.points[inside], *rims])

    def missed(self, places: FloatArray, cells: IntArray, edge: float) -> tuple[IntArray, FloatArray, FloatArray]:
        """Triangles ``(s, 3)``, shares of their corners ``(s, 3)`` and points ``(s, 3)`` passed by half the slack.

        Parameters
        ----------
        places : (V, 3) array
            Vertices.
        cells : (T, 3) or (T, 4) array
        edge : float
            Their edge length, mm.
        """
        triangles = split_quads(cells)
        found = ClosestFinder(places, triangles)(self.points)
        off = found.distance > 0.5 * SLACK * edge
        return triangles[found.triangle[off]], found.weights[off], self.points[off]


def pulls(missed: Any, count: int, edge: float, steep: bool) -> Pulls:
    """What the kernels take, for ``count`` vertices; arguments as of :meth:`FollowedPoints.missed`."""
    corners, shares, points = missed
    order = np.argsort(corners.ravel(), kind="stable")
    starts = np.searchsorted(corners.ravel()[order], np.arange(count + 1)).astype(np.int64)
    strength = STRENGTH[int(steep)] / (edge * edge)
    return starts, (order // 3).astype(np.int64), np.ascontiguousarray(corners), shares, points, SLACK * edge, strength
