"""Slices and views of a heart in, planes out: what each of them shows of every object, and how it is moved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from femprep.image.segmentation import Segmentation
from femprep.image.views import MaskEdges, mask_edges
from femprep.model import BoolArray, FloatArray

#: Prior standard deviations: of a slice's shift along each of its axes, mm; of a view's along its two axes and across
#: it, mm, and of its rotation about each axis, radians.
SLICE_PRIOR: Final = (2.1, 2.1)
VIEW_PRIOR: Final = (1.4, 1.4, 1.0, 0.015, 0.015, 0.015)
#: Pixels around what a plane shows that are kept, mm.
_ROOM: Final = 14.0


@dataclass(frozen=True, eq=False)
class ImagePlane:
    """A slice of the stack or a view, in the coordinates of the stack's regular grid, mm.

    Attributes
    ----------
    name : str
    number : int
        Of the slice; -1 for a view.
    origin, axes, spacing
        As of a PlaneView.
    masks : mapping of str to (n, m) bool array
        Pixels of each object that the plane can show.
    prior : (d,) array
        Standard deviations of its motion: 2 translations of a slice, 3 translations and 3 rotations of a view.
    motion : (d,) array
        Translation along its axes (and across it), mm, and rotation vector along the same about its middle, by which
        what the plane shows is moved to where the heart is.
    middle : (3,) array
        The point it turns about, mm.
    guess : (d,) array
        Mean of the prior of its motion.
    """

    name: str
    number: int
    origin: FloatArray
    axes: FloatArray
    spacing: FloatArray
    masks: Mapping[str, BoolArray]
    prior: FloatArray
    motion: FloatArray
    middle: FloatArray
    guess: FloatArray

    @property
    def view(self) -> bool:
        """Whether it is a view, no slice."""
        return self.number < 0

    @cached_property
    def frame(self) -> FloatArray:
        """Both axes and the normal as columns."""
        return np.column_stack([self.axes, np.cross(self.axes[:, 0], self.axes[:, 1])])

    @property
    def way(self) -> FloatArray:
        """Translation that the motion holds, mm."""
        return np.asarray(self.frame[:, : min(3, len(self.motion))] @ self.motion[:3])

    @cached_property
    def rotation(self) -> FloatArray:
        """Rotation about the middle that the motion holds."""
        return rotation_of(self.frame @ self.motion[3:]) if self.view else np.eye(3)

    def moved(self, points: FloatArray) -> FloatArray:
        """Points of the plane as stored, moved to where the heart is."""
        return np.asarray((points - self.middle) @ self.rotation.T + self.middle + self.way)

    def stored(self, points: FloatArray) -> FloatArray:
        """Fractional pixels ``(n, 2)`` of points of the heart, projected onto the plane."""
        local = (points - self.middle - self.way) @ self.rotation + (self.middle - self.origin)
        return np.asarray(local @ self.axes / self.spacing)

    def jacobian(self, moved: FloatArray, normal: FloatArray) -> FloatArray:
        """Change ``(n, d)`` of the heights of moved points along normals, per unit of the motion."""
        frame = self.frame
        along = normal @ frame
        if not self.view:
            return along[:, :2]
        turned = np.cross(moved - self.middle - self.way, normal) @ frame
        return np.concatenate([along, turned], axis=1)

    def edges(self, name: str) -> MaskEdges:
        """Where the plane shows the boundary of an object."""
        return mask_edges(self.masks[name], self.origin, self.axes, self.spacing)


def rotation_of(vector: FloatArray) -> FloatArray:
    """Rotation matrix of a rotation vector, radians (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def objects_of(seg: Segmentation) -> dict[str, tuple[str, ...]]:
    """Solid objects that structures make: cavities, and each with its wall."""
    found: dict[str, tuple[str, ...]] = {}
    known = [name for name in seg.structures if set(seg.structures[name]) <= set(seg.present)]
    for name in known:
        if name == "myo":
            found["epi"] = ("lv", "myo") if "lv" in known else ("myo",)
        elif name.endswith("_wall"):
            pass
        else:
            found[name] = (name,)
    return found


def planes_of(seg: Segmentation, objects: Mapping[str, tuple[str, ...]]) -> list[ImagePlane]:
    """All slices of a stack that show an object, then the views that name one, each cut to what it shows."""
    axis, flat = seg.stack_axis, list(seg.grid.flat_axes)
    masks = {name: np.moveaxis(seg.mask(*parts), axis, 0) for name, parts in objects.items()}
    offsets = seg.grid.offset_at(np.arange(seg.grid.shape[axis]))
    eye, turn = np.eye(3), seg.grid.direction.T
    found = []
    for k in range(seg.grid.shape[axis]):
        place = eye[axis] * k * seg.grid.spacing[axis] + offsets[k]
        own = {name: mask[k] for name, mask in masks.items()}
        found.append(_cut(f"slice {k}", k, place, eye[:, flat], seg.grid.spacing[flat], own))
    for view in seg.views:
        own = {name: view.mask(*parts) for name, parts in objects.items() if set(parts) <= set(view.structures)}
        place = turn @ (view.origin - seg.grid.origin)
        found.append(_cut(view.name, -1, place, turn @ view.axes, view.spacing, own))
    return [plane for plane in found if plane is not None]


def _cut(
    name: str, number: int, origin: FloatArray, axes: FloatArray, spacing: FloatArray, masks: dict[str, BoolArray]
) -> ImagePlane | None:
    """A plane cut to what it shows and some room; None where that is nothing."""
    seen = np.argwhere(np.any(list(masks.values()), axis=0)) if masks else np.empty((0, 2))
    if len(seen) == 0:
        return None
    room = np.ceil(_ROOM / spacing).astype(np.int64)
    low = np.maximum(seen.min(axis=0) - room, 0)
    high = seen.max(axis=0) + room + 1
    cut = {key: mask[low[0] : high[0], low[1] : high[1]] for key, mask in masks.items()}
    prior = np.array(SLICE_PRIOR if number >= 0 else VIEW_PRIOR)
    middle = origin + axes @ (seen.mean(axis=0) * spacing)
    still = np.zeros(len(prior))
    return ImagePlane(name, number, origin + axes @ (low * spacing), axes, spacing, cut, prior, still, middle, still)
