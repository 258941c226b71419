"""A LabelObject with thick slices in, the same on isotropic voxels out, its shape interpolated between slices."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property
from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.errors import OptionError, ResourceError
from femprep.image.grid import Grid
from femprep.image.object import LabelObject, bounding_box
from femprep.image.solid import PADDING
from femprep.image.topology import label_pieces
from femprep.model import BoolArray, FloatArray

#: Voxels of a resampled object at most: some gigabytes of distances.
MOST_VOXELS: Final = 100_000_000


def isotropic(obj: LabelObject, spacing: float | None = None, *, along: bool = False) -> LabelObject:
    """Resample an object to isotropic voxels (the paper's section 2.6 needs them to erode it evenly).

    Each slice becomes a map of signed in-plane distances to the object's edge; these are interpolated linearly between
    slices and cut at zero, so that contours move steadily from one slice to the next instead of jumping half-way. The
    first and the last slice keep their half thickness outward.

    Parameters
    ----------
    obj : LabelObject
    spacing : float, optional
        New voxel size, mm; the smallest of the object's where not given.
    along : bool
        Move neighbouring outlines onto each other first, by the way between their middles: what shifts from slice to
        slice by its width, as a right ventricle that winds around the left one, stays whole. Done in any case where the
        object would fall into pieces.

    Returns
    -------
    LabelObject
        On a grid with the same directions; the object's own voxel centres are kept where the size does not change.
        ``report`` gains ``resampled_spacing`` and ``resampled_by`` (``"shape"``, or ``"nearest"`` where
        interpolated shapes would come apart either way).

    Raises
    ------
    OptionError
        The new voxel size is not positive.
    ResourceError
        There would be more than a hundred million voxels.

    References
    ----------
    Raya & Udupa 1990, Shape-based interpolation of multidimensional objects, doi 10.1109/42.52980.
    """
    size = float(obj.grid.spacing.min()) if spacing is None else float(spacing)
    if not np.isfinite(size) or size <= 0.0:
        raise OptionError(f"spacing is {spacing!r} mm, expected a positive number")
    axis = obj.stack_axis
    first, last = bounding_box(obj.mask)
    sides = [(last[a] - first[a] + 1) * float(obj.grid.spacing[a]) for a in range(3)]
    if (count := math.prod(side / size + 2.0 for side in sides)) > MOST_VOXELS:
        shown = " x ".join(f"{side:.3g}" for side in sides)
        raise ResourceError(
            f"object {obj.name!r} of {shown} mm would take {count:.2g} voxels of {size:.3g} mm, more than "
            f"{MOST_VOXELS:.0g}; check the voxel sizes of the file, or give them with --spacing"
        )
    centres = [_centres(first[a], last[a], float(obj.grid.spacing[a]), size) for a in range(3)]
    pieces = len(label_pieces(obj.mask)[1])
    for moved in dict.fromkeys((along, True)):
        mask, method = _by_shape(obj, axis, (first[axis], last[axis]), centres, moved), "shape"
        if len(label_pieces(mask)[1]) == pieces:
            break
    else:
        nearest = [np.clip(np.rint(c).astype(int), 0, n - 1) for c, n in zip(centres, obj.mask.shape)]
        mask, method = obj.mask[np.ix_(*nearest)], "nearest"
    low, high = bounding_box(mask)
    # Shapes may reach the border of the new grid less or more than the voxels did: cut to what is used, pad anew.
    mask = np.pad(mask[tuple(slice(a, b + 1) for a, b in zip(low, high))], PADDING)
    mask.setflags(write=False)
    step = np.array([c[1] - c[0] for c in centres])
    start = np.array([c[0] for c in centres]) + (np.array(low) - PADDING) * step
    grid = Grid(mask.shape, np.full(3, size), obj.grid.regular.to_world(start), obj.grid.direction)
    return LabelObject(mask, grid, obj.name, {**obj.report, "resampled_spacing": size, "resampled_by": method})


def _centres(first: int, last: int, old: float, new: float) -> FloatArray:
    """New voxel centres, as old indices, that cover the object with some room; centred on the object."""
    middle = 0.5 * (first + last)
    length = (last - first + 1) * old
    # An equal size keeps the old centres: an odd count has one in the middle, an even count none.
    count = int(np.ceil(length / new - 1e-9)) + 2
    return np.asarray(middle + (np.arange(count) - 0.5 * (count - 1)) * (new / old), dtype=np.float64)


def _by_shape(obj: LabelObject, axis: int, ends: tuple[int, int], centres: list[FloatArray], along: bool) -> BoolArray:
    """Interpolate signed distances, of outlines moved onto each other or not; holds two slices at a time."""
    flat = list(obj.grid.flat_axes)
    spacing = obj.grid.spacing[flat]
    slices: dict[int, _Distances] = {}

    def distances(k: int) -> _Distances:
        if k not in slices:
            plane = np.take(obj.mask, k, axis=axis)
            offset = (obj.grid.offset_at(k) / obj.grid.spacing)[flat]
            for old in [n for n in slices if n < k - 1]:
                del slices[old]
            slices[k] = _Distances(plane, spacing, offset, [centres[a] for a in flat])
        return slices[k]

    out = np.zeros([len(c) for c in centres], dtype=bool)
    stacked = np.moveaxis(out, axis, 0)
    for row, position in enumerate(centres[axis]):
        if not ends[0] - 0.5 - 1e-9 <= position <= ends[1] + 0.5 + 1e-9:
            continue
        inside = float(np.clip(position, *ends))
        below = min(int(np.floor(inside)), max(ends[1] - 1, ends[0]))
        weight = inside - below
        one = other = distances(below)
        if weight > 0.0:
            other = distances(below + 1)
        way = other.middle - one.middle if along else np.zeros(2)
        values = (1.0 - weight) * one.moved(weight * way) + weight * other.moved((weight - 1.0) * way)
        stacked[row] = values > 0.0
    return out


class _Distances:
    """Signed distances in a slice, moved by ``offset`` pixels, at new pixel centres; the middle of its outline."""

    def __init__(self, plane: BoolArray, spacing: FloatArray, offset: FloatArray, centres: list[FloatArray]) -> None:
        self.middle = offset + (np.argwhere(plane).mean(axis=0) if plane.any() else 0.5 * np.array(plane.shape))
        self._signed, self._offset, self._centres = slice_distance(plane, spacing), offset, centres

    def moved(self, way: FloatArray) -> FloatArray:
        """The slice moved by so many pixels along each of its axes."""
        return self._sampled(way) if way.any() else self._at_rest

    @cached_property
    def _at_rest(self) -> FloatArray:
        return self._sampled(np.zeros(2))

    def _sampled(self, way: FloatArray) -> FloatArray:
        signed = self._signed
        for axis, centres in enumerate(self._centres):
            signed = _linear(signed, centres - self._offset[axis] - way[axis], axis)
        return signed


def slice_distance(plane: BoolArray, spacing: Sequence[float] | FloatArray) -> FloatArray:
    """Distance of centres of a slice's pixels, or of voxels, from the edge (half-way between), mm, positive inside."""
    from scipy import ndimage

    within = np.asarray(ndimage.distance_transform_edt(plane, sampling=spacing))
    without = np.asarray(ndimage.distance_transform_edt(~plane, sampling=spacing))
    half = 0.5 * float(min(spacing))
    return np.where(plane, within - half, half - without)


def _linear(values: npt.NDArray[np.float64], positions: FloatArray, axis: int) -> npt.NDArray[np.float64]:
    """Linear interpolation along an axis, constant beyond its ends."""
    inside = np.clip(positions, 0, values.shape[axis] - 1)
    low = np.minimum(np.floor(inside).astype(int), values.shape[axis] - 2)
    weight = inside - low
    if not weight.any():
        return np.asarray(np.take(values, low, axis=axis))
    shape = [1, 1]
    shape[axis] = -1
    w = weight.reshape(shape)
    return np.asarray((1.0 - w) * np.take(values, low, axis=axis) + w * np.take(values, low + 1, axis=axis))
