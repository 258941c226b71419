"""Labels or intensities of an image and the wall they lie in, in; maps of each slice that go on beyond the wall, out.

A pixel outside the wall tells nothing of it: it gets what the nearest pixel of the wall in its slice has. So blood
beside a scar does not wear it off, and fat outside an epicardium does not reach in.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt
from scipy import ndimage

from femprep.anatomy.tissue.wall_slices import Feet
from femprep.image.grid import Grid
from femprep.image.resample import slice_distance
from femprep.mesh.operations.element_tets import mesh_tets
from femprep.mesh.search.locate import Locator
from femprep.model import BoolArray, FloatArray, IntArray, VolumeMesh, is_blood
from femprep.model.blocks import chosen_rows

#: Farther than any pixel is from another, mm.
_FAR: Final = 1e3


def wall_locator(mesh: VolumeMesh) -> Locator:
    """Finds points in the wall of a mesh, by their places."""
    return Locator(mesh_tets(chosen_rows(mesh.cells, ~is_blood(mesh.region)))[0], mesh.points)


def voxels_in(locator: Locator, grid: Grid) -> BoolArray:
    """Voxels whose centres lie in a mesh, on the whole grid."""
    inside = np.zeros(grid.shape, dtype=bool)
    index = grid.to_index(locator.places[np.unique(locator.tets)])
    low = np.clip(np.floor(index.min(axis=0)).astype(int), 0, np.array(grid.shape) - 1)
    high = np.clip(np.ceil(index.max(axis=0)).astype(int), 0, np.array(grid.shape) - 1)
    ranges = [np.arange(a, b + 1) for a, b in zip(low, high)]
    block = np.stack(np.meshgrid(*ranges, indexing="ij"), axis=-1)
    found = locator(grid.to_world(block.reshape(-1, 3).astype(float)))
    inside[np.ix_(*ranges)] = (found.distance == 0.0).reshape(block.shape[:3])
    return inside


class SliceMaps:
    """Values of an image slice by slice, beyond the wall those of the nearest pixel in it.

    Parameters
    ----------
    values : (ni, nj, nk) array
    known : (ni, nj, nk) bool array
        Voxels that tell something of the wall.
    grid : Grid
    """

    def __init__(self, values: npt.NDArray[np.generic], known: BoolArray, grid: Grid) -> None:
        self.axis = grid.stack_axis
        self.plane = [a for a in range(3) if a != self.axis]
        self.spacing = grid.spacing[self.plane]
        self.step = float(grid.spacing[self.axis])
        self.values: list[npt.NDArray[np.generic]] = []
        for k in range(grid.shape[self.axis]):
            own, mask = np.take(values, k, axis=self.axis), np.take(known, k, axis=self.axis)
            if mask.any() and not mask.all():
                nearest = ndimage.distance_transform_edt(
                    ~mask, sampling=self.spacing, return_distances=False, return_indices=True
                )
                own = own[tuple(nearest)]
            self.values.append(own)
        # A slice that grazes the wall may hold no pixel of it: then it tells what the nearest one does that holds some.
        some = np.flatnonzero(known.any(axis=tuple(self.plane)))
        self.values = [self.values[int(some[np.abs(some - k).argmin()])] for k in range(len(self.values))]

    def nearest(self, feet: Feet) -> npt.NDArray[np.generic]:
        """Values of the nearest pixel in the nearer slice, ``(q,)``."""
        row, end = np.arange(len(feet.upper)), feet.nearer
        index = np.rint(feet.index[row, end]).astype(int)
        slices = feet.slices[row, end]
        out = np.empty(len(row), dtype=self.values[0].dtype)
        for k in np.unique(slices):
            rows = np.flatnonzero(slices == k)
            own = self.values[k]
            at = np.clip(index[rows], 0, np.array(own.shape) - 1)
            out[rows] = own[at[:, 0], at[:, 1]]
        return out

    def between(self, feet: Feet) -> FloatArray:
        """Values in between pixels and slices, linear, ``(q,)``."""
        low, high = self._both(self.values, feet)
        return (1.0 - feet.upper) * low + feet.upper * high

    def scores(self, feet: Feet, labels: Sequence[int]) -> FloatArray:
        """How far inside each label points lie, mm, negative outside, ``(q, labels)``; 0 is the edge.

        In a slice it is the distance from the label's outline. Between slices it is linear, so that an outline moves
        evenly from one to the next; where a label ends, its outline in the other slice more than half a slice distance
        away, it ends half-way.
        """
        out = np.empty((len(feet.upper), len(labels)))
        for column, label in enumerate(labels):
            distances = [self._distance(np.asarray(own == label)) for own in self.values]
            low, high = self._both(distances, feet)
            out[:, column] = _mixed(low, high, feet.upper, self.step)
        return out

    def _distance(self, plane: BoolArray) -> FloatArray:
        if not plane.any() or plane.all():
            return np.full(plane.shape, _FAR if plane.all() else -_FAR)
        return slice_distance(plane, self.spacing)

    def _both(self, planes: Sequence[npt.NDArray[np.generic]], feet: Feet) -> tuple[FloatArray, FloatArray]:
        """Values, linear between pixels, at the feet in the lower and in the upper slice."""
        out = np.empty((2, len(feet.upper)))
        for end in range(2):
            slices: IntArray = feet.slices[:, end]
            order = np.argsort(slices, kind="stable")
            numbers, starts = np.unique(slices[order], return_index=True)
            for k, rows in zip(numbers, np.split(order, starts[1:])):
                own = np.asarray(planes[k], dtype=np.float64)
                out[end, rows] = ndimage.map_coordinates(own, feet.index[rows, end].T, order=1, mode="nearest")
        return out[0], out[1]


def _mixed(low: FloatArray, high: FloatArray, upper: FloatArray, reach: float) -> FloatArray:
    """Signed distances between two slices."""
    inside, outside = np.maximum(low, high), np.minimum(low, high)
    far = -outside
    ends = np.clip(2.0 * far / reach - 1.0, 0.0, 1.0)
    ends = ends * ends * (3.0 - 2.0 * ends)
    mirrored = -((1.0 - ends) * far + ends * inside)
    outside = np.where((inside > 0.0) & (outside < 0.0), mirrored, outside)
    first = low >= high
    return (1.0 - upper) * np.where(first, inside, outside) + upper * np.where(first, outside, inside)
