"""Segmentation in, VentricularAxes out: long axis, basal end, RV insertion points and hand from the labels.

A stack of thick slices lies across the heart: its slices are the levels, and the long axis is the straight line through
the cavity's centroids in them. An image of about cubic voxels lies anyhow: there the base is where the cavity is not
closed by myocardium, and the levels are slabs across the axis from the far end to there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import numpy.typing as npt

from femprep.anatomy.axes.ventricular_axes import USUAL_RV, VentricularAxes, hand, rv_drift
from femprep.errors import InputError
from femprep.image.long_axis import is_stack, long_axis
from femprep.image.slices import relative_slope
from femprep.model import BoolArray, FloatArray, IntArray
from femprep.model.products import unit_vectors
from femprep.options.advice import GIVE_END

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation


#: Height of a level in an image that is no stack, mm.
_SLAB: Final = 5.0
#: Voxels that lie this near to a limit lie on it, mm: along whatever axes an image is stored, the same ones count.
_ALIKE: Final = 1e-6


@dataclass(frozen=True)
class _Line:
    """Long axis as found: apex and base points, evidence; and the stack's axis, None where there is no stack."""

    apex: FloatArray
    base: FloatArray
    evidence: dict[str, Any]
    stack: int | None


def axes_from_labels(seg: Segmentation, *, basal_end: str = "auto") -> VentricularAxes:
    """Axes of the left ventricle from a label map with ``lv``, ``myo`` and, where it has one, ``rv``.

    The septum is the arc of myocardium that touches the RV; its ends are the insertion points, its middle is the septal
    direction.

    Parameters
    ----------
    seg : Segmentation
        The label map.
    basal_end : {"auto", "first", "last"}
        Which end of a stack of slices is basal.

    Raises
    ------
    InputError
        A structure is missing or lies in one slice only.
    """
    require_end(basal_end)
    cavity, muscle = seg.mask("lv"), seg.mask("myo")
    stack = is_stack(seg.grid)
    rv = seg.mask("rv") if "rv" in seg.structures and set(seg.structures["rv"]) <= set(seg.present) else None
    line = _stack_line(seg, cavity, muscle, rv, basal_end) if stack else _free_line(seg, cavity, muscle)
    info: dict[str, Any] = dict(line.evidence)
    direction = unit_vectors(line.base - line.apex)

    if rv is None or rv.sum() < 8:
        info["assumed"] = ["septal", "hand"]
        helper = USUAL_RV if abs(USUAL_RV @ direction) < 0.9 else np.array([-1.0, 0.0, 0.0])
        return VentricularAxes(line.apex, line.base, helper, None, source="labels", info=info)
    points = _world(rv, seg)
    axes = VentricularAxes(line.apex, line.base, points.mean(axis=0) - line.apex, None, source="labels")
    drift = rv_drift(axes, points, np.ones(len(points)), _levels(rv, points, axes, line.stack))
    mirrored = hand(drift)
    info.update(drift.record())
    if mirrored is None:
        info["assumed"] = ["hand"]
    axes = VentricularAxes(line.apex, line.base, axes.septal, mirrored, source="labels")
    septal, insertions, span = _septum(axes, rv, muscle, seg, line.stack)
    info["septal_span_degrees"] = None if span is None else round(span, 1)
    return VentricularAxes(line.apex, line.base, septal, mirrored, insertions, source="labels", info=info)


def require_end(basal_end: str) -> None:
    """Refuse a word that is no end of a stack.

    Raises
    ------
    InputError
    """
    if basal_end not in ("auto", "first", "last"):
        raise InputError(f"basal_end is {basal_end!r}; expected auto, first or last")


