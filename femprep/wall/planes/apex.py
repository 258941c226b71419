"""A segmentation without an apical cap in, boundary points of an epicardium that closes around the apex out.

Short-axis stacks mostly end in a slice that still holds cavity. There the cavity and the whole ventricle share their
last slice, so that both fitted surfaces would end at the same height and the wall would have no thickness. The
epicardium is therefore continued beyond the slice by a dome, as thick as the wall around the cavity nearby. Where a
slice holds labels they win: nothing is added or taken away there, and a wall that is too thin between two slices is
thickened where the wall is built.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import distance_transform_edt

from femprep.errors import InputError
from femprep.image.boundary import BoundaryPoints, boundary_points
from femprep.model import BoolArray, FloatArray, Notice, Surface, records
from femprep.model.products import product
from femprep.options import WallOptions, choose, takes
from femprep.wall.planes.oblique import lies_oblique
from femprep.wall.planes.stack import read_stack

if TYPE_CHECKING:
    from femprep.image.object import LabelObject
    from femprep.image.segmentation import Segmentation

logger = logging.getLogger(__name__)


#: Slices with cavity at the apical end in which the thickness of the wall is measured.
_MEASURED = 2


@dataclass(frozen=True)
class Pile:
    """Cavity and epicardial object in slices numbered from 0, the most apical one with cavity, towards the base.

    Attributes
    ----------
    axis, first, towards : int
        Grid axis of the stack, grid number of slice 0, and the step along the axis that leads away from the base.
    cavity, whole : (s, a, b) bool array
        Cavity, and cavity plus myocardium.
    beyond : (a, b) bool array
        Cavity plus myocardium in the slice beyond slice 0.
    spacing : (2,) array
        Pixel sizes within a slice, mm.
    height : float
        Distance of slices, mm.
    """

    axis: int
    first: int
    towards: int
    cavity: BoolArray
    whole: BoolArray
    beyond: BoolArray
    spacing: FloatArray
    height: float

    @property
    def uncapped(self) -> float:
        """Share of the cavity of slice 0 over which the slice beyond holds no label."""
        return float((self.cavity[0] & ~self.beyond).sum() / self.cavity[0].sum())


@takes(WallOptions)
def extend_apex(
    seg: Segmentation,
    obj: LabelObject,
    boundary: BoundaryPoints | None = None,
    *,
    endo: Surface | None = None,
    options: WallOptions | None = None,
    **changes: Any,
) -> BoundaryPoints:
    """Continue an epicardium beyond the last slice, where the labels end with the cavity still open.

    Over the last slice, one with cavity, the surface becomes a dome: with s running from 0 at the edge of the cavity to
    1 at the edge of the myocardium, it stands ``(e + t) sqrt(1 - s^2)`` above the centre of the slice, e being how far
    the endocardium reaches beyond it (half the distance of slices where that is not given) and t the thickness of the
    wall nearby. It leaves the contour of the slice at a right angle to the slice, as an ellipse around the edge of the
    cavity does, and clears the cavity by about t everywhere. Where a slice beyond holds myocardium, were it over a part
    of the cavity only, the labels end the ventricle themselves and the points stay as they are; so they do where a
    long-axis view shows the apex, which the fitted surface then follows.

    Parameters
    ----------
    seg : Segmentation
        Label map with the structures ``lv`` and ``myo``.
    obj : LabelObject
        Cavity plus myocardium of the same map.
    boundary : BoundaryPoints, optional
        Its boundary points, where they are at hand.
    endo : Surface, optional
        The endocardium fitted to the cavity.
    options, **changes
        :class:`~femprep.options.WallOptions`; ``basal_end`` and ``minimum_thickness`` matter here.

    Returns
    -------
    BoundaryPoints
        To be passed to ``fit_surface(obj, boundary=...)``. Where the labels end the ventricle they are as they were;
        ``info["apex"]`` tells which, and by how many mm the epicardium was extrapolated, and where.

    Raises
    ------
    InputError
        A structure is missing, the basal end cannot be found, or the object holds no cavity.

    Examples
    --------
    >>> fp.extend_apex(seg, heart, endo=endo)
    BoundaryPoints(... points)
    """
    chosen = choose(WallOptions, options, changes)
    boundary = boundary_points(obj) if boundary is None else boundary
    if lies_oblique(seg, chosen.basal_end):  # no slice ends the ventricle
        return replace(boundary, info={**boundary.info, "apex": {"uncapped_share": 0.0, "extrapolated_mm": 0.0}})
    pile = _pile(seg, obj, chosen)
    info: dict[str, Any] = {"uncapped_share": pile.uncapped, "extrapolated_mm": 0.0}
    if shown := _views_of_apex(seg, obj, pile):
        info["views"] = shown
    if pile.beyond.any() or shown:
        return replace(boundary, info={**boundary.info, "apex": info})
    thickness = max(_thickness(pile), chosen.minimum_thickness, float(pile.spacing.min()))
    reach = _reach(pile, obj, endo)
    points = _raised(boundary, obj, pile, _dome(pile, reach + thickness))
    centre, outward = _end(pile, obj)
    tip = points[int(np.argmax(product(points - centre, outward)))]
    info.update(
        extrapolated_mm=thickness,
        slice_thickness_mm=pile.height,
        beyond_last_slice_mm=reach + thickness,
        place_mm=[round(float(x), 1) for x in tip],
    )
    logger.warning(
        "the labels end with the cavity open at the apex; the epicardium was extrapolated by %.1f mm beyond the cavity",
        thickness,
    )
    info["notices"] = records(*apex_notices(info))
    return replace(boundary, points=points, info={**boundary.info, "apex": info})


def apex_notices(info: Mapping[str, Any]) -> list[Notice]:
    """What was extrapolated at the apex, told from the figures of ``info["apex"]``."""
    if not info.get("extrapolated_mm"):
        return []
    words = (
        "the labels end with the cavity still open at the apex: the epicardium was extrapolated by "
        f"{{amount}} beyond the cavity, {info['beyond_last_slice_mm']:.1f} mm beyond the last slice"
    )
    return [Notice.of("extrapolated", words, amount=info["extrapolated_mm"], unit="mm", place=info["place_mm"])]


def _pile(seg: Segmentation, obj: LabelObject, options: WallOptions) -> Pile:
    """The slices of the ventricle from apex to base, on the object's grid."""
    stack = read_stack(seg, basal_end=options.basal_end, what="the apex")
    whole = np.moveaxis(obj.mask, stack.axis, 0)
    cavity = np.moveaxis(_on_grid(seg, obj), stack.axis, 0) & whole
    spacing = np.asarray(obj.grid.spacing, dtype=float)
    filled = np.flatnonzero(cavity.any(axis=(1, 2)))
    if not len(filled):
        raise InputError(f"object {obj.name!r} holds no cavity; make it of cavity and myocardium")
    first = int(filled[0] if stack.basal > 0 else filled[-1])
    order = slice(first, None, stack.basal)
    return Pile(
        axis=stack.axis,
        first=first,
        towards=-stack.basal,
        cavity=cavity[order],
        whole=whole[order],
        beyond=whole[first - stack.basal],
        spacing=np.delete(spacing, stack.axis),
        height=float(spacing[stack.axis]),
    )


