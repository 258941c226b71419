"""A segmentation without an apical cap in, boundary points of an epicardium that closes around the apex out.

Short-axis stacks mostly end in a slice that still holds cavity. There the cavity and the whole ventricle share their
last slice, so that both fitted surfaces would end at the same height and the wall would have no thickness. The
epicardium is therefore continued beyond the slice by a dome, as thick as the wall around the cavity nearby.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from scipy.ndimage import distance_transform_edt

from femprep.image.boundary import BoundaryPoints, boundary_points
from femprep.model import FloatArray
from femprep.options import WallOptions, choose
from femprep.wall.landmarks import read_stack

if TYPE_CHECKING:
    from femprep.image.object import LabelObject
    from femprep.image.segmentation import Segmentation

logger = logging.getLogger(__name__)

BoolArray = npt.NDArray[np.bool_]

#: Slices with cavity at the apical end in which the thickness of the wall is measured.
_MEASURED = 2


@dataclass(frozen=True)
class Slice:
    """The most apical slice with cavity, on the epicardial object's grid.

    Attributes
    ----------
    axis, number, towards : int
        Grid axis of the stack, slice number, and the step along the axis that leads away from the base.
    cavity, whole : (a, b) bool array
        Cavity and cavity plus myocardium in the slice.
    spacing : (2,) array
        Pixel sizes within the slice, mm.
    height : float
        Distance of slices, mm.
    """

    axis: int
    number: int
    towards: int
    cavity: BoolArray
    whole: BoolArray
    spacing: FloatArray
    height: float


def extend_apex(
    seg: Segmentation,
    obj: LabelObject,
    boundary: BoundaryPoints | None = None,
    *,
    options: WallOptions | None = None,
    **changes: Any,
) -> BoundaryPoints:
    """Continue an epicardium beyond the last slice, where the labels leave the cavity uncapped at the apex.

    Over the last slice with cavity the surface becomes a dome: with s running from 0 at the edge of the cavity to 1 at
    the edge of the myocardium, it stands ``(h / 2 + t) sqrt(1 - s^2)`` above the centre of the slice, h being the
    distance of slices and t the thickness of the wall nearby. It leaves the contour of the slice at a right angle to
    the slice, as an ellipse around the edge of the cavity does, and clears the cavity by about t everywhere. Where
    slices of myocardium cap the cavity in part, the dome adds what is missing.

    Parameters
    ----------
    seg : Segmentation
        Label map with the structures ``lv`` and ``myo``.
    obj : LabelObject
        Cavity plus myocardium of the same map.
    boundary : BoundaryPoints, optional
        Its boundary points, where they are at hand.
    options, **changes
        :class:`~femprep.options.WallOptions`; ``basal_end`` and ``minimum_thickness`` matter here.

    Returns
    -------
    BoundaryPoints
        To be passed to ``fit_surface(obj, boundary=...)``. Where the labels cap the cavity they are as they were;
        ``info["apex"]`` tells which, and by how many mm the epicardium was extrapolated.

    Raises
    ------
    InputError
        A structure is missing or the basal end cannot be found.
    """
    chosen = choose(WallOptions, options, changes)
    boundary = boundary_points(obj) if boundary is None else boundary
    stack = read_stack(seg, basal_end=chosen.basal_end, what="the apex")
    cavity = np.moveaxis(_on_grid(seg, obj, "lv"), stack.axis, 0) & np.moveaxis(obj.mask, stack.axis, 0)
    whole = np.moveaxis(obj.mask, stack.axis, 0)
    spacing = np.asarray(obj.grid.spacing, dtype=float)
    within = np.delete(spacing, stack.axis)
    filled = np.flatnonzero(cavity.any(axis=(1, 2)))
    number = int(filled[0] if stack.basal > 0 else filled[-1])
    last = Slice(stack.axis, number, -stack.basal, cavity[number], whole[number], within, float(spacing[stack.axis]))
    uncapped = last.cavity & ~whole[number + last.towards]
    share = float(uncapped.sum() / last.cavity.sum())
    info: dict[str, Any] = {"uncapped_share": share, "extrapolated_mm": 0.0}
    if share == 0.0:
        return _with_info(boundary, {**boundary.info, "apex": info})
    measured = [number - last.towards * i for i in range(_MEASURED)]
    thickness = _thickness(cavity, whole, [k for k in measured if cavity[k].any()], last)
    thickness = max(thickness, chosen.minimum_thickness, float(within.min()))
    info.update(extrapolated_mm=thickness, slice_thickness_mm=last.height)
    logger.warning(
        "the labels leave %.0f %% of the cavity uncapped at the apex; the epicardium was extrapolated by %.1f mm",
        100 * share,
        thickness,
    )
    return _dome(boundary, obj, whole, last, thickness, {**boundary.info, "apex": info})


def _on_grid(seg: Segmentation, obj: LabelObject, structure: str) -> BoolArray:
    """Mask of a structure on an object's own grid."""
    first = np.rint(seg.grid.to_index(obj.grid.to_world(np.zeros((1, 3))))[0]).astype(int)
    mask = np.zeros(obj.mask.shape, dtype=bool)
    source, target = [], []
    for start, have, want in zip(first.tolist(), seg.labels.shape, obj.mask.shape):
        low, high = max(start, 0), min(start + want, have)
        source.append(slice(low, high))
        target.append(slice(low - start, high - start))
    mask[tuple(target)] = seg.mask(structure)[tuple(source)]
    return mask


