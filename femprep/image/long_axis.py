"""Label map of about cubic voxels in, the left ventricle's long axis out, whichever way the image lies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.image.grid import Grid
from femprep.image.segmentation import Segmentation
from femprep.image.topology import label_pieces, used_box
from femprep.model import FloatArray
from femprep.model.products import product, unit_vectors

#: Voxels whose largest size is at least this many times the smallest make a stack of slices.
_STACK: Final = 2.0
#: Voxels that lie this near to a limit lie on it, mm: along whatever axes an image is stored, the same ones count.
_ALIKE: Final = 1e-6


@dataclass(frozen=True)
class LongAxis:
    """Where a left ventricle opens, and the way there from its far end.

    Attributes
    ----------
    opening : (3,) array
        Centre of the voxels of the cavity that myocardium does not close off, mm LPS.
    direction : (3,) array
        Unit vector from the far end to the opening.
    voxels : int
        Open ones.
    """

    opening: FloatArray
    direction: FloatArray
    voxels: int


def is_stack(grid: Grid) -> bool:
    """Whether voxels are so thick along one axis that they are a stack of slices, which lie across the heart."""
    return bool(grid.spacing.max() >= _STACK * grid.spacing.min())


def long_axis(seg: Segmentation) -> LongAxis:
    """From the cavity's far end (the most distant hundredth of its voxels) to the centre of its opening.

    The opening are the largest piece of the voxels that myocardium does not close off, and what lies on its side.

    Raises
    ------
    InputError
        The cavity is empty, shares labels with the myocardium, or closed by myocardium all round.
    """
    cavity, muscle = seg.mask("lv"), seg.mask("myo")
    if not cavity.any():
        raise InputError("the LV cavity is empty, so it has no base; check the label numbers")
    if both := set(seg.structures["lv"]) & set(seg.structures["myo"]):
        raise InputError(
            f"the structures lv and myo share label {min(both)}, so that nothing tells where the cavity ends; give "
            "each numbers of its own"
        )
    box = used_box(cavity | muscle)
    cavity, muscle = cavity[box], muscle[box]
    free, inner = ~np.pad(cavity | muscle, 1), np.pad(cavity, 1)
    open_ = np.zeros_like(inner)
    for axis in range(3):
        for shift in (1, -1):
            open_ |= np.roll(free, shift, axis=axis)
    open_ = (open_ & inner)[1:-1, 1:-1, 1:-1]
    if not open_.any():
        raise InputError("the LV cavity is closed all round, so it has no base; check the label numbers")
    first = [side.start for side in box]
    points, opening = (seg.grid.to_world(np.argwhere(mask) + first) for mask in (cavity, open_))
    piece = label_pieces(open_)[0][open_]
    direction = _from_far_end(points, opening[piece == 1].mean(axis=0))
    # Where labels end with the cavity open at the apex as well, that end is no opening; two valves are one.
    height = product(points, direction)
    basal = opening[product(opening, direction) > 0.5 * (height.min() + height.max())]
    centre = basal.mean(axis=0)
    return LongAxis(centre, _from_far_end(points, centre), len(basal))


def _from_far_end(points: FloatArray, centre: FloatArray) -> FloatArray:
    """Unit vector to a place from the hundredth of some points that is farthest from it."""
    distance = np.linalg.norm(points - centre, axis=1)
    far = points[distance >= np.percentile(distance, 99) - _ALIKE].mean(axis=0)
    return unit_vectors(centre - far)