def _stack_line(seg: Segmentation, cavity: BoolArray, muscle: BoolArray, rv: BoolArray | None, basal_end: str) -> _Line:
    """The line through the cavity's centroids, weighed with the roots of their areas.

    Slices that are shifted against each other so do not tilt it much.
    """
    axis = int(seg.stack_axis)
    inside = np.moveaxis(cavity, axis, 0)
    area = np.moveaxis(cavity | muscle, axis, 0).sum(axis=(1, 2)).astype(float)
    slices, inner = np.flatnonzero(area), np.flatnonzero(inside.any(axis=(1, 2)))
    if len(inner) < 2:
        raise InputError(f"the LV cavity lies in {len(inner)} slice(s) of the stack; its long axis needs at least 2")
    right = np.moveaxis(rv, axis, 0).sum(axis=(1, 2)) if rv is not None else np.zeros(len(area))
    covered = slice(slices[0], slices[-1] + 1)
    basal, evidence = _basal_end(area[covered], right[covered], basal_end)
    index = [np.insert(np.argwhere(inside[k]).mean(axis=0), axis, k) for k in inner]
    weight = np.sqrt(inside[inner].sum(axis=(1, 2)))
    at_zero, step = np.polynomial.polynomial.polyfit(inner, seg.grid.to_world(index), 1, w=weight)
    ends = slices[[0, -1]] if basal > 0 else slices[[-1, 0]]
    apex = at_zero + step * (ends[0] - 0.5 * basal)  # the outer face of the last slice
    evidence["basal_end"] = "last" if basal > 0 else "first"
    return _Line(apex, at_zero + step * ends[1], evidence, axis)


def _basal_end(area: npt.NDArray[Any], right: npt.NDArray[Any], basal_end: str) -> tuple[int, dict[str, Any]]:
    """+1 where the last slice is basal: towards the base the left ventricle grows, and the right one more so."""
    slope, right_slope = relative_slope(area), relative_slope(right)
    evidence: dict[str, Any] = {"area_slope_per_slice": round(slope, 4), "rv_slope_per_slice": round(right_slope, 4)}
    if basal_end != "auto":
        return (1 if basal_end == "last" else -1), {**evidence, "given": basal_end}
    if slope + right_slope == 0.0:
        raise InputError("both ends of the stack look alike, so the base cannot be found", advice=[GIVE_END])
    return (1 if slope + right_slope > 0 else -1), evidence


def _free_line(seg: Segmentation, cavity: BoolArray, muscle: BoolArray) -> _Line:
    """The line from the cavity's far end to the centre of its opening, begun where the myocardium begins."""
    axis = long_axis(seg)
    low = float(((_world(muscle | cavity, seg) - axis.opening) @ axis.direction).min())
    return _Line(axis.opening + low * axis.direction, axis.opening, {"open_voxels": axis.voxels}, None)


def _septum(
    axes: VentricularAxes, rv: BoolArray, muscle: BoolArray, seg: Segmentation, stack: int | None
) -> tuple[FloatArray, dict[str, FloatArray], float | None]:
    """Septal direction, insertion points and the angle between them, from where myocardium touches the RV.

    Per level the arc of contact is what lies within its 2nd and 98th percentile of angle; over the middle half of the
    levels with contact the median of each end is taken, so that the outflow tract and single voxels do not count.
    """
    touch = np.zeros(np.add(rv.shape, 2), dtype=bool)
    padded = np.pad(rv, 1)
    for axis in range(3):
        if axis != stack:
            touch |= np.roll(padded, 1, axis=axis) | np.roll(padded, -1, axis=axis)
    touch = touch[1:-1, 1:-1, 1:-1] & muscle
    if not touch.any():
        return axes.septal, {}, None
    points = _world(touch, seg)
    level = _levels(touch, points, axes, stack)
    used = [k for k in np.unique(level) if np.count_nonzero(level == k) >= 3]
    used = used[len(used) // 4 : len(used) - len(used) // 4]
    if not used:
        return axes.septal, {}, None
    angle = axes.turn(points)
    arcs = np.array([np.percentile(angle[level == k], [2, 98]) for k in used])
    ends = np.radians(np.median(arcs, axis=0))
    radius, height = axes.radius(points), axes.height(points)
    out = float(np.median([radius[level == k].mean() for k in used]))
    at = axes.apex + float(np.median([height[level == k].mean() for k in used])) * axes.long_axis
    found = {"inferior": at + out * axes.across(ends[0]), "anterior": at + out * axes.across(ends[1])}
    return axes.across(float(ends.mean())), found, float(np.degrees(ends[1] - ends[0]))


def _levels(mask: BoolArray, points: FloatArray, axes: VentricularAxes, stack: int | None) -> IntArray:
    """Number of the level of each voxel of a mask, in the order of its points."""
    if stack is not None:
        return np.argwhere(mask)[:, stack].astype(np.int64)
    return np.floor((axes.height(points) + _ALIKE) / _SLAB).astype(np.int64)


def _world(mask: BoolArray, seg: Segmentation) -> FloatArray:
    return seg.grid.to_world(np.argwhere(mask))
