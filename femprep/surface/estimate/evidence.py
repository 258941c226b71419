"""A LabelObject in, what its labels say of the surface out: where it passes, how surely, and what it separates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from femprep.image.boundary import BoundaryPoints, boundary_points
from femprep.image.object import LabelObject
from femprep.model import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the labels say of a surface, in coordinates along the image's axes, mm.

    Attributes
    ----------
    faces : (N, 3) array
        Midpoints of voxel faces at the boundary: the surface crosses the face's axis within half a voxel of them.
    axis : (N,) array
        The axis across each face.
    spacing : (N,) array
        Voxel size along it, mm.
    between : (N,) bool array
        Faces between two slices.
    centres : (n, 3) array
        Voxel centres next to the boundary.
    outside : (n,) bool array
        Whether each lies outside of the object.
    """

    faces: FloatArray
    axis: IntArray
    spacing: FloatArray
    between: npt.NDArray[np.bool_]
    centres: FloatArray
    outside: npt.NDArray[np.bool_]

    @classmethod
    def of(cls, obj: LabelObject, axes: FloatArray, boundary: BoundaryPoints | None = None) -> Evidence:
        """Evidence of an object, in coordinates along the orthogonal columns of ``axes`` from its barycentre.

        Parameters
        ----------
        obj : LabelObject
        axes : (3, 3) array
            The image's axes, orthogonal columns.
        boundary : BoundaryPoints, optional
            Face midpoints in place of the object's own, moved for example where slices are shifted. The voxel centres
            move with the faces they belong to.
        """
        boundary = boundary_points(obj) if boundary is None else boundary
        half = 0.5 * boundary.spacing[:, None] * boundary.normal
        inner, first = np.unique(
            np.round(obj.grid.to_index(boundary.points - half)).astype(np.int64), axis=0, return_index=True
        )
        outer, second = np.unique(
            np.round(obj.grid.to_index(boundary.points + half)).astype(np.int64), axis=0, return_index=True
        )
        centres = np.concatenate([(boundary.points - half)[first], (boundary.points + half)[second]])
        outside = np.concatenate([np.zeros(len(inner), dtype=bool), np.ones(len(outer), dtype=bool)])
        middle = obj.barycentre
        return cls(
            (boundary.points - middle) @ axes,
            np.asarray(boundary.axis),
            np.asarray(boundary.spacing),
            np.asarray(boundary.axis) == obj.stack_axis,
            (centres - middle) @ axes,
            outside,
        )
