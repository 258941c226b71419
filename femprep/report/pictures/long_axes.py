"""A label map with the mesh over it, cut along the long axis, as SVG: what no slice of a short-axis stack shows."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.image import Segmentation
from femprep.image.underlay import greys
from femprep.mesh.level_segments import level_segments
from femprep.model import FloatArray
from femprep.report.pictures.colours import structure_colour
from femprep.report.pictures.overlay import Drawing, Overlay

#: Room around the labels, mm; pixels of a picture at most along a side.
_ROOM: Final = 12.0
_MOST: Final = 320
#: Width of a picture, pixels of the screen.
_WIDTH: Final = 300
#: Titles of the two cuts.
TITLES: Final = ("along the long axis", "along the long axis, across the first")


def long_axis_pictures(seg: Segmentation, over: Overlay) -> list[str]:
    """Two cuts through the middle of the left ventricle (or all that is labelled), at right angles, base up.

    The first goes to the right ventricle where the heart's axes tell it, else along the stack's own axes. Dots are
    those within half a slice of a cut.

    Returns
    -------
    list of str
        SVG elements; none where nothing is labelled.
    """
    labels = [number for numbers in seg.structures.values() for number in numbers]
    marked = np.argwhere(np.isin(seg.labels, labels))
    if not len(marked):
        return []
    places = seg.grid.to_world(marked.astype(np.float64))
    left = [number for name in ("lv", "myo") for number in seg.structures.get(name, ())]
    own = np.isin(seg.labels[tuple(marked.T)], left)
    middle = places[own if own.any() else slice(None)].mean(axis=0)
    axes = _axes(seg)
    views = [np.stack([axes[:, k], axes[:, 2]]) for k in range(2)]
    return [_picture(seg, over, title, middle, view, places) for title, view in zip(TITLES, views)]


def _axes(seg: Segmentation) -> FloatArray:
    """Axes of the heart as columns, the long one last; of the stack where they are not known."""
    if seg.frame is not None:
        return np.asarray(seg.frame, dtype=np.float64)
    stack = seg.stack_axis
    return np.asarray(seg.grid.direction[:, [a for a in range(3) if a != stack] + [stack]], dtype=np.float64)


def long_axis(seg: Segmentation) -> FloatArray:
    """Unit vector to the base; along the stack where it is not known."""
    return _axes(seg)[:, 2]


def _picture(
    seg: Segmentation, over: Overlay, title: str, middle: FloatArray, view: FloatArray, places: FloatArray
) -> str:
    normal = np.cross(view[0], view[1])
    # Columns go across and rows down from the base, which is the way pictures are written.
    flat = view * np.array([[1.0], [-1.0]])
    seen = np.concatenate([places, *(points for points, _ in over.surfaces.values())])
    at = (seen - middle) @ flat.T
    low, high = at.min(axis=0) - _ROOM, at.max(axis=0) + _ROOM
    step = max(0.5 * float(seg.grid.spacing.min()), float((high - low).max()) / _MOST)
    count = np.ceil((high - low) / step).astype(int)
    steps = [low[a] + step * (np.arange(count[a]) + 0.5) for a in range(2)]
    columns, rows = np.meshgrid(*steps)
    points = middle + np.stack([columns.ravel(), rows.ravel()], axis=1) @ flat
    index = seg.grid.to_index(points)
    drawing = Drawing(low, count * step)
    if over.under is not None:
        drawing.raster("image", greys(over.under.values(index), over.limits).reshape(columns.shape))
    drawing.raster("labels", _labels(seg, index).reshape(*columns.shape, 4))
    for name, (corners, triangles) in over.surfaces.items():
        cut, segments = level_segments(corners, triangles, (corners - middle) @ normal - 1e-9)
        drawing.outline(name, ((cut - middle) @ flat.T)[segments])
    near = 0.5 * float(seg.grid.spacing.max())
    for one in over.off:
        drawing.dots((one[np.abs((one - middle) @ normal) < near] - middle) @ flat.T)
    return drawing.svg(_WIDTH, title)


def _labels(seg: Segmentation, index: FloatArray) -> npt.NDArray[np.uint8]:
    """Colours of the voxels that (fractional) indices ``(n, 3)`` lie in, ``(n, 4)``; none where there is no label."""
    number = seg.grid.values_at(seg.labels, index)
    shades = np.zeros((len(index), 4), dtype=np.uint8)
    for name, numbers in seg.structures.items():
        shade = bytes.fromhex(structure_colour(name).removeprefix("#"))
        shades[np.isin(number, numbers)] = (*shade, 255)
    return shades
