"""Matched surfaces in, the nodes of the layers between them out: on straight lines, mended where those do not do."""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.model import FloatArray
from femprep.options import SweepOptions
from femprep.sweeping.cup.layers import graded, layer_depths
from femprep.sweeping.cup.matched import MatchedSurfaces
from femprep.sweeping.elements.mend import mend


def lay(matched: MatchedSurfaces, options: SweepOptions) -> tuple[FloatArray, FloatArray, dict[str, Any]]:
    """Nodes ``(layers + 1, V, 3)`` mm, their depths ``(layers + 1, V)``, 0 inside to 1 outside, and what was mended."""
    layers = options.layers or matched.layers
    depth = _depths(layers, matched, options.grading)
    points = matched.inner + depth[..., None] * (matched.outer - matched.inner)
    # The ends exactly, whatever rounding makes of them.
    points[-1] = matched.outer
    return points, depth, mend(points, matched, options.element)


def _depths(layers: int, matched: MatchedSurfaces, grading: float | None) -> FloatArray:
    """By the width of elements where not graded."""
    if grading is None:
        return layer_depths(layers, matched.growth)
    return np.repeat(graded(layers, grading)[:, None], len(matched.cup.disk), axis=1)
