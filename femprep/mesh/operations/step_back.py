"""Old and new vertices of a mesh in, vertices on the way between them at which no triangles cross out."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.mesh.search.intersection import self_intersections
from femprep.model import FloatArray, IntArray

#: Tries, each by this share of the one before around what crosses, then by nothing there, and rings of vertices that
#: are held back with it.
_TRIES: Final = 6
_TRIES_HELD: Final = 14
_SHORTER: Final = 0.3
_RINGS: Final = 3


def step_uncrossed(old: FloatArray, new: FloatArray, triangles: IntArray) -> FloatArray:
    """Go from old to new vertices ``(n, 3)`` as far as no triangles ``(m, 3)`` cross, those around a crossing less far.

    Where none do at the old vertices, none do at those that come out.
    """
    share = np.ones(len(old))
    unsure = np.ones(len(triangles), dtype=bool)
    for shorter in _TRIES * (_SHORTER,) + _TRIES_HELD * (0.0,):
        points = old + share[:, None] * (new - old)
        crossing = np.unique(self_intersections(points, triangles, unsure))
        if not len(crossing):
            return np.asarray(points)
        before = share.copy()
        share[triangles[crossing]] *= shorter
        hold_back(share, triangles, 1.0 / (_RINGS + 1))
        unsure = (share != before)[triangles].any(axis=1)
        unsure[crossing] = True
    return old


def hold_back(share: FloatArray, triangles: IntArray, rise: float) -> None:
    """Let shares of vertices rise by no more than ``rise`` from ring to ring, over three rings, in place."""
    for _ in range(_RINGS):
        least = np.minimum(share[triangles].min(axis=1) + rise, 1.0)
        np.minimum.at(share, triangles, np.broadcast_to(least[:, None], triangles.shape))
