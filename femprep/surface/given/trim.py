"""A surface and a plane in, the part below the plane out, its rim in the plane along edges.

Vertices next to the plane are moved onto it: a cut a little beyond the base may move what is cut away again, and leaves
neither slivers nor new vertices.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from femprep.mesh.measures.triangles import areas, edge_lengths
from femprep.mesh.topology import border_loops, edge_table, pieces, pinched_vertices
from femprep.model import Plane, Surface

#: How far beyond the base a surface is kept, mm, and in mean edges.
_BEYOND: Final = 4.0
_EDGES: Final = 1.5


def trimmed(surface: Surface, base: Plane) -> Surface:
    """A surface without what lies far beyond its base: outflow tracts, atria, caps.

    Parameters
    ----------
    surface : Surface
        Triangles, mm.
    base : Plane

    Returns
    -------
    Surface
        As it was where it reaches little beyond the base, or nothing sound is left of it.
    """
    points, cells = surface.points, surface.triangles
    edge = float(edge_lengths(points, cells).mean())
    margin = max(_BEYOND, _EDGES * edge)
    away = base.signed_distance(points) - margin
    if away.max() <= edge or away.min() >= -edge:
        return surface
    edges = edge_table(cells).nodes
    crossing = edges[away[edges[:, 0]] * away[edges[:, 1]] < 0.0]
    near = np.abs(away[crossing])
    first = near[:, 0] <= near[:, 1]
    moved = np.where(first, crossing[:, 0], crossing[:, 1])
    share = near / near.sum(axis=1, keepdims=True)
    at = share[:, 1:] * points[crossing[:, 0]] + share[:, :1] * points[crossing[:, 1]]
    count = np.bincount(moved, minlength=len(points))
    total = np.zeros_like(points)
    np.add.at(total, moved, at)
    here = count > 0
    points = np.where(here[:, None], total / np.maximum(count, 1)[:, None], points)
    away = np.where(here, 0.0, away)
    kept = cells[(away[cells] <= 0.0).all(axis=1) & (away[cells] < 0.0).any(axis=1)]
    piece = pieces(kept)
    kept = kept[piece == np.argmax(np.bincount(piece, areas(points, kept)))]
    if len(pinched_vertices(kept)) or not border_loops(kept):
        return surface
    used, cells = np.unique(kept, return_inverse=True)
    return replace(surface, points=points[used], cells=cells.reshape(-1, 3), directions=None, shape=None, point_data={})
