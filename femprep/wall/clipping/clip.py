"""A closed template surface and planes in, an open clipped surface out whose rims run along edges, without slivers.

A plain cut through a triangulation leaves needles wherever the plane passes close to a vertex. So vertices near the
plane are first moved onto it along the surface, and only the edges that still cross it are cut, away from their ends.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femprep.errors import InputError
from femprep.mesh.measures.triangles import triangle_quality
from femprep.mesh.topology import border_edges, edge_table, loops_of
from femprep.model import FloatArray, IntArray, Plane, Surface
from femprep.model.blocks import numbers_among
from femprep.model.notice import spot
from femprep.model.products import unit_vectors
from femprep.options.advice import GIVE_BASE, MOVE_BASE
from femprep.wall.clipping.clipped_surface import ClippedSurface, reach
from femprep.wall.clipping.sampled import SampledMap

#: A vertex is moved onto the plane where an edge crosses it within this share of the edge's length from the vertex.
SNAP = 0.33


def clip(surface: Surface, planes: Mapping[str, Plane]) -> ClippedSurface:
    """Clip a surface by planes, in their order.

    Parameters
    ----------
    surface : Surface
        Closed, with the directions of its template.
    planes : mapping of str to Plane
        By facet name; what lies on the side a normal points to is cut away.

    Returns
    -------
    ClippedSurface
        Its rim vertices lie in the planes.

    Raises
    ------
    InputError
        A plane misses the surface, cuts it in more than one loop, or meets another plane on it.
    """
    if surface.directions is None:
        raise InputError(f"surface {surface.name!r} has no template directions; make it with fit_surface")
    clipped = ClippedSurface(
        name=surface.name,
        points=surface.points.copy(),
        directions=surface.directions.copy(),
        triangles=surface.triangles.copy(),
        template=np.arange(len(surface.points)),
        on_plane=np.full(len(surface.points), -1),
        smooth=SampledMap(surface.directions, surface.points),
        planes=dict(planes),
    )
    for number, (name, plane) in enumerate(planes.items()):
        _cut(clipped, number, name, plane)
    return clipped


def _cut(clipped: ClippedSurface, number: int, name: str, plane: Plane) -> None:
    away = plane.signed_distance(clipped.points)
    inside, outside = int((away < 0).sum()), int((away > 0).sum())
    if not inside or not outside:
        side = "cuts all of it away" if not inside else "cuts nothing away"
        raise InputError(
            f"the {name} plane misses surface {clipped.name!r} and {side} (the surface lies {away.min():.2f} to "
            f"{away.max():.2f} mm from it along its normal)",
            advice=[MOVE_BASE, GIVE_BASE],
        )
    away = _snap(clipped, number, plane, away)
    away = _split(clipped, number, plane, away)
    keep = _side(clipped.triangles, away) < 0
    clipped.triangles = clipped.triangles[keep]
    _compress(clipped)
    loops = rim_loops(clipped, number)
    if len(loops) != 1:
        where = ", ".join(spot(clipped.points[loop].mean(axis=0)) for loop in loops)
        raise InputError(
            f"the {name} plane cuts surface {clipped.name!r} in {len(loops)} loops, centred at {where}; expected 1",
            advice=[MOVE_BASE, GIVE_BASE],
        )


def _side(triangles: IntArray, away: FloatArray) -> IntArray:
    """-1 for triangles on the side that is kept, +1 beyond the plane; one within the plane counts as beyond."""
    total = np.sign(away)[triangles].sum(axis=1)
    return np.where(total < 0, -1, 1)


def _snap(clipped: ClippedSurface, number: int, plane: Plane, away: FloatArray) -> FloatArray:
    """Move vertices near the plane onto it; distances of all vertices afterwards, exactly 0 on the plane."""
    away = away.copy()
    edges = edge_table(clipped.triangles).nodes
    crossing = edges[away[edges[:, 0]] * away[edges[:, 1]] < 0]
    share = np.abs(away[crossing]) / np.abs(away[crossing]).sum(axis=1, keepdims=True)
    nearest = np.full(len(away), np.inf)
    np.minimum.at(nearest, crossing.ravel(), share.ravel())
    free = clipped.on_plane < 0
    wanted = np.flatnonzero((nearest < SNAP) & free)
    if not len(wanted):
        return away
    found, points, directions = reach(clipped.smooth, plane, clipped.directions[wanted])
    length = np.linalg.norm(clipped.points[crossing[:, 0]] - clipped.points[crossing[:, 1]], axis=1).mean()
    found &= np.linalg.norm(points - clipped.points[wanted], axis=1) < length
    # A triangle with all three vertices in the plane has no side: the vertex furthest off stays where it is.
    around: dict[int, list[IntArray]] = {int(v): [] for v in wanted}
    for row in clipped.triangles[np.isin(clipped.triangles, wanted).any(axis=1)]:
        for v in row.tolist():
            if v in around:
                around[v].append(row)
    flat = away == 0.0
    for i in np.argsort(nearest[wanted], kind="stable"):
        vertex = int(wanted[i])
        if not found[i] or any(sum(bool(flat[v]) for v in row) > 1 for row in around[vertex]):
            continue
        flat[vertex] = True
        clipped.points[vertex], clipped.directions[vertex] = points[i], directions[i]
        away[vertex] = 0.0
    clipped.on_plane[flat & free] = number
    return away


def _split(clipped: ClippedSurface, number: int, plane: Plane, away: FloatArray) -> FloatArray:
    """Put a vertex where an edge still crosses the plane, and split its triangles; distances of all vertices."""
    edges = edge_table(clipped.triangles).nodes
    crossing = edges[away[edges[:, 0]] * away[edges[:, 1]] < 0]
    if (clipped.on_plane[crossing] >= 0).any():
        where = clipped.points[crossing[(clipped.on_plane[crossing] >= 0).any(axis=1)][0, 0]]
        raise InputError(f"two planes meet on surface {clipped.name!r} at {spot(where)}; move one of them")
    share = (np.abs(away[crossing[:, 0]]) / np.abs(away[crossing]).sum(axis=1))[:, None]
    ends = clipped.directions[crossing]
    start = unit_vectors((1.0 - share) * ends[:, 0] + share * ends[:, 1])
    found, points, directions = reach(clipped.smooth, plane, start)
    # Where the smooth surface runs along the plane, the point of the edge itself serves.
    chord = (1.0 - share) * clipped.points[crossing[:, 0]] + share * clipped.points[crossing[:, 1]]
    length = np.linalg.norm(clipped.points[crossing[:, 0]] - clipped.points[crossing[:, 1]], axis=1)
    found &= np.linalg.norm(points - chord, axis=1) < 0.3 * length
    points[~found] = plane.feet(chord[~found])
    directions[~found] = start[~found]
    middle = {(int(a), int(b)): len(clipped.points) + i for i, (a, b) in enumerate(crossing)}
    clipped.add(points, directions, number)
    away = np.concatenate([away, np.zeros(len(points))])
    sign = np.sign(away)[clipped.triangles]
    cut = (sign.min(axis=1) < 0) & (sign.max(axis=1) > 0)
    pieces = [
        row for triangle in clipped.triangles[cut].tolist() for row in _pieces(triangle, away, middle, clipped.points)
    ]
    whole = clipped.triangles[~cut]
    clipped.triangles = np.concatenate([whole, np.array(pieces, dtype=np.int64).reshape(-1, 3)])
    return away


def _pieces(
    triangle: list[int], away: FloatArray, middle: dict[tuple[int, int], int], points: FloatArray
) -> list[tuple[int, int, int]]:
    """Pieces of one triangle the plane passes through."""

    def between(u: int, v: int) -> int:
        return middle[(u, v) if u < v else (v, u)]

    flat = [i for i in range(3) if away[triangle[i]] == 0.0]
    if flat:  # From a vertex in the plane to the opposite side.
        a, b, c = (triangle[(flat[0] + i) % 3] for i in range(3))
        m = between(b, c)
        return [(a, b, m), (a, m, c)]
    signs = [away[v] > 0 for v in triangle]
    alone = next(i for i in range(3) if signs[i] != signs[(i + 1) % 3] and signs[i] != signs[(i + 2) % 3])
    a, b, c = (triangle[(alone + i) % 3] for i in range(3))
    ab, ac = between(a, b), between(a, c)
    first = [(ab, b, c), (ab, c, ac)]
    second = [(ab, b, ac), (b, c, ac)]
    better = triangle_quality(points, first).min() >= triangle_quality(points, second).min()
    return [(a, ab, ac), *(first if better else second)]


def _compress(clipped: ClippedSurface) -> None:
    """Drop vertices that no triangle uses; vertices in a plane that is no rim any more count as inner ones."""
    used = np.unique(clipped.triangles)
    clipped.triangles = numbers_among(used, len(clipped.points))[clipped.triangles]
    for name in ("points", "directions", "template", "on_plane"):
        setattr(clipped, name, getattr(clipped, name)[used])


def rim_loops(clipped: ClippedSurface, number: int) -> list[IntArray]:
    """Rims in one plane: each the vertices in order, as the clipped surface's triangles run along it.

    Raises
    ------
    InputError
        Two rims touch in a vertex.
    """
    open_ = border_edges(clipped.triangles)
    open_ = open_[(clipped.on_plane[open_] == number).all(axis=1)]
    twice = np.flatnonzero(np.bincount(open_[:, 0], minlength=len(clipped.points)) > 1)
    if len(twice):
        raise InputError(
            f"the rim of surface {clipped.name!r} touches itself at {spot(clipped.points[twice[0]])}",
            advice=[MOVE_BASE, GIVE_BASE],
        )
    return loops_of(open_)
