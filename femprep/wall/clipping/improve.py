"""A clipped surface in, better triangles out: vertices slide along the surface, edges flip; the surface stays.

Only the neighbourhood of the rim and of poor triangles is touched, so that the template stays as it was elsewhere.
"""

from __future__ import annotations

import numpy as np

from femprep.mesh.measures.triangles import area_vectors, areas, edge_lengths, normals, triangle_quality, vertex_sums
from femprep.mesh.operations.flips import around_edges
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import border_edges, edge_table
from femprep.model import BoolArray, FloatArray, IntArray, SphereMap
from femprep.wall.clipping.clipped_surface import ClippedSurface, reach

#: Rings of vertices around the rim that may move; triangles below this Q, with the ring around them, may move too.
_RINGS, _POOR = 3, 0.5
#: Share of the way to the middle of the neighbours that one sweep goes.
_RELAX = 0.6
#: How far vertices may leave the surface as it was behind, in mean edge lengths: those that hold a sharp edge slide to
#: either side of it, and triangles cut it off. They, and the ring around them, stay then; tries.
_CUT_OFF, _TRIES = 0.12, 4
#: An edge flips only where both triangles lie nearly in one plane (cosine of the angle between normals).
_FLAT = 0.9


def improve(clipped: ClippedSurface, sweeps: int = 8) -> None:
    """Slide vertices and flip edges near the rim until the least triangle quality there rises no more.

    Parameters
    ----------
    clipped : ClippedSurface
        Changed in place. Rim vertices stay in their plane and on the surface.
    sweeps : int
        Most sweeps of sliding.
    """
    points, directions, triangles = clipped.points.copy(), clipped.directions.copy(), clipped.triangles.copy()
    farthest = _CUT_OFF * float(edge_lengths(points, triangles).mean())
    active = _active(clipped)
    for _ in range(_TRIES):
        _improve(clipped, active, sweeps)
        cut = ClosestFinder(clipped.points, clipped.triangles)(points).distance > farthest
        if not (cut & active).any():
            return
        cut[triangles[cut[triangles].any(axis=1)]] = True
        active &= ~cut
        clipped.points, clipped.directions, clipped.triangles = points.copy(), directions.copy(), triangles.copy()
    _improve(clipped, active, sweeps)


def _improve(clipped: ClippedSurface, active: BoolArray, sweeps: int) -> None:
    for _ in range(sweeps):
        _flip(clipped, active)
        if not _slide(clipped, active):
            break
    _flip(clipped, active)


def onto_exact(clipped: ClippedSurface, shape: SphereMap, moved: BoolArray) -> None:
    """Put vertices that slid by the sampled surface onto the exact one, those of a rim onto exact surface and plane.

    Parameters
    ----------
    clipped : ClippedSurface
        Changed in place.
    shape : SphereMap
        The exact surface.
    moved : (n,) array
        The vertices to settle. Where that would turn a triangle over or make it poor, they stay.
    """
    which = np.flatnonzero(moved)
    if not len(which):
        return
    points, directions = clipped.points.copy(), clipped.directions.copy()
    triangles = clipped.triangles[moved[clipped.triangles].any(axis=1)]
    normal = normals(points, triangles)
    limit = np.minimum(triangle_quality(points, triangles), _POOR)
    clipped.points[which] = shape(directions[which])
    for number in range(len(clipped.planes)):
        rim = np.flatnonzero(moved & (clipped.on_plane == number))
        found, place, there = reach(clipped.smooth, clipped.plane_of(number), directions[rim], exact=shape)
        clipped.points[rim] = np.where(found[:, None], place, points[rim])
        clipped.directions[rim] = np.where(found[:, None], there, directions[rim])
    _undo(clipped, moved, triangles, points, directions, normal, limit)


def _active(clipped: ClippedSurface) -> BoolArray:
    """Vertices that may move: some rings around the rim and around poor triangles."""
    active = clipped.on_plane >= 0
    poor = triangle_quality(clipped.points, clipped.triangles) < _POOR
    active[clipped.triangles[poor]] = True
    for _ in range(_RINGS):
        active[clipped.triangles[active[clipped.triangles].any(axis=1)]] = True
    return active


