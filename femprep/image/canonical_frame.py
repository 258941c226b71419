"""A LabelObject in, the same in its canonical frame out: along the axes, so that where it lies changes no digit.

A fit takes decisions, such as which edges are flipped. Done in world coordinates, the rounding of a turned image would
now and then decide otherwise, and its surface would be another one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.image.boundary import BoundaryPoints, face_indices
from femprep.image.grid import Grid
from femprep.image.object import LabelObject
from femprep.model import FloatArray
from femprep.model.products import nearest_orthogonal, product, unit_vectors

#: Decimals kept of how far boundary points are from the middles of their voxels' faces, mm, and of unit vectors: those
#: beyond depend on how the image is turned.
_DECIMALS: Final = (6, 9)


def image_axes(obj: LabelObject) -> tuple[FloatArray, FloatArray]:
    """The image's axes as columns, made exactly orthogonal, and the same as a rotation."""
    axes = nearest_orthogonal(obj.grid.direction)
    assert axes is not None, "the axes of a grid are orthogonal but for rounding"
    frame = axes.copy()
    if np.linalg.det(frame) < 0.0:
        frame[:, 2] *= -1.0
    return axes, frame


@dataclass(frozen=True, eq=False)
class CanonicalFrame:
    """An object in its canonical frame, in which its image's axes are those of the coordinates.

    Attributes
    ----------
    obj : LabelObject
        The same voxels, the first one at the origin. The third axis points down where the image's are left-handed.
    axes : (3, 3) array
        The axes of these coordinates in the world: the columns of a rotation.
    given : LabelObject
        The object as it lies in the world.
    """

    obj: LabelObject
    axes: FloatArray
    given: LabelObject

    @classmethod
    def of(cls, obj: LabelObject) -> CanonicalFrame:
        """Put an object into its canonical frame."""
        axes = image_axes(obj)[1]
        hand = np.diag(np.sign(np.diag(product(axes.T, obj.grid.direction))))
        grid = Grid(obj.grid.shape, obj.grid.spacing, np.zeros(3), hand, obj.grid.offsets, obj.grid.stack)
        views = tuple(view.moved(axes.T, -product(axes.T, obj.grid.origin)) for view in obj.views)
        return cls(LabelObject(obj.mask, grid, obj.name, obj.report, views=views), axes, obj)

    def boundary(self, boundary: BoundaryPoints) -> BoundaryPoints:
        """Boundary points in the canonical frame, moved from their voxels' faces as they are in the world."""
        here, there = self.obj.grid, self.given.grid
        face = face_indices(boundary, there)
        side = 2.0 * (face - boundary.voxel).sum(axis=1)
        moved = np.round(product(boundary.points - there.to_world(face), self.axes), _DECIMALS[0])
        return BoundaryPoints(
            here.to_world(face) + moved,
            side[:, None] * here.direction[:, boundary.axis].T,
            boundary.axis,
            boundary.spacing,
            boundary.voxel,
            boundary.info,
        )

    def directions(self, directions: FloatArray) -> FloatArray:
        """Unit vectors ``(n, 3)`` of the world in these coordinates."""
        return unit_vectors(np.round(product(directions, self.axes), _DECIMALS[1]))
