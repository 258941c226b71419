"""Values in, percentiles out, without sorting more than the few values near each of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.mesh.compiled import compiled

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

#: Bins the values are counted in first: several times as many as there are percentiles, few enough to stay at hand.
_BINS: Final = 4096


def percentiles(values: FloatArray, shares: Sequence[float]) -> list[float]:
    """Percentiles of finite values ``(n,)``, n at least 1; between two values by straight lines, as numpy has them."""
    place = np.asarray(shares) / 100.0 * (len(values) - 1)
    below = np.floor(place).astype(np.int64)
    above = np.minimum(below + 1, len(values) - 1)
    places = np.unique([below, above])
    found = _at_places(values, places)
    low, high = found[np.searchsorted(places, below)], found[np.searchsorted(places, above)]
    return [float(value) for value in low + (place - below) * (high - low)]


def _at_places(values: FloatArray, places: IntArray) -> FloatArray:
    """The values at ascending places of the sorted values."""
    low, high = float(values.min()), float(values.max())
    width = high / _BINS - low / _BINS
    if width == 0.0:
        return np.asarray(np.sort(values)[places])
    # A bin holds all values between its ends, so that only bins with a place in them need be sorted.
    count = _counts(values, low, width)
    last = np.cumsum(count)
    bins = np.searchsorted(last, places, side="right")
    wanted = np.zeros(_BINS, dtype=np.bool_)
    wanted[bins] = True
    kept = np.sort(_values_in(values, low, width, wanted, int(count[wanted].sum())))
    before = np.cumsum(np.where(wanted, count, 0)) - count
    return np.asarray(kept[before[bins] + places - (last - count)[bins]])


@compiled(part=True)
def _bin(value: float, low: float, width: float) -> int:
    return int(min((value - low) / width, _BINS - 1.0))


@compiled()
def _counts(values: FloatArray, low: float, width: float) -> IntArray:
    """Number of values in each bin."""
    out = np.zeros(_BINS, dtype=np.int64)
    for value in values:
        out[_bin(value, low, width)] += 1
    return out


@compiled()
def _values_in(values: FloatArray, low: float, width: float, wanted: BoolArray, count: int) -> FloatArray:
    """The values in the wanted bins."""
    out, at = np.empty(count), 0
    for value in values:
        if wanted[_bin(value, low, width)]:
            out[at] = value
            at += 1
    return out
