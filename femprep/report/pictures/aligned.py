"""Long-axis views and the shifts of slices as SVG: views with the mesh and the slices drawn over, shifts by slice."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from femprep.image import PlaneView, Segmentation
from femprep.mesh.level_segments import level_segments
from femprep.model import FloatArray
from femprep.report.pictures.colours import structure_colour
from femprep.report.pictures.long_axes import long_axis
from femprep.report.pictures.overlay import Drawing, Overlay, runs

#: Room around the labels, mm; width of a picture, pixels of the screen.
_ROOM: Final = 12.0
_WIDTH: Final = 300
#: Colours of shifts along the first and the second axis.
_AXES: Final = ("#4a78a8", "#c2703d")


def view_pictures(seg: Segmentation, over: Overlay) -> list[str]:
    """One SVG a view, base up: its labels, the cut of each surface and lines where slices with labels cross it."""
    return [_view_picture(seg, view, over) for view in seg.views if view.shown]


def crossing(corners: FloatArray, height: FloatArray) -> FloatArray:
    """Where a plane crosses a rectangle: corners ``(4, 2)`` in turn, their heights over the plane; ``(k, 2, 2)``."""
    cut, segments = level_segments(corners, np.array([[0, 1, 2], [0, 2, 3]]), height - 1e-9)
    return np.asarray(cut[segments])


def _view_picture(seg: Segmentation, view: PlaneView, over: Overlay) -> str:
    up = view.axes.T @ long_axis(seg)
    masks = {name: view.mask(name) for name in view.shown}
    # Rows go down from the base, which is the way pictures are written.
    turned = abs(up[0]) > abs(up[1])
    axes, spacing = (view.axes[:, ::-1], view.spacing[::-1]) if turned else (view.axes, view.spacing)
    down = -1.0 if up[0 if turned else 1] > 0.0 else 1.0
    masks = {name: mask.T if turned else mask for name, mask in masks.items()}
    masks = {name: mask[:, ::-1] if down < 0.0 else mask for name, mask in masks.items()}
    shape = next(iter(masks.values())).shape
    origin = view.origin + (axes[:, 1] * spacing[1] * (shape[1] - 1) if down < 0.0 else 0.0)
    axes = axes * [1.0, down]
    seen = np.argwhere(np.any(list(masks.values()), axis=0))
    low = np.maximum(seen.min(axis=0) - np.ceil(_ROOM / spacing).astype(int), 0)
    high = np.minimum(seen.max(axis=0) + 1 + np.ceil(_ROOM / spacing).astype(int), shape)
    drawing = Drawing(low - 0.5, (high - low).astype(np.float64), spacing)
    for name, mask in masks.items():
        if path := runs(mask[low[0] : high[0], low[1] : high[1]]):
            drawing.fill("labels", path, structure_colour(name))
    for name, (points, triangles) in over.surfaces.items():
        cut, segments = level_segments(points, triangles, (points - view.origin) @ view.normal - 1e-9)
        drawing.outline(name, ((cut - origin) @ axes / spacing)[segments])
    box = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]]) - 0.5
    level = seg.grid.to_index(origin + (box * spacing) @ axes.T)[:, seg.stack_axis]
    for k in np.flatnonzero(np.moveaxis(seg.labels, seg.stack_axis, 0).any(axis=(1, 2))).tolist():
        drawing.plane(crossing(box, level - k))
    return drawing.svg(_WIDTH, f"long-axis view {view.name}", view.name)


def shift_chart(record: Mapping[str, Any]) -> str:
    """Shifts by slice along both in-plane axes, with bars of one standard deviation, as SVG."""
    slices = record["slices"]
    shift = np.array([one["shift"] for one in slices])
    deviation = np.array([one["deviation"] for one in slices])
    most = max(1.0, float(np.ceil((np.abs(shift) + deviation[:, None]).max())))
    across = 40.0 + 300.0 * (np.arange(len(slices)) + 0.5) / len(slices)
    parts = [
        f'<path d="M40 {70 - 60 * level / most:.1f}h300" stroke="#ddd"/>'
        f'<text x="34" y="{73 - 60 * level / most:.1f}" font-size="9" text-anchor="end">{level:+.0f}</text>'
        for level in (-most, 0.0, most)
    ]
    for a, shade in enumerate(_AXES):
        for x, y, d in zip(across + 5.0 * (a - 0.5), 70.0 - 60.0 * shift[:, a] / most, 60.0 * deviation / most):
            parts.append(f'<path d="M{x:.1f} {y - d:.1f}v{2 * d:.1f}" stroke="{shade}"/>')
            parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{shade}"/>')
    numbers = [
        f'<text x="{x:.1f}" y="142" font-size="9" text-anchor="middle">{one["slice"]}</text>'
        for x, one in zip(across, slices)
    ]
    legend = "".join(
        f'<text x="{40 + 100 * a}" y="156" font-size="9.5" fill="{shade}">{name} in-plane axis</text>'
        for a, (name, shade) in enumerate(zip(("first", "second"), _AXES))
    )
    return (
        '<svg viewBox="0 0 350 162" width="520" role="img" aria-label="shift of each slice, mm">'
        f"{''.join(parts + numbers)}{legend}"
        '<text x="340" y="156" font-size="9.5" text-anchor="end">mm, by slice</text></svg>'
    )
