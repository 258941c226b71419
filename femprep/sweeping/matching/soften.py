"""Surfaces in, the same softened near given places out: where a wall bends too sharply to be filled by layers."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np

from femprep.mesh.patches import PatchSurface
from femprep.mesh.topology import adjacency
from femprep.model import FloatArray, Plane

#: Passes, each of which moves a vertex by this share of the way to the middle of its neighbours.
_PASSES: Final = 3
_STEP: Final = 0.5


def soften(surface: PatchSurface, places: FloatArray, reach: float, planes: Iterable[Plane]) -> PatchSurface:
    """Smooth a surface near given places: fully within a distance of them, less and less up to twice that.

    Parameters
    ----------
    surface : PatchSurface
    places : (p, 3) array
        Points on it, mm.
    reach : float
        The distance, mm.
    planes : iterable of Plane
        Where the wall ends. What lies beyond by more than ``reach`` stays: the cap in which a closed surface ends would
        shrink into the wall.

    Returns
    -------
    PatchSurface
        With the same triangles.
    """
    from scipy.spatial import cKDTree

    points, cells = np.array(surface.points), surface.triangles
    share = np.clip(2.0 - cKDTree(places).query(points)[0] / reach, 0.0, 1.0)
    for plane in planes:
        share *= np.clip(1.0 - plane.signed_distance(points) / reach, 0.0, 1.0)
    around = adjacency(cells, len(points))
    degree = around.sum(axis=1)[:, None]
    for _ in range(_PASSES):
        points += _STEP * share[:, None] * (np.asarray(around @ points) / degree - points)
    return PatchSurface(points, cells)
