"""A mask and its grid in; area and centroid of every slice of the stack out, and how areas grow along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from femprep.image.grid import Grid
from femprep.model import BoolArray, FloatArray, Immutable, IntArray, readonly
from femprep.model.products import inner, length, product


@dataclass(frozen=True, eq=False)
class SliceTable(Immutable):
    """One row for each slice in which the object occurs, in the order of the stack.

    Attributes
    ----------
    axis : int
        Grid axis across the slices.
    index : (n,) array
        Number of the slice along that axis, increasing.
    area : (n,) array
        Area of the object in the slice, mm2.
    voxels : (n,) array
        Its number of voxels.
    centroid : (n, 3) array
        Its centroid, mm LPS, in the mid-plane of the slice.
    spacing : float
        Distance of neighbouring slices, mm.
    normal : (3,) array
        Unit vector along the stack, towards growing slice numbers.
    """

    axis: int
    index: IntArray
    area: FloatArray
    voxels: IntArray
    centroid: FloatArray
    spacing: float
    normal: FloatArray

    def __post_init__(self) -> None:
        count = len(self.index)
        object.__setattr__(self, "index", readonly(self.index, np.int64, (None,), "slice index"))
        object.__setattr__(self, "area", readonly(self.area, np.float64, (count,), "slice area"))
        object.__setattr__(self, "voxels", readonly(self.voxels, np.int64, (count,), "slice voxels"))
        object.__setattr__(self, "centroid", readonly(self.centroid, np.float64, (count, 3), "slice centroid"))
        object.__setattr__(self, "normal", readonly(self.normal, np.float64, (3,), "slice normal"))

    def __len__(self) -> int:
        return len(self.index)

    @property
    def zigzag(self) -> FloatArray:
        """In-plane distance of each inner centroid from the middle of its two neighbours, mm, ``(n - 2,)``.

        Breath-hold shifts show here: a smooth heart has small values. Rows next to an empty slice count like others.
        """
        if len(self) < 3:
            return np.empty(0)
        bend = self.centroid[1:-1] - 0.5 * (self.centroid[:-2] + self.centroid[2:])
        in_plane = bend - product(bend, self.normal)[:, None] * self.normal
        return np.asarray(np.linalg.norm(in_plane, axis=1), dtype=np.float64)


def slice_table(mask: BoolArray, grid: Grid, axis: int | None = None) -> SliceTable:
    """Area and centroid of a mask in each slice.

    Parameters
    ----------
    mask : (ni, nj, nk) bool array
    grid : Grid
    axis : int, optional
        Axis across the slices; the grid's ``stack_axis`` where not given.

    Returns
    -------
    SliceTable
        Only slices that hold a voxel.
    """
    axis = grid.stack_axis if axis is None else axis
    first, second = (a for a in range(3) if a != axis)
    stack = np.moveaxis(mask, axis, 2)
    count = np.count_nonzero(stack, axis=(0, 1))
    index = np.flatnonzero(count)
    centre = np.zeros((len(index), 3))
    centre[:, axis] = index
    for row, k in enumerate(index):
        plane = stack[:, :, k]
        centre[row, first] = np.count_nonzero(plane, axis=1) @ np.arange(plane.shape[0]) / count[k]
        centre[row, second] = np.count_nonzero(plane, axis=0) @ np.arange(plane.shape[1]) / count[k]
    pixel = float(grid.spacing[first] * grid.spacing[second])
    normal = grid.direction[:, axis] / length(grid.direction[:, axis])
    return SliceTable(
        axis, index, count[index] * pixel, count[index], grid.to_world(centre), float(grid.spacing[axis]), normal
    )


def relative_slope(area: npt.ArrayLike) -> float:
    """Slope of an area over its slices, ``(n,)`` in the order of the stack, relative to its mean; 0 without any."""
    values = np.asarray(area, dtype=np.float64)
    if len(values) < 2 or not values.any():
        return 0.0
    k = np.arange(len(values)) - (len(values) - 1) / 2
    return inner(k, values) / inner(k, k) / float(values.mean())
