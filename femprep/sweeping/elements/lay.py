"""Matched surfaces in, the nodes of the layers between them out: on straight lines, mended where those do not do."""

from __future__ import annotations

from typing import Any

from femprep.model import FloatArray
from femprep.options import SweepOptions
from femprep.sweeping.cup.layers import layer_depths
from femprep.sweeping.cup.matched import MatchedSurfaces
from femprep.sweeping.elements.mend import mend


def lay(matched: MatchedSurfaces, options: SweepOptions) -> tuple[FloatArray, FloatArray, dict[str, Any]]:
    """Nodes ``(layers + 1, V, 3)`` mm, their depths ``(layers + 1, V)``, 0 inside to 1 outside, and what was mended."""
    depth = layer_depths(options.layers or matched.layers, matched.growth, options.grading)
    points = matched.inner + depth[..., None] * (matched.outer - matched.inner)
    # The ends exactly, whatever rounding makes of them.
    points[-1] = matched.outer
    return points, depth, mend(points, matched, options.element)
