"""A phantom and a grid in, a label map out: by voxel centres or by partial volume, with slice shifts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError, OptionError
from femprep.image import Grid
from femprep.model import BoolArray, FloatArray, IntArray
from femprep.phantoms.closest import fibonacci_sphere


class Painted(Protocol):
    """What painting needs of a region."""

    @property
    def label(self) -> int:
        """What its voxels get."""


class Body(Protocol):
    """What painting needs of a phantom: where it lies, its regions in their order, and where each of them is."""

    @property
    def rotation(self) -> FloatArray:
        """Columns are its axes in the world."""

    @property
    def origin(self) -> FloatArray:
        """Where its origin lies, mm LPS."""

    @property
    def regions(self) -> Mapping[str, Painted]:
        """Its closed surfaces, in the order in which they are painted."""

    def exact_surface(self, name: str, directions: npt.ArrayLike) -> FloatArray:
        """Points of a region's surface."""

    def inside(self, name: str, points: npt.ArrayLike) -> BoolArray:
        """Whether points lie in a region."""


def stack_grid(
    phantom: Body,
    spacing: npt.ArrayLike,
    *,
    direction: npt.ArrayLike | None = None,
    offset: npt.ArrayLike = (0.0, 0.0, 0.0),
    margin: tuple[int, int, int] = (4, 4, 1),
    base_first: bool = False,
) -> Grid:
    """A grid that holds a phantom with some room.

    Parameters
    ----------
    phantom : Phantom
    spacing : 3 floats
        Voxel size, mm.
    direction : (3, 3) array, optional
        Columns are the grid's axes in the world; the phantom's own axes where not given: a short-axis stack.
    offset : 3 floats
        Moves the grid along its axes, mm. At 0 the upper end of the phantom, its base, lies on the face between two
        slices, and the origin between four voxels of a slice.
    margin : tuple of 3 ints
        Empty voxels around the phantom.
    base_first : bool
        Whether slice 0 is the basal one (as in most of ACDC) or the apical one; without ``direction`` only.

    Returns
    -------
    Grid
    """
    size = np.asarray(spacing, dtype=np.float64)
    if size.shape != (3,) or not np.all(size > 0.0):
        raise OptionError(f"spacing is {spacing!r}, expected three positive numbers, mm")
    if direction is not None and base_first:
        raise OptionError("base_first turns the phantom's own axes; it does not go with a direction of your own")
    axes = phantom.rotation if direction is None else np.asarray(direction, dtype=np.float64)
    if base_first:
        axes = axes * np.array([1.0, -1.0, -1.0])
    directions = fibonacci_sphere(20000)
    points = np.concatenate([phantom.exact_surface(name, directions) for name in phantom.regions])
    local = (points - phantom.origin) @ axes
    low, high = local.min(axis=0), local.max(axis=0)
    # Voxel faces lie at these coordinates plus whole numbers of voxels.
    face = np.array([0.0, 0.0, low[2] if base_first else high[2]]) + np.asarray(offset, dtype=np.float64)
    first = np.floor((low - face) / size + 1e-9).astype(int) - np.asarray(margin)
    last = np.ceil((high - face) / size - 1e-9).astype(int) + np.asarray(margin)
    i, j, k = (int(n) for n in last - first)
    corner = face + (first + 0.5) * size
    return Grid((i, j, k), size, phantom.origin + axes @ corner, axes)


def rasterise(
    phantom: Body,
    grid: Grid,
    supersample: int = 1,
    slice_thickness: float | None = None,
    shifts: npt.ArrayLike | None = None,
    apex: str = "capped",
) -> npt.NDArray[np.uint8]:
    """Label map ``(ni, nj, nk)`` of a phantom; see :meth:`Phantom.segmentation`.

    Regions are painted in their order. With partial volume a voxel belongs to a region when more than half of its
    points do, so that nested surfaces (cavity within epicardium) each stand where half a voxel lies inside them.
    """
    if supersample < 1:
        raise OptionError(f"supersample is {supersample}, expected at least 1")
    if apex not in ("capped", "uncapped"):
        raise OptionError(f"apex is {apex!r}, expected 'capped' or 'uncapped'")
    axis = grid.stack_axis
    count = grid.shape[axis]
    moved = _shifts(shifts, count)
    flat = list(grid.flat_axes)
    labels = np.zeros(grid.shape, dtype=np.uint8)
    slices = np.moveaxis(labels, axis, 0)
    inner = _inner_points(grid, supersample, slice_thickness, axis)
    for name, region in phantom.regions.items():
        low, high = _index_box(phantom, name, grid)
        for k in range(max(low[axis], 0), min(high[axis], count - 1) + 1):
            shift = moved[k] / grid.spacing[flat]
            # Only pixels the region can reach, in a slice that is displaced by whole or broken pixels.
            first = np.maximum(low[flat] + np.floor(shift).astype(int), 0)
            last = np.minimum(high[flat] + np.ceil(shift).astype(int), np.array(slices[k].shape) - 1)
            if np.any(last < first):
                continue
            pixels = [np.arange(a, b + 1) for a, b in zip(first, last)]
            plane = np.stack(np.meshgrid(*pixels, indexing="ij"), axis=-1).reshape(-1, 2)
            index = np.empty((len(plane), 3))
            index[:, flat] = plane - shift
            index[:, axis] = k
            hits = np.zeros(len(plane), dtype=np.int32)
            for part in inner:
                hits += phantom.inside(name, grid.to_world(index + part))
            chosen = plane[2 * hits > len(inner)]
            slices[k][chosen[:, 0], chosen[:, 1]] = region.label
    if apex == "uncapped":
        _uncap(phantom, slices)
    return labels


def _index_box(phantom: Body, name: str, grid: Grid) -> tuple[IntArray, IntArray]:
    """First and last voxel a region can reach along each axis, with two voxels to spare; may lie beyond the grid."""
    index = grid.to_index(phantom.exact_surface(name, fibonacci_sphere(20000)))
    return np.floor(index.min(axis=0)).astype(np.int64) - 2, np.ceil(index.max(axis=0)).astype(np.int64) + 2


def _inner_points(grid: Grid, supersample: int, slice_thickness: float | None, axis: int) -> FloatArray:
    """Sample points within a voxel, in voxels from its centre, ``(supersample^3, 3)``."""
    step = (np.arange(supersample) + 0.5) / supersample - 0.5
    steps = [step, step, step]
    if slice_thickness is not None:
        if not slice_thickness > 0.0:
            raise OptionError(f"slice_thickness is {slice_thickness} mm, expected a positive number")
        steps[axis] = step * (slice_thickness / float(grid.spacing[axis]))
    return np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)


def _shifts(shifts: npt.ArrayLike | None, count: int) -> FloatArray:
    if shifts is None:
        return np.zeros((count, 2))
    moved = np.asarray(shifts, dtype=np.float64)
    if moved.shape != (count, 2):
        raise InputError(f"shifts have shape {moved.shape}, expected ({count}, 2): two lengths for each slice")
    return moved


def _uncap(phantom: Body, slices: npt.NDArray[np.uint8]) -> None:
    """Take the myocardium out of slices without cavity, in place."""
    cavity, wall = phantom.regions["lv"].label, phantom.regions["epi"].label
    for plane in slices:
        if not np.any(plane == cavity):
            plane[plane == wall] = 0
