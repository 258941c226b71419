"""Contours in, a Segmentation out: the short-axis planes as a stack of labels, the long-axis planes as its views."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from femprep.errors import InputError, OptionError
from femprep.image.grid import Grid
from femprep.image.left_out import slice_between
from femprep.image.segmentation import Segmentation, count_labels
from femprep.image.views import PlaneView
from femprep.model import BoolArray, FloatArray, IntArray, Notice, records
from femprep.model.products import product

if TYPE_CHECKING:
    from femprep.image.contours import Contour, ContourPlane, Contours

#: Structure and label inside of a surface's contours, in the order they are drawn: later ones lie on top.
_PAINT: Final = (
    ("rv_epi", "rv_wall", 4),
    ("la", "la", 5),
    ("ra", "ra", 6),
    ("rv", "rv", 3),
    ("epi", "myo", 2),
    ("lv", "lv", 1),
)
#: Room around the contours, pixels.
_ROOM: Final = 3
#: Pixels of labels per pixel of the image: contours are known to less than a pixel.
_FINER: Final = 1.5
#: Short-axis planes may be tilted against each other by so much: 1 - cosine of 1 degree.
_TILT: Final = 1.5e-4
#: Of an end of the stack whose cavity's outline lies on no myocardium along more than this share, views know more.
_OPEN: Final = 0.25
#: A plane this near to a slice of the regular stack is that slice; share of the slice distance.
_NEAR: Final = 0.1


def segmentation_of(contours: Contours, pixel: float | None) -> Segmentation:
    """See :meth:`Contours.to_segmentation`."""
    lines = {plane.name: [one for one in contours.contours if one.plane == plane.name] for plane in contours.planes}
    drawn = [plane for plane in contours.planes if any(not one.is_landmark for one in lines[plane.name])]
    short = [plane for plane in drawn if plane.short_axis]
    where = f"{contours.source}: " if contours.source else ""
    if len(short) < 2:
        raise InputError(
            f"{where}has contours on {len(short)} short-axis plane{'s' * (len(short) != 1)}; a heart needs at least "
            "two, and long-axis planes add to them"
        )
    size = float(min(plane.spacing.min() for plane in drawn)) / _FINER if pixel is None else float(pixel)
    if not np.isfinite(size) or size <= 0.0:
        raise OptionError(f"pixel is {pixel!r} mm, expected a positive number")
    labels, grid, notices = _stack(short, lines, size, where)
    views = contours.views(pixel=size)
    if any({"lv", "myo"} <= set(view.shown) for view in views):
        notices += _clear_open_ends(labels)
    count = count_labels(labels)
    info = {
        "file": contours.source,
        "format": "contours",
        "shape": list(labels.shape),
        "spacing": grid.spacing.tolist(),
        "labels": {str(n): c for n, c in count.items()},
        "notices": records(*contours.notices, *notices),
    }
    structures = {name: (number,) for _, name, number in reversed(_PAINT) if number in count}
    grid = replace(grid, drawn_pixel=float(min(plane.spacing.min() for plane in drawn)))
    return Segmentation(labels, grid, structures, info, views=views)


def _stack(
    planes: list[ContourPlane], lines: dict[str, list[Contour]], pixel: float, where: str
) -> tuple[IntArray, Grid, list[Notice]]:
    """Labels of equally spaced slices; one that no plane is near to is interpolated between its neighbours."""
    first = planes[0]
    normal = first.normal
    for plane in planes:
        if 1.0 - abs(float(plane.normal @ normal)) > _TILT:
            raise InputError(
                f"{where}short-axis planes {first.name!r} and {plane.name!r} are not parallel; mark one of them as a "
                "long-axis plane"
            )
    height = np.array([product(plane.origin - first.origin, normal) for plane in planes])
    planes = [planes[k] for k in np.argsort(height)]
    height = np.sort(height)
    step = float(np.median(np.diff(height)))
    if step <= 0.0 or np.diff(height).min() < _NEAR * step:
        low = int(np.diff(height).argmin())
        raise InputError(
            f"{where}short-axis planes {planes[low].name!r} and {planes[low + 1].name!r} lie in one place; leave out "
            "one of them"
        )
    count = round((height[-1] - height[0]) / step) + 1
    step = float(height[-1] - height[0]) / (count - 1)
    every = [one for plane in planes for one in lines[plane.name] if not one.is_landmark]
    corner, shape = _frame(np.concatenate([product(one.points - first.origin, first.axes) for one in every]), pixel)
    origin = first.origin + product(corner, first.axes.T)
    drawn = np.stack([_paint(lines[plane.name], origin, first.axes, pixel, shape) for plane in planes])
    at = (height - height[0]) / step
    slices, between = [], []
    for number in range(count):
        nearest = int(np.abs(at - number).argmin())
        if abs(at[nearest] - number) <= _NEAR:
            slices.append(drawn[nearest])
            continue
        above = int(np.searchsorted(at, number))
        share = float((number - at[above - 1]) / (at[above] - at[above - 1]))
        slices.append(slice_between(drawn[above - 1], drawn[above], share, np.full(2, pixel)))
        between.append(str(number))
    labels = np.ascontiguousarray(np.moveaxis(np.array(slices), 0, 2))
    start = origin + height[0] * normal
    grid = Grid((*shape, count), np.array([pixel, pixel, step]), start, np.column_stack([first.axes, normal]), stack=2)
    if not between:
        return labels, grid, []
    words = f"short-axis planes are not equally spaced: slices {', '.join(between)} of a stack with {step:.1f} mm "
    return labels, grid, [Notice.of("assumed", f"{words}between slices are interpolated from their neighbours")]


def _clear_open_ends(labels: IntArray) -> list[Notice]:
    """Take the left ventricle out of end slices that pass through a valve, where myocardium does not close round it."""
    found = []
    for number in (0, labels.shape[2] - 1):
        plane = labels[:, :, number]
        cavity = plane == 1
        beside = [np.roll(plane, step, axis=axis)[cavity] for axis in (0, 1) for step in (1, -1)]
        edges = sum(int((own != 1).sum()) for own in beside)
        if sum(int(((own != 1) & (own != 2)).sum()) for own in beside) > _OPEN * edges:
            plane[cavity | (plane == 2)] = 0
            found.append(str(number))
    if not found:
        return []
    words = f"contours of the left ventricle in slice {', '.join(found)} of the stack were left out: its myocardium is "
    return [
        Notice.of("left out", f"{words}open, as where a slice passes through a valve; the views show what is there")
    ]


def views_of(contours: Contours, pixel: float | None) -> tuple[PlaneView, ...]:
    """See :meth:`Contours.views`."""
    found = []
    for plane in contours.planes:
        own = [one for one in contours.contours if one.plane == plane.name]
        lines = [one for one in own if not one.is_landmark]
        if plane.short_axis or not lines:
            continue
        size = float(plane.spacing.min()) / _FINER if pixel is None else pixel
        low, shape = _frame(plane.to_plane(np.concatenate([one.points for one in lines])), size)
        origin = plane.origin + product(low, plane.axes.T)
        labels = _paint(lines, origin, plane.axes, size, shape)
        shown = {one.surface for one in lines}
        structures = {name: (number,) for surface, name, number in reversed(_PAINT) if surface in shown}
        marks: dict[str, list[FloatArray]] = {}
        for one in own:
            if one.is_landmark:
                marks.setdefault(one.surface, []).append(one.points)
        landmarks = {name: np.concatenate(points) for name, points in marks.items()}
        sizes = np.full(2, size)
        found.append(PlaneView(plane.name, labels, structures, origin, plane.axes, sizes, plane.thickness, landmarks))
    return tuple(found)


def _frame(points: FloatArray, pixel: float) -> tuple[FloatArray, tuple[int, int]]:
    """Where pixels around points on a plane begin, mm, and how many there are."""
    low = points.min(axis=0) - _ROOM * pixel
    count = np.ceil((points.max(axis=0) - low) / pixel).astype(int) + _ROOM + 1
    return low, (int(count[0]), int(count[1]))


def _paint(
    lines: list[Contour], origin: FloatArray, axes: FloatArray, pixel: float, shape: tuple[int, int]
) -> IntArray:
    """Labels of the pixels of a plane inside of contours."""
    labels = np.zeros(shape, dtype=np.int64)
    for surface, _, number in _PAINT:
        for one in lines:
            if one.surface == surface:
                labels[inside(product(one.points - origin, axes) / pixel, shape)] = number
    return labels


def inside(polygon: FloatArray, shape: tuple[int, int]) -> BoolArray:
    """Which pixel centres ``(i, j)`` lie inside of a polygon ``(n, 2)`` in pixels, by the even-odd rule."""
    found = np.zeros(shape, dtype=bool)
    across = np.arange(shape[0])[:, None]
    for (x, y), (u, v) in zip(polygon, np.roll(polygon, -1, axis=0)):
        first, last = sorted((int(np.ceil(y)), int(np.ceil(v))))
        rows = np.arange(max(first, 0), min(last, shape[1]))
        if len(rows):
            found[:, rows] ^= across > x + (rows - y) * (u - x) / (v - y)
    return found
