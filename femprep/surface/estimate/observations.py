"""A LabelObject in, what its labels say of the surface out: where it passes, how surely, and what it separates."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from femprep.image.boundary import BoundaryPoints, boundary_points, face_indices
from femprep.image.object import LabelObject
from femprep.image.views import mask_edges
from femprep.model import BoolArray, FloatArray, IntArray
from femprep.model.products import product
from femprep.surface.estimate.crossings import crossings, slice_distances

#: Share of the way from their middle that faces between slices go to where interpolation puts the surface.
_INTERPOLATED: Final = 0.85
#: A boundary point within this of the middle of its voxel's face has not been put elsewhere, mm.
_OWN: Final = 0.01


@dataclass(frozen=True, eq=False)
class ViewObservations:
    """What long-axis views show of a surface, in the coordinates of Observations, mm.

    Attributes
    ----------
    faces : (N, 3) array
        Middles between neighbouring pixels of which one shows the object: the surface crosses ``across`` within half a
        pixel of them.
    across : (N, 3) array
        Unit vector from the inner pixel to the outer one.
    plane : (N, 3) array
        Unit normal of the view.
    spacing : (N,) array
        Distance of the two pixels, mm.
    thickness : (N,) array
        Thickness of the slice, mm.
    count : float
        How many like it each stands for.
    """

    faces: FloatArray
    across: FloatArray
    plane: FloatArray
    spacing: FloatArray
    thickness: FloatArray
    count: float = 1.0

    @classmethod
    def of(cls, obj: LabelObject) -> ViewObservations:
        """Of all views of an object whose image's axes are those of the coordinates."""
        edges = [mask_edges(v.mask("object"), v.origin, v.axes, v.spacing) for v in obj.views]
        size = [len(e.points) for e in edges]
        return cls(
            np.concatenate([e.points for e in edges]) - obj.barycentre,
            np.concatenate([e.across for e in edges]),
            np.repeat([v.normal for v in obj.views], size, axis=0),
            np.concatenate([e.spacing for e in edges]),
            np.repeat([v.thickness for v in obj.views], size),
        )

    def thinned(self, most: int) -> ViewObservations:
        """One in so many faces, so that there are at most ``most``."""
        step = max(1, -(-len(self.faces) // most))
        names = ("faces", "across", "plane", "spacing", "thickness")
        return replace(self, **{name: getattr(self, name)[::step] for name in names}, count=float(step))


@dataclass(frozen=True, eq=False)
class Observations:
    """What the labels say of a surface, in coordinates from the object's barycentre, mm.

    Attributes
    ----------
    faces : (N, 3) array
        Points of voxel faces at the boundary: the surface crosses the face's axis within half a voxel of its middle.
    axis : (N,) array
        The axis across each face.
    spacing : (N,) array
        Voxel size along it, mm.
    between : (N,) bool array
        Faces between two slices.
    end : (N,) bool array
        Those of them beyond which no slice holds a voxel: the caps.
    centres : (n, 3) array
        Voxel centres next to the boundary.
    outside : (n,) bool array
        Whether each lies outside of the object.
    count : float
        How many like it each of the faces and centres stands for.
    seen : ViewObservations, optional
        What long-axis views show.
    """

    faces: FloatArray
    axis: IntArray
    spacing: FloatArray
    between: BoolArray
    end: BoolArray
    centres: FloatArray
    outside: BoolArray
    count: float = 1.0
    seen: ViewObservations | None = None

    def thinned(self, most: int) -> Observations:
        """One in so many faces and centres, each standing for those left out, so that there are at most ``most``."""
        step = -(-len(self.faces) // most)
        faces = {name: getattr(self, name)[::step] for name in ("faces", "axis", "spacing", "between", "end")}
        seen = None if self.seen is None else self.seen.thinned(most)
        thin = {**faces, "centres": self.centres[::step], "outside": self.outside[::step], "seen": seen}
        return replace(self, **thin, count=float(step))

    @classmethod
    def of(cls, obj: LabelObject, boundary: BoundaryPoints | None = None) -> Observations:
        """Observations of an object whose image's axes are those of the coordinates.

        Parameters
        ----------
        obj : LabelObject
        boundary : BoundaryPoints, optional
            Face midpoints in place of the object's own. Those that were put elsewhere are meant to lie there, but are
            known less well than to a pixel: an extrapolated apex has steps, which must not be followed. The voxel
            centres move with them.
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
        moved, end = _between_slices(obj, boundary)
        # Points that were put elsewhere, such as an extrapolated apex, are meant to lie there.
        own = np.abs(boundary.points - obj.grid.to_world(face_indices(boundary, obj.grid))).max(axis=1) < _OWN
        found = cls(
            boundary.points + np.where(own[:, None], moved, 0.0) - middle,
            np.asarray(boundary.axis),
            np.where(own, boundary.spacing, np.sqrt(obj.grid.spacing.min() * boundary.spacing)),
            own & (np.asarray(boundary.axis) == obj.stack_axis),
            own & end,
            centres - middle,
            outside,
        )
        return found._with_views(obj, own) if obj.views else found

    def _with_views(self, obj: LabelObject, own: BoolArray) -> Observations:
        """The same and what views show; an end of the stack beyond which these show the object does not count.

        Nor does what was put there in place of voxel faces, as an extrapolated apex (not ``own``).
        """
        axis = obj.stack_axis
        half, pixel = 0.5 * float(obj.grid.spacing[axis]), obj.grid.pixel
        used = np.flatnonzero(obj.mask.any(axis=obj.grid.flat_axes))
        # The axes of the coordinates are those of the grid, one of them possibly turned round.
        places = obj.grid.origin[axis] + obj.grid.direction[axis, axis] * obj.grid.spacing[axis] * used[[0, -1]]
        low, high = np.sort(places - obj.barycentre[axis]) + np.array([-half, half])
        bodies = [view.to_world(np.argwhere(view.mask("object")))[:, axis] for view in obj.views]
        seen = np.concatenate(bodies) - obj.barycentre[axis]
        faces, centres = np.ones(len(self.faces), dtype=bool), np.ones(len(self.centres), dtype=bool)
        for sign, end in ((-1.0, low), (1.0, high)):
            if len(seen) and (sign * (seen - end)).max() > pixel:
                above = sign * (self.faces[:, axis] - end)
                faces &= ~((self.end & (np.abs(above) < half)) | (~own & (above > -half)))
                centres &= ~(self.outside & (sign * (self.centres[:, axis] - end) > 0.0))
        kept = {name: getattr(self, name)[faces] for name in ("faces", "axis", "spacing", "between", "end")}
        shown = ViewObservations.of(obj)
        return replace(self, **kept, centres=self.centres[centres], outside=self.outside[centres], seen=shown)


def _between_slices(obj: LabelObject, boundary: BoundaryPoints) -> tuple[FloatArray, BoolArray]:
    """Moves ``(N, 3)`` of face midpoints to where the outlines of the slices put the surface, and which are caps."""
    axis = obj.stack_axis
    one, other = (float(obj.grid.spacing[a]) for a in obj.grid.flat_axes)
    stack = np.moveaxis(obj.mask, axis, 0)
    across = boundary.axis == axis
    voxel = np.moveaxis(boundary.voxel[across], 1, 0)[[axis, *obj.grid.flat_axes]]
    side = np.sign(product(boundary.normal[across], obj.grid.direction[:, axis])).astype(np.int64)
    share = crossings(slice_distances(stack, (one, other)), voxel, side)
    moved = np.zeros((len(boundary), 3))
    moved[across] = (_INTERPOLATED * (share - 0.5) * boundary.spacing[across])[:, None] * boundary.normal[across]
    end = np.zeros(len(boundary), dtype=bool)
    used = np.asarray(stack.any(axis=(1, 2)))
    end[across] = ~used[voxel[0] + side]
    return moved, end
