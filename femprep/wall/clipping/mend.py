"""A clipped surface with folds in, a fair one out: vertices around folded or needle-like triangles smoothed in space.

A surface fitted to labels that end in a sliver of a cavity can fold over itself there. Sliding vertices along such a
surface cannot help: it has to leave the fit, by as little as it takes.
"""

from __future__ import annotations

import logging
from typing import Any

import numpy as np

from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import edge_table, fold_angles, neighbour_mean
from femprep.model import BoolArray, Notice, noted
from femprep.wall.clipping.clipped_surface import ClippedSurface
from femprep.wall.clipping.improve import improve
from femprep.wall.clipping.sampled import SampledMap

logger = logging.getLogger(__name__)

#: What is mended: triangles below this Q, edges folded by more than this angle (degrees), and crossing triangles. Edges
#: of up to 150 degrees are a right ventricle's own: of twelve of the ACDC maps four have some of more than 110.
_POOR, _FOLDED = 0.25, 150.0
#: Rings of vertices around what is mended that are smoothed with it, round by round: as few as it takes.
_RINGS = (0, 0, 1, 1, 2, 2, 2, 2)
#: Sweeps of smoothing in a round.
_SWEEPS = 4


def mend(clipped: ClippedSurface) -> dict[str, Any] | None:
    """Smooth a clipped surface where it is folded, crosses itself or has needles.

    Each round moves the vertices of the offending triangles, later rings around them too, to the mean of their
    neighbours (Laplacian smoothing; rim vertices stay), until nothing offends.

    Parameters
    ----------
    clipped : ClippedSurface
        Changed in place, with its smooth map.

    Returns
    -------
    dict or None
        What was done, JSON-ready; None where there was nothing to mend.
    """
    bad = _offending(clipped)
    if not bad.any():
        return None
    start, before = clipped.points.copy(), clipped.triangles.copy()
    place = clipped.points[clipped.triangles[bad]].mean(axis=(0, 1))
    for rings in _RINGS:
        active = np.zeros(len(clipped.points), dtype=bool)
        active[clipped.triangles[bad]] = True
        for _ in range(rings):
            active[clipped.triangles[active[clipped.triangles].any(axis=1)]] = True
        active &= clipped.on_plane < 0
        _smooth(clipped, active)
        clipped.smooth = SampledMap(clipped.directions, clipped.points)
        improve(clipped, sweeps=2)
        bad = _offending(clipped)
        if not bad.any():
            break
    # Sliding along the surface is no departure from it: only the distance from the surface as it was counts.
    moved = ClosestFinder(start, before)(clipped.points).distance
    info = {
        "surface": clipped.name,
        "mended_near_mm": [round(float(x), 3) for x in place],
        "vertices_off_the_fit": int((moved > 0.05).sum()),
        "farthest_off_the_fit_mm": float(moved.max()),
    }
    logger.warning(
        "surface %r was folded near %s: smoothed, by up to %.1f mm", clipped.name, info["mended_near_mm"], moved.max()
    )
    words = f"surface {clipped.name} was folded, or had needles: it was smoothed by up to {{amount}} near {{place}}"
    return noted(info, Notice.of("repaired", words, amount=float(moved.max()), unit="mm", place=place))


def _offending(clipped: ClippedSurface) -> BoolArray:
    """Triangles that are needles, folded onto a neighbour, or crossing another."""
    bad = triangle_quality(clipped.points, clipped.triangles) < _POOR
    pairs, angle = fold_angles(clipped.points, clipped.triangles)
    bad[pairs[angle > _FOLDED]] = True
    bad[self_intersections(clipped.points, clipped.triangles)] = True
    return bad


def _smooth(clipped: ClippedSurface, active: BoolArray) -> None:
    """Sweeps that move active vertices half-way to the mean of their neighbours."""
    edges = edge_table(clipped.triangles).nodes
    for _ in range(_SWEEPS):
        clipped.points[active] += 0.5 * (neighbour_mean(clipped.points, edges) - clipped.points)[active]
