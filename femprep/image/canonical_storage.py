"""A LabelObject stored along any axes in, the same voxels in the order and sense that its own shape tells out.

A fit goes through voxels, faces and vertices one after the other, and its decisions follow that order. Whether a file
holds a heart along these axes or others, forwards or backwards, says nothing of the heart.
"""

from __future__ import annotations

from itertools import permutations, product

import numpy as np

from femprep.image.boundary import BoundaryPoints, boundary_points, faces_to
from femprep.image.grid import Grid
from femprep.image.object import LabelObject
from femprep.image.topology import counts_along
from femprep.model import BoolArray, FloatArray

#: Decimals to which axes are compared with the heart's own.
_DECIMALS = 6
#: The order of the axes, and for each of them in its new place 1, or -1 where it is turned round.
_Storage = tuple[tuple[int, ...], tuple[int, ...]]


def stored_by_content(obj: LabelObject, boundary: BoundaryPoints | None = None) -> tuple[LabelObject, BoundaryPoints]:
    """Bring an object and its boundary points into the storage that the object's shape tells.

    The stack's axis becomes the last one, the others are ordered by the spread of the voxels along them; along each the
    voxels are skew to the same side. Both are told from sums of whole numbers, which no rounding changes. Where they
    are equal the voxels are compared one by one; of a mask that is symmetric, so that these are equal as well, the
    storage next to the heart's own axes is taken, or where these are not known one whose axes are a rotation.

    Parameters
    ----------
    obj : LabelObject
    boundary : BoundaryPoints, optional
        Its boundary points, those of its own voxels where not given.

    Returns
    -------
    obj : LabelObject
        The same voxels at the same places.
    boundary : BoundaryPoints
        In the order of :func:`boundary_points`.

    Examples
    --------
    >>> from femprep.image.canonical_storage import stored_by_content
    >>> stored_by_content(cavity)[0].volume == cavity.volume
    True
    """
    order, signs = _storage(obj)
    if (order, signs) == ((0, 1, 2), (1, 1, 1)):
        return obj, boundary_points(obj) if boundary is None else boundary
    grid, turned = obj.grid, [axis for axis, sign in zip(order, signs) if sign < 0]
    corner = np.array([n - 1.0 if axis in turned else 0.0 for axis, n in enumerate(grid.shape)])
    mask = _stored(obj.mask, (order, signs))
    offsets = None
    if grid.offsets is not None:
        offsets = grid.offsets[:: -1 if grid.stack_axis in turned else 1, order] * signs
    direction = grid.direction[:, order] * signs
    own = Grid(mask.shape, grid.spacing[list(order)], grid.regular.to_world(corner), direction, offsets, 2)
    found = LabelObject(mask, own, obj.name, obj.report, obj.frame, obj.views)
    if boundary is None:
        return found, boundary_points(found)
    axis = np.argsort(order)[boundary.axis]
    voxel = np.where(np.array(signs) < 0, np.array(mask.shape) - 1, 0) + boundary.voxel[:, order] * signs
    side = faces_to(boundary, grid) * np.array(signs)[axis]
    rows = np.lexsort((*voxel.T[::-1], side, axis))
    points, normal, spacing = (getattr(boundary, name)[rows] for name in ("points", "normal", "spacing"))
    return found, BoundaryPoints(points, normal, axis[rows], spacing, voxel[rows], boundary.info)


def _storage(obj: LabelObject) -> _Storage:
    """The storage an object's shape tells."""
    spread = [moments(obj.mask, axis) for axis in range(3)]
    grid = obj.grid
    told = grid.stack is not None or grid.offsets is not None
    thick = [grid.stack_axis] if told else grid.thick_axes
    key = [(axis in thick, second, abs(third)) for axis, (second, third) in enumerate(spread)]
    orders = [order for order in permutations(range(3)) if [key[a] for a in order] == sorted(key)]
    ways = [
        (order, tuple(signs))
        for order in orders
        for signs in product(*([1, -1] if spread[a][1] == 0 else [1 if spread[a][1] > 0 else -1] for a in order))
    ]
    if len(ways) == 1:
        return ways[0]
    voxels = [np.packbits(_stored(obj.mask, way)).tobytes() for way in ways]
    ways = [way for way, own in zip(ways, voxels) if own == min(voxels)]
    if obj.frame is None:
        # Of a mask with one plane of symmetry one of the two is left: the one whose axes are a rotation.
        return next((way for way in ways if np.linalg.det(grid.direction[:, way[0]] * way[1]) > 0.0), ways[0])
    frame: FloatArray = obj.frame
    along = [round(float((obj.grid.direction[:, order] * signs * frame).sum()), _DECIMALS) for order, signs in ways]
    return ways[along.index(max(along))]


def moments(mask: BoolArray, axis: int) -> tuple[int, int]:
    """Second and third central moment of the voxels along an axis, in whole numbers."""
    counts = [int(n) for n in counts_along(mask, axis)]
    total, first = sum(counts), sum(k * n for k, n in enumerate(counts))
    away = [total * k - first for k in range(len(counts))]
    return sum(n * d**2 for n, d in zip(counts, away)), sum(n * d**3 for n, d in zip(counts, away))


def _stored(mask: BoolArray, storage: _Storage) -> BoolArray:
    order, signs = storage
    return np.ascontiguousarray(np.transpose(mask, order)[tuple(slice(None, None, sign) for sign in signs)])
