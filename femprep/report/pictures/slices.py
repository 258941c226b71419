"""Slices of a label map, or of the image it was drawn on, with the mesh drawn over them, as SVG."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.image import Segmentation
from femprep.image.underlay import greys
from femprep.mesh.level_segments import level_segments
from femprep.model import BoolArray, FloatArray
from femprep.report.pictures.aligned import crossing
from femprep.report.pictures.colours import structure_colour
from femprep.report.pictures.overlay import Drawing, Overlay, runs

#: Slices that are drawn at most: a page of more would not open from a mail.
MOST: Final = 40
#: Room around the labels within a slice: pixels, and mm where an image lies under them.
MARGIN: Final = 3
ROOM: Final = 12.0
#: Width of a picture, pixels of the screen.
_WIDTH: Final = 220


def slice_pictures(seg: Segmentation, over: Overlay) -> list[str]:
    """One SVG a slice: the image, where there is one, the structures filled, the cut of each surface drawn over them.

    Returns
    -------
    list of str
        SVG elements from the first slice that holds a label to the last; of more than ``MOST`` slices so many, evenly
        spread.
    """
    axis = seg.stack_axis
    across = [a for a in range(3) if a != axis]
    # A preset may name structures that this map does not hold; their masks are empty.
    masks = {name: np.moveaxis(np.isin(seg.labels, labels), axis, 2) for name, labels in seg.structures.items()}
    spacing = np.asarray(seg.grid.spacing, dtype=np.float64)[across]
    everything = np.any(np.stack(list(masks.values())), axis=0)
    if not everything.any():
        return []
    low, high = _box(everything, np.full(2, MARGIN) if over.under is None else np.ceil(ROOM / spacing))
    indices = {name: seg.grid.to_index(points) for name, (points, _) in over.surfaces.items()}
    dots = seg.grid.to_index(np.concatenate(over.off)) if sum(map(len, over.off)) else np.empty((0, 3))
    pictures = []
    for k in shown_slices(low[2], high[2]):
        drawing = Drawing(np.asarray(low[:2] - 0.5, dtype=np.float64), (high - low)[:2].astype(np.float64), spacing)
        if over.under is not None:
            columns, rows = np.meshgrid(*(np.arange(low[a], high[a], dtype=float) for a in range(2)))
            places = np.full((columns.size, 3), float(k))
            places[:, across] = np.stack([columns.ravel(), rows.ravel()], axis=1)
            drawing.raster("image", greys(over.under.values(places), over.limits).reshape(columns.shape))
        for name, mask in masks.items():
            path = runs(mask[low[0] : high[0], low[1] : high[1], k])
            if path:
                drawing.fill("labels", path, structure_colour(name))
        for name, (_, triangles) in over.surfaces.items():
            index = indices[name]
            cut, segments = level_segments(index, triangles, index[:, axis] - (k + 1e-9))
            drawing.outline(name, cut[:, across][segments])
        box = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]]) - 0.5
        for view in seg.views:
            places = np.insert(box, axis, float(k), axis=1)
            drawing.plane(crossing(box, (seg.grid.to_world(places) - view.origin) @ view.normal))
        drawing.dots(dots[np.rint(dots[:, axis]) == k][:, across])
        pictures.append(drawing.svg(_WIDTH, f"slice {k}", str(k)))
    return pictures


def shown_slices(first: int, end: int) -> list[int]:
    """Numbers of the slices that are drawn, from the first to before the end: all, or ``MOST`` evenly spread."""
    if end - first <= MOST:
        return list(range(first, end))
    return [int(k) for k in np.unique(np.rint(np.linspace(first, end - 1, MOST)))]


def _box(mask: BoolArray, margin: FloatArray) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """First and last (exclusive) index of what is set, with a margin of so many pixels within a slice."""
    room = np.array([*margin, 0]).astype(np.int64)
    found = np.argwhere(mask)
    low = np.maximum(found.min(axis=0) - room, 0)
    high = np.minimum(found.max(axis=0) + 1 + room, mask.shape)
    return low, high
