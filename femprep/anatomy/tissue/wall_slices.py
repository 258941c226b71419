"""A mesh with ventricular coordinates and the grid of an image in; where the image's slices meet its wall, out.

A point between two slices is not compared with the voxels right above and below it, which in a wall that slants or
bends may be blood or another wall: its feet are the points of either slice at the same depth and angle of the wall, so
that what lies between slices is interpolated along the wall. A slice that holds no wall at that depth and angle tells
nothing there, and the other one is taken alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.anatomy.wall_parts import WallPart, slice_chart
from femprep.image.grid import Grid
from femprep.mesh.search.locate import Locator
from femprep.model import BoolArray, FloatArray, IntArray

#: A slice has wall at a depth and an angle where it is met within this many pixels.
_MET: Final = 1.0
#: Slices are cut ragged at the ends of a wall: nothing is known farther than this many slices beyond the image.
_BEYOND: Final = 1.0


@dataclass(frozen=True, eq=False)
class Feet:
    """The two slices next to points of a wall, and the feet of the points in them.

    Attributes
    ----------
    slices : (q, 2) array
        Numbers of the slices below and above, equal where one alone counts.
    index : (q, 2, 2) array
        The foot in each: pixel coordinates along the two axes of a slice.
    upper : (q,) array
        Share of the upper one, 0 to 1.
    position : (q,) array
        Fractional number of the slice the point lies at.
    known : (q,) array
        Whether the point lies within reach of a slice.
    """

    slices: IntArray
    index: FloatArray
    upper: FloatArray
    position: FloatArray
    known: BoolArray

    @property
    def nearer(self) -> IntArray:
        """0 where the lower of the two slices is the nearer one, 1 where the upper is."""
        return (self.upper > 0.5).astype(np.int64)


class WallSlices:
    """A part of a wall in the slices of an image.

    Parameters
    ----------
    part : WallPart
    grid : Grid
        Of the image, anyhow placed and turned.
    """

    def __init__(self, part: WallPart, grid: Grid) -> None:
        self.part, self.grid = part, grid
        self.axis = grid.stack_axis
        self.plane = [a for a in range(3) if a != self.axis]
        step = float(grid.spacing[self.axis])
        index = grid.to_index(part.mesh.points)
        self.position = index[:, self.axis]
        tets = part.tets[0]
        self.first, self.count = _needed(tets, self.position, grid.shape[self.axis])
        chart = slice_chart(part, self.position * step, part.sizes)
        nodes = np.repeat(np.arange(len(self.first)), self.count)
        slot = np.arange(len(nodes)) - np.repeat(np.cumsum(self.count) - self.count, self.count)
        wanted = chart[nodes].copy()
        number = self.first[nodes] + slot
        wanted[:, 2] = number * step
        found = Locator(tets, chart)(wanted)
        shape = (len(self.first), int(self.count.max(initial=1)))
        self._foot = np.zeros((*shape, 2))
        self._met = np.zeros(shape)
        self._foot[nodes, slot] = found.at(index)[:, self.plane]
        pixel = float(grid.spacing[self.plane].max())
        self._met[nodes, slot] = found.distance <= _MET * pixel

    def feet(self, nodes: IntArray, weights: FloatArray) -> Feet:
        """Feet of points, given by nodes ``(q, 4)`` of a tetrahedron of the part and their weights."""
        last = self.grid.shape[self.axis] - 1
        position = np.einsum("qi,qi->q", weights, self.position[nodes])
        below = np.clip(np.floor(position).astype(np.int64), 0, last)
        slices = np.stack([below, np.minimum(below + 1, last)], axis=1)
        index, met = np.empty((len(nodes), 2, 2)), np.empty((len(nodes), 2))
        for end in range(2):
            slot = np.clip(slices[:, end, None] - self.first[nodes], 0, self._foot.shape[1] - 1)
            index[:, end] = np.einsum("qi,qik->qk", weights, self._foot[nodes, slot])
            met[:, end] = np.einsum("qi,qi->q", weights, self._met[nodes, slot])
        upper = np.clip(position - below, 0.0, 1.0)
        alone = np.where(met[:, 0] < 0.5, 1, np.where(met[:, 1] < 0.5, 0, -1))
        both_out = (met < 0.5).all(axis=1)
        alone[both_out] = (upper[both_out] > 0.5).astype(np.int64)
        upper = np.where(alone == 0, 0.0, np.where(alone == 1, 1.0, upper))
        known = (position >= -_BEYOND) & (position <= last + _BEYOND)
        return Feet(slices, index, upper, position, known)


def _needed(tets: IntArray, position: FloatArray, count: int) -> tuple[IntArray, IntArray]:
    """First slice, and number of slices, that the tetrahedra around each node may ask for."""
    low = np.clip(np.floor(position[tets].min(axis=1)), 0, count - 1).astype(np.int64)
    high = np.clip(np.floor(position[tets].max(axis=1)) + 1, 0, count - 1).astype(np.int64)
    first, last = np.full(len(position), count), np.full(len(position), -1)
    for corner in tets.T:
        np.minimum.at(first, corner, low)
        np.maximum.at(last, corner, high)
    unused = last < 0
    first[unused], last[unused] = 0, 0
    return first, last - first + 1
