"""Slices and views of a heart in, planes with one pose each out: what each plane shows of every object, and its pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
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


@dataclass(frozen=True, eq=False)
class ImagePlane:
    """A slice of the stack or a view, in the coordinates of the stack's regular grid, mm.

    Attributes
    ----------
    name : str
    view : bool
    origin, axes, spacing
        As of a PlaneView.
    masks : mapping of str to (n, m) bool array
        Pixels of each object that the plane can show.
    prior : (d,) array
        Standard deviations of its motion: 2 translations of a slice, 3 translations and 3 rotations of a view.
    motion : (d,) array
        Translation along its axes (and across it), mm, and rotation vector along the same about its middle, by which
        what the plane shows is moved to where the heart is.
    """

    name: str
    view: bool
    origin: FloatArray
    axes: FloatArray
    spacing: FloatArray
    thickness: float
    masks: Mapping[str, BoolArray]
    prior: FloatArray
    motion: FloatArray
    middle: FloatArray = field(default_factory=lambda: np.zeros(3))
    number: int = -1

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
    """All slices of a stack that show an object, then its views."""
    axis = seg.stack_axis
    flat = list(seg.grid.flat_axes)
    masks = {name: np.moveaxis(seg.mask(*parts), axis, 0) for name, parts in objects.items()}
    used = np.any([mask.any(axis=(1, 2)) for mask in masks.values()], axis=0)
    turn = seg.grid.direction
    offsets = seg.grid.offset_at(np.arange(len(used)))
    found = []
    eye = np.eye(3)
    for k in np.flatnonzero(used):
        origin = eye[axis] * k * seg.grid.spacing[axis] + offsets[k]
        own = {name: mask[k] for name, mask in masks.items()}
        found.append(
            ImagePlane(
                f"slice {k}", False, origin, eye[:, flat], seg.grid.spacing[flat], float(seg.grid.spacing[axis]), own,
                np.array(SLICE_PRIOR), np.zeros(2), number=int(k),
            )
        )
    for view in seg.views:
        own = {
            name: view.mask(*parts) for name, parts in objects.items() if set(parts) <= set(view.structures)
        }
        if not own:
            continue
        axes = turn.T @ view.axes
        origin = turn.T @ (view.origin - seg.grid.origin)
        seen = np.argwhere(np.any(list(own.values()), axis=0))
        middle = origin + axes @ (seen.mean(axis=0) * view.spacing) if len(seen) else origin
        found.append(
            ImagePlane(
                view.name, True, origin, axes, view.spacing, view.thickness, own, np.array(VIEW_PRIOR), np.zeros(6),
                middle,
            )
        )
    return found