def _slide(clipped: ClippedSurface, active: BoolArray) -> bool:
    """Move active vertices towards the middle of their neighbours; no triangle gets worse than the worst around it."""
    which = np.flatnonzero(active)
    triangles = clipped.triangles[active[clipped.triangles].any(axis=1)]
    points, directions = clipped.points.copy(), clipped.directions.copy()
    normal = normals(points, triangles)
    limit = _worst(triangle_quality(points, triangles), triangles, len(points))[triangles].min(axis=1)
    clipped.slide(which, _RELAX * (_middle(clipped)[which] - points[which]))
    _undo(clipped, active, triangles, points, directions, normal, np.minimum(limit, _POOR + 0.1))
    return bool(np.abs(clipped.points - points).max(initial=0.0) > 1e-3)


def _undo(
    clipped: ClippedSurface,
    moved: BoolArray,
    triangles: IntArray,
    points: FloatArray,
    directions: FloatArray,
    normal: FloatArray,
    limit: FloatArray,
) -> None:
    """Move vertices back, and more of them, until no triangle is turned over or below its limit of quality."""
    moved = moved.copy()
    while moved.any():
        quality = triangle_quality(clipped.points, triangles)
        turned = np.einsum("ij,ij->i", area_vectors(clipped.points, triangles), normal) <= 0
        back = np.zeros_like(moved)
        back[triangles[turned | (quality < limit)]] = True
        back &= moved
        if not back.any():
            break
        clipped.points[back], clipped.directions[back] = points[back], directions[back]
        moved &= ~back


def _worst(quality: FloatArray, triangles: IntArray, count: int) -> FloatArray:
    """Least quality around each vertex."""
    worst = np.full(count, np.inf)
    np.minimum.at(worst, triangles.ravel(), np.repeat(quality, 3))
    return worst


def _middle(clipped: ClippedSurface) -> FloatArray:
    """Where each vertex would like to be: the centre of area around it; on the rim midway between its neighbours."""
    size = areas(clipped.points, clipped.triangles)
    centre = clipped.points[clipped.triangles].mean(axis=1)
    own, count = clipped.triangles, len(clipped.points)
    middle = np.stack([vertex_sums(size * centre[:, k], own, count) for k in range(3)], axis=1)
    middle /= np.maximum(vertex_sums(size, own, count), 1e-300)[:, None]
    rim = border_edges(clipped.triangles)
    total_rim = np.zeros_like(middle)
    np.add.at(total_rim, rim[:, 0], 0.5 * clipped.points[rim[:, 1]])
    np.add.at(total_rim, rim[:, 1], 0.5 * clipped.points[rim[:, 0]])
    middle[rim.ravel()] = total_rim[rim.ravel()]
    return middle


def _flip(clipped: ClippedSurface, active: BoolArray) -> None:
    """Flip edges between active vertices where the worse of the two triangles gains."""
    t = clipped.triangles
    local = np.flatnonzero(active[t].all(axis=1))
    pairs, corners = around_edges(t[local], edge_table(t[local]))
    (left, right), (a, b, c, d) = local[pairs].T, corners.T
    # Judge all edges at once, then flip the best ones whose triangles are still untouched.
    one, other = np.stack([c, d, b], axis=1), np.stack([d, c, a], axis=1)
    p = clipped.points
    now = np.minimum(triangle_quality(p, t[left]), triangle_quality(p, t[right]))
    then = np.minimum(triangle_quality(p, one), triangle_quality(p, other))
    before = normals(p, t[left]), normals(p, t[right])
    after = normals(p, one), normals(p, other)
    flat = np.einsum("ij,ij->i", *before) > _FLAT
    for x in before:
        for y in after:
            flat &= np.einsum("ij,ij->i", x, y) > _FLAT
    # The new edge must not be there already: that would fold two triangles onto each other.
    near = t[active[t].any(axis=1)]
    count = len(p)
    there = edge_table(near).nodes @ np.array([count, 1])
    new = np.minimum(c, d) * count + np.maximum(c, d)
    allowed = flat & ~np.isin(new, there)
    # Nor may a triangle come to lie in the plane, with three corners on the rim.
    for corner in (one, other):
        on = clipped.on_plane[corner]
        allowed &= ~((on[:, 0] >= 0) & (on == on[:, :1]).all(axis=1))
    gain = np.where(allowed, then - now, -1.0)
    touched: set[int] = set()
    made: set[int] = set()
    for i in np.argsort(-gain, kind="stable").tolist():
        if gain[i] <= 0.02:
            break
        if left[i] in touched or right[i] in touched or int(new[i]) in made:
            continue
        t[left[i]], t[right[i]] = one[i], other[i]
        touched.update((int(left[i]), int(right[i])))
        made.add(int(new[i]))
