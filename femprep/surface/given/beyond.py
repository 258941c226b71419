"""An open surface in, the same continued smoothly beyond each of its rims until it is closed, out.

What is added is cut away again at the base: it only has to leave the rim in the direction in which the surface arrives
there, so that a template laid on both does not feel the rim, and to cross nothing. The rim shrinks like a curve that
moves by its curvature, which never crosses itself [1]_, while it rises.

References
----------
.. [1] Grayson, The heat equation shrinks embedded plane curves to round points, J. Differential Geom. 26(2), 1987.
   doi:10.4310/jdg/1214441371
"""

from __future__ import annotations

from itertools import pairwise
from typing import Final

import numpy as np

from femprep.mesh.topology import border_edges, border_loops
from femprep.model import FloatArray, IntArray

#: Height of what is added over the rim's mean radius, and rows of it at least and at most.
_HEIGHT: Final = 0.7
_ROWS: Final = (8, 40)
#: The direction in which the surface arrives is kept over this share of the height, and is no flatter than this slope.
_KEPT: Final = 0.25
_SLOPE: Final = 1.0


def closed_beyond(points: FloatArray, cells: IntArray) -> tuple[FloatArray, IntArray]:
    """Close each rim of a surface by a smooth dome.

    Parameters
    ----------
    points : (n, 3) array
        mm.
    cells : (m, 3) array
        Triangles wound outward.

    Returns
    -------
    points, cells
        The old ones first.
    """
    for loop in border_loops(cells):
        added, more = _dome(points, cells, loop)
        points, cells = np.concatenate([points, added]), np.concatenate([cells, more])
    return points, cells


def _dome(points: FloatArray, cells: IntArray, loop: IntArray) -> tuple[FloatArray, IntArray]:
    rim = points[loop]
    count = len(loop)
    middle = rim.mean(axis=0)
    # The rim's own area vector: its triangles run along it so that this leads out of what they enclose.
    up = -0.5 * np.cross(rim - middle, np.roll(rim, -1, axis=0) - middle).sum(axis=0)
    up /= np.linalg.norm(up)
    first = np.linalg.svd(np.eye(3) - np.outer(up, up))[0][:, 0]
    frame = np.stack([first, np.cross(up, first)])
    flat = (rim - middle) @ frame.T
    area = _area(flat)
    radius = float(np.sqrt(abs(area) / np.pi))
    height = _HEIGHT * radius
    rows = int(np.clip(round(height / np.linalg.norm(np.roll(rim, -1, axis=0) - rim, axis=1).mean()), *_ROWS))
    slope = _slopes(points, cells, loop, up, frame)
    level = (rim - middle) @ up
    ring, low, new = flat, 0.0, []
    for row in range(1, rows):
        # As on a quarter of an ellipse: rows are even along its arc.
        now = float(np.sin(0.5 * np.pi * row / rows))
        share = float(np.cos(0.5 * np.pi * row / rows))
        step = (now - low) * height
        ring = ring + step * np.exp(-now / _KEPT) * slope
        for _ in range(1 + row):
            ring = 0.5 * ring + 0.25 * (np.roll(ring, 1, axis=0) + np.roll(ring, -1, axis=0))
        at = ring.mean(axis=0)
        wanted = abs(area) * share**2
        held = float(np.exp(-now / _KEPT))  # near the rim the slope tells how wide the ring is
        size = float(np.sqrt(wanted / max(abs(_area(ring)), 1e-12)))
        ring = at + (held + (1.0 - held) * min(size, 1.0 / max(1e-3, share))) * (ring - at)
        new.append(middle + ring @ frame + (now * height + (1.0 - now) * level)[:, None] * up)
        low = now
    top = middle + ring.mean(axis=0) @ frame + height * up
    added = np.concatenate([*new, top[None]])
    start = len(points)
    rings = [loop, *(start + k * count + np.arange(count) for k in range(rows - 1))]
    more = []
    for lower, upper in pairwise(rings):
        a, b, c, d = lower, np.roll(lower, -1), upper, np.roll(upper, -1)
        more += [np.stack([b, a, c], axis=1), np.stack([b, c, d], axis=1)]
    last = rings[-1]
    more.append(np.stack([np.roll(last, -1), last, np.full(count, start + len(added) - 1)], axis=1))
    return added, np.concatenate(more)


def _area(ring: FloatArray) -> float:
    x, y = ring.T
    return float(0.5 * (x @ np.roll(y, -1) - np.roll(x, -1) @ y))


def _slopes(points: FloatArray, cells: IntArray, loop: IntArray, up: FloatArray, frame: FloatArray) -> FloatArray:
    """How far sideways ``(n, 2)`` the surface runs per height where it arrives at its rim, smoothed along it."""
    edges = {(a, b) for a, b in border_edges(cells).tolist()}
    place = {int(v): k for k, v in enumerate(loop)}
    tangent = np.zeros((len(loop), 3))
    for a, b, c in cells[np.isin(cells, loop).sum(axis=1) >= 2].tolist():
        for u, v, w in ((a, b, c), (b, c, a), (c, a, b)):
            if (u, v) in edges and u in place and v in place:
                along = points[v] - points[u]
                inward = points[w] - points[u]
                inward = inward - (inward @ along) / max(float(along @ along), 1e-300) * along
                out = -inward / max(float(np.linalg.norm(inward)), 1e-300)
                tangent[place[u]] += out
                tangent[place[v]] += out
    for _ in range(3):
        tangent = 0.5 * tangent + 0.25 * (np.roll(tangent, 1, axis=0) + np.roll(tangent, -1, axis=0))
    rise = np.maximum(tangent @ up, 1e-6 * np.linalg.norm(tangent, axis=1) + 1e-12)
    side = (tangent @ frame.T) / rise[:, None]
    steep = np.linalg.norm(side, axis=1)
    return np.asarray(side * np.minimum(1.0, _SLOPE / np.maximum(steep, 1e-12))[:, None])
