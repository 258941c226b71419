"""A number of layers in, the depths of their boundaries out: shares of the way from the inner to the outer surface."""

from __future__ import annotations

import numpy as np

from femprep.model import FloatArray
from femprep.model.functions import exponential, logarithm
from femprep.model.functions import growth as growth_of


def graded(layers: int, grading: float) -> FloatArray:
    """Depths ``(layers + 1,)`` from 0 to 1 of layers whose heights grow geometrically, the last ``grading`` times the
    first."""
    heights = exponential(np.arange(layers) / max(layers - 1, 1) * logarithm(grading))
    result = np.concatenate([[0.0], np.cumsum(heights)]) / heights.sum()
    result[-1] = 1.0
    return np.asarray(result)


def layer_depths(layers: int, growth: FloatArray) -> FloatArray:
    """Depths ``(layers + 1, V)`` from 0 to 1 at each vertex, heights growing with the width of the elements.

    Parameters
    ----------
    layers : int
        Number of layers.
    growth : (V,) array
        Width of the elements on the outer surface over that on the inner one; in between it grows linearly, so that
        elements of one shape have depths ``(growth^(k / layers) - 1) / (growth - 1)``.
    """
    share = np.arange(layers + 1)[:, None] / layers
    rate = logarithm(growth)
    even = np.abs(rate) < 1e-6
    safe = np.where(even, 1.0, rate)
    result = np.where(even, share, growth_of(share * safe) / growth_of(safe))
    result[-1] = 1.0
    return np.asarray(result)
