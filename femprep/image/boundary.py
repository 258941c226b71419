"""A LabelObject in; the boundary points of the paper's section 2.4 out, each with the direction of its face."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from femprep.image.grid import Grid
from femprep.image.object import LabelObject
from femprep.model import FloatArray, Immutable, IntArray, readonly


@dataclass(frozen=True, eq=False)
class BoundaryPoints(Immutable):
    """Midpoints between neighbouring voxels of which one lies in the object and one does not.

    Attributes
    ----------
    points : (N, 3) array
        mm LPS.
    normal : (N, 3) array
        Unit vector in the world from the inside voxel to the outside one: the outward direction of their face.
    axis : (N,) array
        Grid axis across the face.
    spacing : (N,) array
        Voxel size across the face, mm: how far apart the two voxel centres are, hence how well the point is known.
    voxel : (N, 3) array
        Index of the inside voxel on the object's grid.
    info : mapping
        What was changed of the points as the labels give them. JSON-ready; a surface fitted to them repeats it.

    Examples
    --------
    >>> found = fp.boundary_points(cavity)
    >>> found.points.shape == found.normal.shape
    True
    """

    points: FloatArray
    normal: FloatArray
    axis: IntArray
    spacing: FloatArray
    voxel: IntArray
    info: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        count = len(self.points)
        for name, dtype, shape in (
            ("points", np.float64, (count, 3)),
            ("normal", np.float64, (count, 3)),
            ("axis", np.int64, (count,)),
            ("spacing", np.float64, (count,)),
            ("voxel", np.int64, (count, 3)),
        ):
            object.__setattr__(self, name, readonly(getattr(self, name), dtype, shape, f"boundary {name}"))
        object.__setattr__(self, "info", MappingProxyType(dict(self.info)))

    def __repr__(self) -> str:
        return f"BoundaryPoints({len(self.points)} points)"

    def __len__(self) -> int:
        return len(self.points)


def faces_to(boundary: BoundaryPoints, grid: Grid) -> FloatArray:
    """1 where the face of a boundary point looks to larger indices of its axis, -1 to smaller ones, ``(N,)``."""
    return np.asarray(np.sign(np.einsum("nk,kn->n", boundary.normal, grid.direction[:, boundary.axis])))


def face_indices(boundary: BoundaryPoints, grid: Grid) -> FloatArray:
    """Middles of the voxel faces that boundary points belong to, ``(N, 3)`` as fractional indices on their grid."""
    side = faces_to(boundary, grid)
    index = boundary.voxel.astype(np.float64)
    index[np.arange(len(boundary)), boundary.axis] += 0.5 * side
    return index


def boundary_points(obj: LabelObject) -> BoundaryPoints:
    """Midpoints of all pairs of face neighbours, one inside and one outside the object.

    Parameters
    ----------
    obj : LabelObject

    Returns
    -------
    BoundaryPoints
        Ordered by axis i, j, k; for each axis first the faces towards smaller index, then towards larger; within each
        by voxel index, i slowest.

    References
    ----------
    Skrinjar & Bistoquet 2009, section 2.4, doi 10.1155/2009/313517.

    Examples
    --------
    >>> fp.boundary_points(cavity)
    BoundaryPoints(... points)
    """
    grid, mask = obj.grid, obj.mask
    directions = grid.direction / np.linalg.norm(grid.direction, axis=0)
    voxels, points, normals, axes = [], [], [], []
    for axis in range(3):
        for side in (-1, 1):
            # The mask is padded, so that rolling brings in nothing but background at the border.
            outside = ~np.roll(mask, -side, axis=axis)
            voxel = np.argwhere(mask & outside)
            half = np.zeros(3)
            half[axis] = 0.5 * side
            voxels.append(voxel)
            points.append(grid.to_world(voxel + half))
            normals.append(np.broadcast_to(side * directions[:, axis], voxel.shape))
            axes.append(np.full(len(voxel), axis))
    axis_of = np.concatenate(axes)
    return BoundaryPoints(
        np.concatenate(points), np.concatenate(normals), axis_of, grid.spacing[axis_of], np.concatenate(voxels)
    )
