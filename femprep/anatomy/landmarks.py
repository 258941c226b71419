"""Segmentation in, VentricularAxes out: long axis, basal end, RV insertion points and hand from the labels."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from femprep.anatomy.axes import VentricularAxes, hand, rv_drift
from femprep.anatomy.frames import normalise
from femprep.errors import InputError
from femprep.model import FloatArray

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation

BoolArray = npt.NDArray[np.bool_]


def axes_from_labels(seg: Segmentation, *, basal_end: str = "auto") -> VentricularAxes:
    """Axes of the left ventricle from a label map with ``lv``, ``myo`` and, where it has one, ``rv``.

    The long axis is the straight line fitted through the cavity's centroids in the slices, each weighed with its area,
    so that slices shifted against each other do not tilt it much. The septum is the arc of myocardium that touches the
    RV; its ends are the insertion points.

    Raises
    ------
    InputError
        A structure is missing or lies in one slice only.
    """
    axis = int(seg.stack_axis)
    cavity = np.moveaxis(seg.mask("lv"), axis, 0)
    muscle = np.moveaxis(seg.mask("myo"), axis, 0)
    area = (cavity | muscle).sum(axis=(1, 2)).astype(float)
    slices = np.flatnonzero(area)
    inner = np.flatnonzero(cavity.any(axis=(1, 2)))
    if len(inner) < 2:
        raise InputError(f"the LV cavity lies in {len(inner)} slice(s) of the stack; its long axis needs at least 2")
    basal, evidence = _basal_end(area, slices, basal_end)

    centre = np.array([_centroid(cavity[k], int(k), seg, axis) for k in inner])
    weight = np.sqrt(cavity[inner].sum(axis=(1, 2)))
    across = np.polynomial.polynomial.polyfit(inner, centre, 1, w=weight)  # rows: at slice 0, per slice
    direction = normalise(across[1] * basal)
    ends = slices[[0, -1]] if basal > 0 else slices[[-1, 0]]
    apex = across[0] + across[1] * (ends[0] - 0.5 * basal)  # the outer face of the last slice
    base = across[0] + across[1] * ends[1]
    info: dict[str, Any] = {"basal_end": "last" if basal > 0 else "first", **evidence}

    rv = None
    if "rv" in seg.structures and any(n in seg.present for n in seg.structures["rv"]):
        rv = np.moveaxis(seg.mask("rv"), axis, 0)
    if rv is None or rv.sum() < 8:
        info["assumed"] = ["septal", "hand"]
        helper = np.array([-1.0, -1.0, 0.0])  # in a patient the RV lies to the right and in front (LPS)
        return VentricularAxes(apex, base, helper - (helper @ direction) * direction, None, source="labels", info=info)
    points = _world(rv, seg, axis)
    first = points.mean(axis=0) - (apex + ((points.mean(axis=0) - apex) @ direction) * direction)
    axes = VentricularAxes(apex, base, first, None, source="labels")
    drift = rv_drift(axes, points, np.ones(len(points)), np.argwhere(rv)[:, 0])
    mirrored = hand(drift)
    info["rv_drift_degrees"] = round(drift, 1)
    if mirrored is None:
        info["assumed"] = ["hand"]
    axes = VentricularAxes(apex, base, first, mirrored, source="labels")
    septal, insertions, span = _septum(axes, rv, muscle, seg, axis)
    info["septal_span_degrees"] = None if span is None else round(span, 1)
    return VentricularAxes(apex, base, septal, mirrored, insertions, source="labels", info=info)


def _basal_end(area: FloatArray, slices: npt.NDArray[np.intp], basal_end: str) -> tuple[int, dict[str, Any]]:
    """+1 where the last slice is basal: the cross-section grows towards the base."""
    k = slices - slices.mean()
    slope = float((k @ area[slices]) / (k @ k) / area[slices].mean())
    evidence: dict[str, Any] = {"area_slope_per_slice": round(slope, 4)}
    if basal_end in ("first", "last"):
        return (1 if basal_end == "last" else -1), {**evidence, "given": basal_end}
    if basal_end != "auto":
        raise InputError(f"basal_end is {basal_end!r}; expected auto, first or last")
    if slope == 0.0:
        raise InputError("both ends of the stack look alike, so the base cannot be found; give basal_end first or last")
    return (1 if slope > 0 else -1), evidence


def _septum(
    axes: VentricularAxes, rv: BoolArray, muscle: BoolArray, seg: Segmentation, axis: int
) -> tuple[FloatArray, dict[str, FloatArray], float | None]:
    """Septal direction, insertion points and the angle between them, from where myocardium touches the RV.

    Per slice the arc of contact is what lies within its 2nd and 98th percentile of angle; over the middle half of the
    slices with contact the median of each end is taken, so that the outflow tract and single voxels do not count.
    """
    touch = np.zeros_like(rv)
    for shift, side in ((1, 1), (-1, 1), (1, 2), (-1, 2)):
        touch |= np.roll(rv, shift, axis=side)
    touch &= muscle
    used = np.flatnonzero(touch.sum(axis=(1, 2)) >= 3)
    used = used[len(used) // 4 : len(used) - len(used) // 4]
    low, high, radius, height = list[float](), list[float](), list[float](), list[float]()
    for k in used:
        only = np.zeros_like(touch)
        only[k] = touch[k]
        points = _world(only, seg, axis)
        angle = (axes.angle(points) + 180.0) % 360.0 - 180.0
        low.append(float(np.percentile(angle, 2)))
        high.append(float(np.percentile(angle, 98)))
        radius.append(float(axes.radius(points).mean()))
        height.append(float(axes.height(points).mean()))
    if not low:
        return axes.septal, {}, None
    ends = np.radians([np.median(low), np.median(high)])
    middle = float(ends.mean())
    septal: FloatArray = np.cos(middle) * axes.septal + np.sin(middle) * axes.anterior
    at = axes.apex + np.median(height) * axes.long_axis
    found = [at + np.median(radius) * (np.cos(a) * axes.septal + np.sin(a) * axes.anterior) for a in ends]
    return septal, {"inferior": found[0], "anterior": found[1]}, float(np.degrees(ends[1] - ends[0]))


def _world(mask: BoolArray, seg: Segmentation, axis: int) -> FloatArray:
    """World points of the voxels of a mask whose stack axis is in front."""
    index = np.argwhere(mask)
    return seg.grid.to_world(np.insert(index[:, 1:], axis, index[:, 0], axis=1))


def _centroid(plane: BoolArray, k: int, seg: Segmentation, axis: int) -> FloatArray:
    index = np.argwhere(plane).mean(axis=0)
    at: FloatArray = seg.grid.to_world(np.insert(index, axis, k)[None])[0]
    return at
