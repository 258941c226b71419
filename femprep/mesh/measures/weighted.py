"""Values and their weights in, the value that a share of the weight does not exceed out."""

from __future__ import annotations

import numpy as np

from femprep.model import FloatArray


def weighted_percentile(values: FloatArray, weight: FloatArray, percent: float) -> float:
    """The least of the values ``(n,)`` that ``percent`` of their weight ``(n,)`` do not exceed."""
    order = np.argsort(values, kind="stable")
    share = np.cumsum(weight[order])
    return float(values[order][np.searchsorted(share, percent / 100.0 * share[-1])])