def _thickness(cavity: BoolArray, whole: BoolArray, slices: list[int], last: Slice) -> float:
    """Thickness of the wall around the cavity near its end, mm: median over the cavity's contour.

    Within a slice an oblique wall looks thicker than it is, by the cosine of its slope, which is told from how much
    the equivalent radius changes to the next slice on the basal side.
    """
    values = []
    for k in slices:
        inside = cavity[k]
        depth = distance_transform_edt(whole[k], sampling=last.spacing)
        edge = inside & (distance_transform_edt(inside, sampling=last.spacing) < 1.01 * last.spacing.max())
        # From voxel centre to voxel centre; half a pixel on either side lies beyond the contours.
        across = depth[edge] - last.spacing.mean()
        radii = [np.sqrt(whole[j].sum() * last.spacing.prod() / np.pi) for j in (k, k - last.towards)]
        slope = np.arctan2(max(radii[1] - radii[0], 0.0), last.height)
        values.append(across * np.cos(slope))
    return float(np.median(np.concatenate(values)))


def _dome(
    boundary: BoundaryPoints, obj: LabelObject, whole: BoolArray, last: Slice, thickness: float, info: dict[str, Any]
) -> BoundaryPoints:
    """Raise the points of the flat end to the dome, and drop what the dome covers."""
    from_cavity = distance_transform_edt(~last.cavity, sampling=last.spacing)
    to_edge = distance_transform_edt(last.whole, sampling=last.spacing)
    s = from_cavity / np.maximum(from_cavity + to_edge, 1e-12)
    # Height above the centre of the slice, mm; 0 outside.
    height = np.where(last.whole, (0.5 * last.height + thickness) * np.sqrt(np.maximum(1.0 - s**2, 0.0)), 0.0)
    along = boundary.voxel[:, last.axis]
    column = tuple(np.delete(boundary.voxel, last.axis, axis=1).T)
    outward = np.asarray(obj.grid.direction, dtype=float)[:, last.axis]
    outward = outward / np.linalg.norm(outward) * last.towards
    facing = (boundary.axis == last.axis) & (boundary.normal @ outward > 0.5)
    ending = facing & (along == last.number)
    # Points of slices beyond, which cap the cavity in part, stay where they stand above the dome.
    beyond = (along - last.number) * last.towards
    level = beyond * last.height + np.where(facing, 0.5 * last.height, 0.0)
    keep = (beyond <= 0) | (level >= height[column])
    points = boundary.points.copy()
    points[ending] += (height[column] - 0.5 * last.height)[ending, None] * outward
    # The flat end is known to a slice's thickness, and so is the dome.
    return BoundaryPoints(
        points[keep],
        boundary.normal[keep],
        boundary.axis[keep],
        boundary.spacing[keep],
        boundary.voxel[keep],
        info,
    )


def _with_info(boundary: BoundaryPoints, info: dict[str, Any]) -> BoundaryPoints:
    return BoundaryPoints(boundary.points, boundary.normal, boundary.axis, boundary.spacing, boundary.voxel, info)