def _views_of_apex(seg: Segmentation, obj: LabelObject, pile: Pile) -> list[str]:
    """Names of long-axis views in which myocardium closes the cavity beyond the last slice, or in it."""
    centre, outward = _end(pile, obj)
    shown = []
    for view in seg.views:
        if {"lv", "myo"} <= set(view.shown):
            wall, cavity = (
                float(product(view.to_world(np.argwhere(view.mask(name))) - centre, outward).max())
                for name in ("myo", "lv")
            )
            if cavity > -pile.height and wall > cavity + view.spacing.max():
                shown.append(view.name)
    return shown


def _on_grid(seg: Segmentation, obj: LabelObject) -> BoolArray:
    """Mask of the left cavity on an object's own grid."""
    first = np.rint(seg.grid.to_index(obj.grid.to_world(np.zeros((1, 3))))[0]).astype(int)
    mask = np.zeros(obj.mask.shape, dtype=bool)
    source, target = [], []
    for start, have, want in zip(first.tolist(), seg.labels.shape, obj.mask.shape):
        low, high = max(start, 0), min(start + want, have)
        source.append(slice(low, high))
        target.append(slice(low - start, high - start))
    mask[tuple(target)] = seg.mask("lv")[tuple(source)]
    return mask


def _thickness(pile: Pile) -> float:
    """Thickness of the wall around the cavity near its end, mm: median over the cavity's contour.

    Within a slice an oblique wall looks thicker than it is, by the cosine of its slope, which is told from how much
    the equivalent radius changes to the next slice on the basal side.
    """
    values = []
    radius = np.sqrt(pile.whole.sum(axis=(1, 2)) * pile.spacing.prod() / np.pi)
    for k in range(min(_MEASURED, len(pile.cavity) - 1)):
        inside = pile.cavity[k]
        depth = distance_transform_edt(pile.whole[k], sampling=pile.spacing)
        edge = inside & (distance_transform_edt(inside, sampling=pile.spacing) < 1.01 * pile.spacing.max())
        # From voxel centre to voxel centre; half a pixel on either side lies beyond the contours.
        across = depth[edge] - pile.spacing.mean()
        slope = np.arctan2(max(radius[k + 1] - radius[k], 0.0), pile.height)
        values.append(across * np.cos(slope))
    return float(np.median(np.concatenate(values))) if values else 0.0


