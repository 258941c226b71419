"""Slices of a mask in, where the surface passes between two of them, column by column, out."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.image.resample import slice_distance
from femprep.model import BoolArray, FloatArray, IntArray

#: Halvings of the interval in which a crossing lies.
_HALVINGS: Final = 20


def slice_distances(stack: BoolArray, spacing: tuple[float, float]) -> FloatArray:
    """Signed distance of pixel centres from the outline in their slice.

    Parameters
    ----------
    stack : (n, a, b) bool array
        Slices of the object.
    spacing : tuple of float
        Pixel size, mm.

    Returns
    -------
    (n, a, b) array
        mm, positive inside, NaN in slices without the object.
    """
    distance = np.full(stack.shape, np.nan)
    for number in np.flatnonzero(stack.any(axis=(1, 2))):
        distance[number] = slice_distance(stack[number], spacing)
    return distance


def crossings(distance: FloatArray, voxel: IntArray, side: IntArray) -> FloatArray:
    """Where the surface passes on the way from voxels inside to the slice next to them, in shares of that way.

    Shape-based interpolation [1]_: within its column the signed distance of the slices is interpolated by modified
    Akima [2]_, which does not swing over where the outline jumps, and its zero is taken. Slices beyond the object's
    ends tell nothing: there the last changes go on as they were.

    Parameters
    ----------
    distance : (n, a, b) array
        Of :func:`slice_distances`.
    voxel : (3, q) array
        Slice and pixel of each voxel inside.
    side : (q,) array
        1 or -1: to the next slice or to the one before.

    Returns
    -------
    (q,) array
        0 in the voxel's own slice, 1 in the one next to it; one half where that one is empty.

    References
    ----------
    .. [1] Raya & Udupa, Shape-based interpolation of multidimensional objects, IEEE Trans. Med. Imaging 9(1), 1990.
       doi:10.1109/42.52980
    .. [2] Akima, A new method of interpolation and smooth curve fitting based on local procedures, J. ACM 17(4), 1970.
       doi:10.1145/321607.321609
    """
    column = np.full((6, voxel.shape[1]), np.nan)
    for row, step in enumerate(range(-2, 4)):
        number = voxel[0] + step * side
        known = (number >= 0) & (number < len(distance))
        column[row, known] = distance[number[known], voxel[1][known], voxel[2][known]]
    share = np.full(voxel.shape[1], 0.5)
    between = np.isfinite(column[3])
    share[between] = _zeros(column[:, between])
    return share


def _zeros(column: FloatArray) -> FloatArray:
    """Zeros ``(q,)``, 0 to 1, between the third and the fourth of six values ``(6, q)`` of opposite sign."""
    first, second, change = column[2], column[3], _continued(np.diff(column, axis=0))
    begin, end = _slope(*change[:4]), _slope(*change[1:])
    low, high = np.zeros(column.shape[1]), np.ones(column.shape[1])
    for _ in range(_HALVINGS):
        t = 0.5 * (low + high)
        back = 1.0 - t
        # Hermite's cubic through both values with both slopes.
        value = (1.0 + 2.0 * t) * back * back * first + t * back * back * begin
        value += t * t * (3.0 - 2.0 * t) * second - t * t * back * end
        low, high = np.where(value > 0.0, t, low), np.where(value > 0.0, high, t)
    return 0.5 * (low + high)


def _continued(change: FloatArray) -> FloatArray:
    """Changes ``(5, q)`` from value to value, those missing (NaN) on either side continued linearly, as Akima does."""
    change = change.copy()
    for near, here, missing in ((3, 2, 1), (1, 2, 3)):
        slope = np.where(np.isnan(change[near]), 0.0, change[here] - change[near])
        change[missing] = np.where(np.isnan(change[missing]), change[here] + slope, change[missing])
    for near, here, missing in ((2, 1, 0), (2, 3, 4)):
        change[missing] = np.where(np.isnan(change[missing]), 2.0 * change[here] - change[near], change[missing])
    return change


def _slope(before: FloatArray, left: FloatArray, right: FloatArray, after: FloatArray) -> FloatArray:
    """Slope of modified Akima between two changes, from the two on either side."""
    one = np.abs(after - right) + 0.5 * np.abs(after + right)
    other = np.abs(left - before) + 0.5 * np.abs(left + before)
    total = one + other
    mean = 0.5 * (left + right)
    return np.asarray(np.where(total > 1e-9, (one * left + other * right) / np.maximum(total, 1e-9), mean))
