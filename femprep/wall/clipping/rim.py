"""Clipped surfaces in, the same with finer rims where two come near: so that the cap between them has no slivers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.topology import border_edges
from femprep.model import FloatArray, IntArray
from femprep.model.products import unit_vectors
from femprep.wall.clipping.clipped_surface import LEAST_QUALITY, ClippedSurface

#: An edge of a rim is split where it is longer than this many times its distance from the nearest other rim, and both
#: halves of its triangle are still fit for a wall: the cap beside it would be poorer than they are.
_LONG = 2.5
#: Rounds of splitting, and places along an edge at which the other rims are looked for.
_ROUNDS, _SAMPLES = 2, 5


def refine_rims(clipped_surfaces: Sequence[ClippedSurface]) -> bool:
    """Split edges of the rims that are long beside the gap to another rim in the same plane, in place.

    Parameters
    ----------
    clipped_surfaces : sequence of ClippedSurface
        New vertices lie in the middle of the edges they split, in the plane.

    Returns
    -------
    bool
        Whether any edge was split.
    """
    total = 0
    for number in range(max(len(clipped.planes) for clipped in clipped_surfaces)):
        for _ in range(_ROUNDS):
            rims = [_rim(clipped, number) for clipped in clipped_surfaces]
            split = 0
            for k, clipped in enumerate(clipped_surfaces):
                others = [
                    _places(other, rims[j]) for j, other in enumerate(clipped_surfaces) if j != k and len(rims[j])
                ]
                if len(rims[k]) and others:
                    split += _split(clipped, number, rims[k], cKDTree(np.concatenate(others)))
            total += split
            if not split:
                break
    return total > 0


def _rim(clipped: ClippedSurface, number: int) -> IntArray:
    edges = border_edges(clipped.triangles)
    return np.asarray(edges[(clipped.on_plane[edges] == number).all(axis=1)])


def _places(clipped: ClippedSurface, edges: IntArray) -> FloatArray:
    share = np.linspace(0.0, 1.0, _SAMPLES, endpoint=False)[:, None, None]
    ends = clipped.points[edges]
    return np.asarray(((1.0 - share) * ends[:, 0] + share * ends[:, 1]).reshape(-1, 3))


def _split(clipped: ClippedSurface, number: int, edges: IntArray, others: cKDTree) -> int:
    """Split the long edges of one rim; how many there were."""
    ends = clipped.points[edges]
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    gap = np.asarray(others.query(_places(clipped, edges))[0]).reshape(_SAMPLES, -1).min(axis=0)
    edges = edges[(length > _LONG * gap) & (_halves(clipped, edges) > LEAST_QUALITY)]
    if not len(edges):
        return 0
    middle = clipped.plane_of(number).feet(clipped.points[edges].mean(axis=1))
    first = len(clipped.points)
    clipped.add(middle, unit_vectors(clipped.directions[edges].mean(axis=1)), number)
    new = {(int(a), int(b)): first + i for i, (a, b) in enumerate(edges)}
    rows: list[tuple[int, int, int]] = []
    for row in clipped.triangles.tolist():
        rows += _pieces((row[0], row[1], row[2]), new)
    clipped.triangles = np.array(rows, dtype=np.int64)
    return len(edges)


def _halves(clipped: ClippedSurface, edges: IntArray) -> FloatArray:
    """Quality of the poorer half of the triangle at each edge, were the edge split."""
    t = clipped.triangles
    opposite = {(a, b): c for a, b, c in np.concatenate([t, np.roll(t, 1, axis=1), np.roll(t, 2, axis=1)]).tolist()}
    a, b = clipped.points[edges[:, 0]], clipped.points[edges[:, 1]]
    c = clipped.points[[opposite[u, v] for u, v in edges.tolist()]]
    corner = np.concatenate([a, 0.5 * (a + b), b, c])
    one, middle, other, top = np.arange(4 * len(edges)).reshape(4, -1)
    halves = (np.stack(rows, axis=1) for rows in ((one, middle, top), (middle, other, top)))
    return np.asarray(np.minimum(*(triangle_quality(corner, half) for half in halves)))


def _pieces(triangle: tuple[int, int, int], new: dict[tuple[int, int], int]) -> list[tuple[int, int, int]]:
    """A triangle, or its pieces where sides of it are split; of two split sides, one after the other."""
    a, b, c = triangle
    for u, v, w in ((a, b, c), (b, c, a), (c, a, b)):
        if (u, v) in new:
            m = new[u, v]
            return [*_pieces((u, m, w), new), *_pieces((m, v, w), new)]
    return [triangle]
