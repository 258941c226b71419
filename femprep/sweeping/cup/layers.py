"""A number of layers in, the depths of their boundaries out: shares of the way from the inner to the outer surface."""

from __future__ import annotations

import numpy as np

from femprep.model import FloatArray
from femprep.model.functions import exponential, logarithm
from femprep.model.functions import growth as growth_of


def layer_depths(layers: int, growth: FloatArray, grading: float | None) -> FloatArray:
    """Depths ``(layers + 1, V)`` from 0 to 1 at each vertex, heights growing as asked or with the elements' width.

    Parameters
    ----------
    layers : int
        Number of layers.
    growth : (V,) array
        Width of the elements on the outer surface over that on the inner one; in between it grows linearly, so that
        elements of one shape have depths ``(growth^(k / layers) - 1) / (growth - 1)``.
    grading : float or None
        Height of the last layer over the first, between which heights grow geometrically; None: as wide elements need.
    """
    if grading is not None:
        heights = exponential(np.arange(layers) / max(layers - 1, 1) * logarithm(grading))
        depth = np.concatenate([[0.0], np.cumsum(heights)]) / heights.sum()
        depth[-1] = 1.0
        return np.repeat(depth[:, None], len(growth), axis=1)
    share = np.arange(layers + 1)[:, None] / layers
    rate = logarithm(growth)
    even = np.abs(rate) < 1e-6
    safe = np.where(even, 1.0, rate)
    result = np.where(even, share, growth_of(share * safe) / growth_of(safe))
    result[-1] = 1.0
    return np.asarray(result)
