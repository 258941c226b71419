"""An object's labels or its grid in, the mid-planes of its slices and the contours in them out."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from femprep.image import Grid, LabelObject
from femprep.mesh.plane_sections import chains
from femprep.model import BoolArray, FloatArray, IntArray, Plane

# Marching squares: the sides of a pixel quadruple (0 bottom, 1 right, 2 top, 3 left) a contour joins, by the sum of
# 1, 2, 4, 8 for its corners (lower left, lower right, upper right, upper left) inside; the inside lies to the left.
# Where opposite corners are inside (5, 10) they are kept apart.
_SIDES = {
    1: ((0, 3),),
    2: ((1, 0),),
    3: ((1, 3),),
    4: ((2, 1),),
    5: ((0, 3), (2, 1)),
    6: ((2, 0),),
    7: ((2, 3),),
    8: ((3, 2),),
    9: ((0, 2),),
    10: ((1, 0), (3, 2)),
    11: ((1, 2),),
    12: ((3, 1),),
    13: ((0, 1),),
    14: ((3, 0),),
}


def label_contours(obj: LabelObject) -> tuple[list[Plane], list[list[FloatArray]]]:
    """Contours of an object's labels in the mid-plane of each of its slices.

    The contour runs through the midpoints between neighbouring pixels of which one is in the object, as that of
    marching cubes does; pixels that touch at a corner only are kept apart.

    Parameters
    ----------
    obj : LabelObject

    Returns
    -------
    planes : list of Plane
        Mid-planes of the slices that hold a voxel, in the order of the stack; normals along it.
    contours : list of list of (k, 3) arrays
        Closed contours in each, mm LPS, the last point repeating the first.
    """
    axis = obj.stack_axis
    i_axis, j_axis = obj.grid.flat_axes
    stack = np.moveaxis(obj.mask, axis, 0)
    planes = slice_planes(obj)
    contours = []
    for number in _used_slices(obj):
        flat = _pixel_contours(stack[number])
        index = [np.zeros((len(loop), 3)) for loop in flat]
        for row, loop in zip(index, flat):
            row[:, axis] = number
            row[:, i_axis] = loop[:, 0]
            row[:, j_axis] = loop[:, 1]
        contours.append([obj.grid.to_world(row) for row in index])
    return planes, contours


def grid_planes(grid: Grid, numbers: npt.ArrayLike | None = None) -> list[Plane]:
    """Mid-planes of slices of a grid's stack, by number (all where not given); normals towards growing numbers."""
    axis = grid.stack_axis
    numbers = np.arange(grid.shape[axis]) if numbers is None else np.asarray(numbers)
    index = np.zeros((len(numbers), 3))
    index[:, axis] = numbers
    first, second = (grid.direction[:, a] for a in grid.flat_axes)
    # Across both in-plane directions, which an affine that is not quite orthogonal does not promise of the third.
    normal = np.cross(first, second)
    normal = normal if normal @ grid.direction[:, axis] > 0 else -normal
    return [Plane(point, normal, source="slice") for point in grid.to_world(index)]


def slice_planes(obj: LabelObject) -> list[Plane]:
    """Mid-planes of the slices an object has voxels in, in the order of the stack."""
    return grid_planes(obj.grid, _used_slices(obj))


def end_planes(obj: LabelObject) -> tuple[Plane, Plane]:
    """Mid-planes of the first and the last slice of an object, normals pointing away from the slices between."""
    planes = slice_planes(obj)
    first, last = planes[0], planes[-1]
    return Plane(first.point, -first.normal, source="slice"), last


def _used_slices(obj: LabelObject) -> IntArray:
    return np.flatnonzero(obj.mask.any(axis=obj.grid.flat_axes))


def _pixel_contours(mask: BoolArray) -> list[FloatArray]:
    """Marching squares at one half on a mask that is empty at its rim: closed loops in pixel coordinates."""
    code = mask[:-1, :-1] + 2 * mask[1:, :-1] + 4 * mask[1:, 1:] + 8 * mask[:-1, 1:]
    ni, nj = mask.shape
    segments: list[IntArray] = []
    for case, joined in _SIDES.items():
        i, j = np.nonzero(code == case)
        # Number of each side's node: those between (i, j) and (i + 1, j) first, then those up to (i, j + 1).
        side = (i * nj + j, ni * nj + (i + 1) * nj + j, i * nj + j + 1, ni * nj + i * nj + j)
        segments.extend(np.stack([side[a], side[b]], axis=1) for a, b in joined)
    used, ends = np.unique(np.concatenate(segments), return_inverse=True)
    along_j, node = np.divmod(used, ni * nj)
    place = np.stack([node // nj + 0.5 * (along_j == 0), node % nj + 0.5 * (along_j == 1)], axis=1)
    return [place[chain] for chain in chains(ends.reshape(-1, 2), len(used))]
