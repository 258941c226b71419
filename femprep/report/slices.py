"""Slices of a label map with the mesh drawn over them, as SVG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from femprep.image import Segmentation
from femprep.model import FloatArray, IntArray
from femprep.report.colours import colour

#: Fill of each structure.
FILLS = ("#cfe3f5", "#f7d9cf", "#d5ecd4", "#eee3c0", "#e3d5ee")
_OFF = "#ff0000"


def plane_cut(points: FloatArray, triangles: IntArray, height: FloatArray) -> FloatArray:
    """Segments in which a triangle surface meets the zero level of a height given per point.

    Parameters
    ----------
    points : (n, 3) array
    triangles : (m, 3) array
    height : (n,) array
        Signed distance from the plane; zero counts as above.

    Returns
    -------
    (k, 2, 3) array
        End points of the segments.
    """
    above = height[triangles] >= 0.0
    crossed = triangles[(above.sum(axis=1) % 3) != 0]
    above = height[crossed] >= 0.0
    # The one corner that lies alone on its side of the plane comes first; the cut runs through its two edges.
    alone = np.argmax(above == (above.sum(axis=1) == 1)[:, None], axis=1)
    order = (alone[:, None] + np.arange(3)) % 3
    corner = np.take_along_axis(crossed, order, axis=1)
    ends = []
    for other in (1, 2):
        a, b = corner[:, 0], corner[:, other]
        t = height[a] / (height[a] - height[b])
        ends.append(points[a] + t[:, None] * (points[b] - points[a]))
    return np.stack(ends, axis=1)


def slice_pictures(
    seg: Segmentation,
    surfaces: Mapping[str, tuple[FloatArray, IntArray]],
    width: int = 220,
    *,
    off: Sequence[FloatArray] = (),
) -> list[str]:
    """One SVG a slice: the structures filled, the cut of each surface drawn over them.

    Parameters
    ----------
    seg : Segmentation
    surfaces : mapping of str to (points, triangles)
        mm LPS.
    width : int
        Width of a picture, pixels of the screen.
    off : sequence of (n, 3) arrays
        Points that lie off the labels, mm LPS: drawn as dots in the slice they lie in.

    Returns
    -------
    list of str
        SVG elements from the first slice that holds a label to the last.
    """
    axis = seg.stack_axis
    across = [a for a in range(3) if a != axis]
    # A preset may name structures that this map does not hold; their masks are empty.
    masks = {name: np.moveaxis(np.isin(seg.labels, labels), axis, 2) for name, labels in seg.structures.items()}
    spacing = np.asarray(seg.grid.spacing, dtype=float)[across]
    everything = np.any(np.stack(list(masks.values())), axis=0)
    if not everything.any():
        return []
    low, high = _box(everything)
    indices = {name: seg.grid.to_index(points) for name, (points, _) in surfaces.items()}
    dots = seg.grid.to_index(np.concatenate(off)) if sum(map(len, off)) else np.empty((0, 3))
    pictures = []
    for k in range(low[2], high[2]):
        body = []
        for fill, mask in zip(FILLS, masks.values()):
            path = _runs(mask[low[0] : high[0], low[1] : high[1], k])
            body.append(f'<path d="{path}" fill="{fill}"/>')
        for name, (_, triangles) in surfaces.items():
            stroke, index = colour(name), indices[name]
            segments = plane_cut(index, triangles, index[:, axis] - (k + 1e-9))[:, :, across] - low[:2] + 0.5
            path = "".join(f"M{a[0]:.2f} {a[1]:.2f}L{b[0]:.2f} {b[1]:.2f}" for a, b in segments)
            body.append(f'<path d="{path}" stroke="{stroke}" fill="none" vector-effect="non-scaling-stroke"/>')
        path = "".join(f"M{a:.1f} {b:.1f}h0" for a, b in dots[np.rint(dots[:, axis]) == k][:, across] - low[:2] + 0.5)
        if path:
            body.append(
                f'<path d="{path}" stroke="{_OFF}" stroke-width="4" stroke-linecap="round" fill="none" '
                'vector-effect="non-scaling-stroke"/>'
            )
        size = (high - low)[:2] * spacing
        pictures.append(
            f'<svg viewBox="0 0 {size[0]:.2f} {size[1]:.2f}" width="{width}" role="img" aria-label="slice {k}">'
            f'<g transform="scale({spacing[0]:.5f} {spacing[1]:.5f})" stroke-width="1.4">{"".join(body)}</g>'
            f'<text x="2" y="8" font-size="7">{k}</text></svg>'
        )
    return pictures


def _box(mask: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
    """First and last (exclusive) index of what is set, with a margin of 3 pixels within a slice."""
    margin = np.array([3, 3, 0])
    found = np.argwhere(mask)
    low = np.maximum(found.min(axis=0) - margin, 0)
    high = np.minimum(found.max(axis=0) + 1 + margin, mask.shape)
    return low, high


def _runs(mask: npt.NDArray[np.bool_]) -> str:
    """SVG path of a 2-D mask: one rectangle for each run of pixels."""
    padded = np.pad(mask.T.astype(np.int8), ((0, 0), (1, 1)))
    column, edge = np.nonzero(np.diff(padded, axis=1))  # the first pixel of a run and the first behind it, by turns
    runs = zip(column[::2].tolist(), edge[::2].tolist(), edge[1::2].tolist())
    return "".join(f"M{a} {j}h{b - a}v1h{a - b}z" for j, a, b in runs)