def _reach(pile: Pile, obj: LabelObject, endo: Surface | None) -> float:
    """How far the endocardium reaches beyond the centre of slice 0, mm: by no more than a slice."""
    if endo is None:
        return 0.5 * pile.height
    centre, outward = _end(pile, obj)
    return float(np.clip(product(endo.points - centre, outward).max(), 0.0, pile.height))


def _end(pile: Pile, obj: LabelObject) -> tuple[FloatArray, FloatArray]:
    """A point of the middle plane of slice 0, and the unit vector towards the apex."""
    outward = np.asarray(obj.grid.direction, dtype=float)[:, pile.axis]
    centre = obj.grid.to_world(np.where(np.arange(3) == pile.axis, pile.first, 0.0)[None])[0]
    return centre, outward / np.linalg.norm(outward) * pile.towards


def _dome(pile: Pile, top: float) -> FloatArray:
    """Height of the dome over slice 0 above its centre, mm: ``top`` over the cavity, 0 outside the slice."""
    from_cavity = distance_transform_edt(~pile.cavity[0], sampling=pile.spacing)
    to_edge = distance_transform_edt(pile.whole[0], sampling=pile.spacing)
    s = from_cavity / np.maximum(from_cavity + to_edge, 1e-12)
    return np.where(pile.whole[0], top * np.sqrt(np.maximum(1.0 - s**2, 0.0)), 0.0)


def _raised(boundary: BoundaryPoints, obj: LabelObject, pile: Pile, height: FloatArray) -> FloatArray:
    """Boundary points with those of the flat end of slice 0 raised to a height above its centre."""
    column = tuple(np.delete(boundary.voxel, pile.axis, axis=1).T)
    centre, outward = _end(pile, obj)
    facing = (boundary.axis == pile.axis) & (product(boundary.normal, outward) > 0.5)
    ending = facing & (boundary.voxel[:, pile.axis] == pile.first)
    level = product(boundary.points - centre, outward)
    return np.asarray(boundary.points + np.where(ending, height[column] - level, 0.0)[:, None] * outward)
