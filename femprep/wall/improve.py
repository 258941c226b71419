"""A clipped Sheet in, better triangles out: vertices slide along the surface, edges flip; the surface stays.

Only the neighbourhood of the rim and of poor triangles is touched, so that the template stays as it was elsewhere.
"""

from __future__ import annotations

import numpy as np

from femprep.geometry.triangles import area_vectors, areas, normals, triangle_quality
from femprep.model import FloatArray, IntArray
from femprep.wall.sheet import BoolArray, Sheet

#: Rings of vertices around the rim that may move; triangles below this Q, with the ring around them, may move too.
_RINGS, _POOR = 3, 0.5
#: Share of the way to the middle of the neighbours that one sweep goes.
_RELAX = 0.6
#: An edge flips only where both triangles lie nearly in one plane (cosine of the angle between normals).
_FLAT = 0.9


def improve(sheet: Sheet, sweeps: int = 8) -> None:
    """Slide vertices and flip edges near the rim until the least triangle quality there rises no more.

    Parameters
    ----------
    sheet : Sheet
        Changed in place. Rim vertices stay in their plane and on the surface.
    sweeps : int
        Most sweeps of sliding.
    """
    active = _active(sheet)
    for _ in range(sweeps):
        _flip(sheet, active)
        if not _slide(sheet, active):
            break
    _flip(sheet, active)


def _active(sheet: Sheet) -> BoolArray:
    """Vertices that may move: some rings around the rim and around poor triangles."""
    active = sheet.on_plane >= 0
    poor = triangle_quality(sheet.points, sheet.triangles) < _POOR
    active[sheet.triangles[poor]] = True
    for _ in range(_RINGS):
        active[sheet.triangles[active[sheet.triangles].any(axis=1)]] = True
    return active


def _slide(sheet: Sheet, active: BoolArray) -> bool:
    """Move active vertices towards the middle of their neighbours, as far as no triangle around gets worse than the worst."""
    which = np.flatnonzero(active)
    wanted = _middle(sheet)[which] - sheet.points[which]
    near = active[sheet.triangles].any(axis=1)
    triangles = sheet.triangles[near]
    before_points, before_directions = sheet.points.copy(), sheet.directions.copy()
    normal = normals(before_points, triangles)
    before = _worst(triangle_quality(before_points, triangles), triangles, len(sheet.points))
    sheet.slide(which, _RELAX * wanted)
    for _ in range(4):
        quality = triangle_quality(sheet.points, triangles)
        # A triangle that turned over is worse than any.
        turned = np.einsum("ij,ij->i", area_vectors(sheet.points, triangles), normal) <= 0
        quality[turned] = -1.0
        after = _worst(quality, triangles, len(sheet.points))
        back = active & (after < before) & (after < _POOR + 0.1)
        if not back.any():
            break
        sheet.points[back], sheet.directions[back] = before_points[back], before_directions[back]
    else:
        # The vertices around those that went back no longer fit: none of their triangles may stay worse.
        bad = (triangle_quality(sheet.points, triangles) < before[triangles].min(axis=1)) | (
            np.einsum("ij,ij->i", area_vectors(sheet.points, triangles), normal) <= 0
        )
        while bad.any():
            back = np.unique(triangles[bad])
            if np.array_equal(sheet.points[back], before_points[back]):
                break
            sheet.points[back], sheet.directions[back] = before_points[back], before_directions[back]
            bad = (triangle_quality(sheet.points, triangles) < before[triangles].min(axis=1) - 1e-12) | (
                np.einsum("ij,ij->i", area_vectors(sheet.points, triangles), normal) <= 0
            )
    return bool(np.abs(sheet.points - before_points).max(initial=0.0) > 1e-3)


def _worst(quality: FloatArray, triangles: IntArray, count: int) -> FloatArray:
    """Least quality around each vertex."""
    worst = np.full(count, np.inf)
    np.minimum.at(worst, triangles.ravel(), np.repeat(quality, 3))
    return worst


def _middle(sheet: Sheet) -> FloatArray:
    """Where each vertex would like to be: the centre of area around it; on the rim midway between its neighbours."""
    size = areas(sheet.points, sheet.triangles)
    centre = sheet.points[sheet.triangles].mean(axis=1)
    total = np.bincount(sheet.triangles.ravel(), weights=np.repeat(size, 3), minlength=len(sheet.points))
    middle = (
        np.stack(
            [
                np.bincount(
                    sheet.triangles.ravel(), weights=np.repeat(size * centre[:, k], 3), minlength=len(sheet.points)
                )
                for k in range(3)
            ],
            axis=1,
        )
        / np.maximum(total, 1e-300)[:, None]
    )
    t = sheet.triangles
    directed = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    key = directed[:, 0] * len(sheet.points) + directed[:, 1]
    rim = directed[~np.isin(directed[:, 1] * len(sheet.points) + directed[:, 0], key)]
    total_rim = np.zeros_like(middle)
    np.add.at(total_rim, rim[:, 0], 0.5 * sheet.points[rim[:, 1]])
    np.add.at(total_rim, rim[:, 1], 0.5 * sheet.points[rim[:, 0]])
    middle[rim.ravel()] = total_rim[rim.ravel()]
    return middle


def _flip(sheet: Sheet, active: BoolArray) -> None:
    """Flip edges between active vertices where the worse of the two triangles gains."""
    t = sheet.triangles
    local = np.flatnonzero(active[t].all(axis=1))
    side: dict[tuple[int, int], int] = {}
    for k in local.tolist():
        a, b, c = t[k].tolist()
        side[a, b] = side[b, c] = side[c, a] = k
    taken = {(int(a), int(b)) for a, b in np.sort(t[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)}
    pairs = [(a, b) for a, b in side if a < b and (b, a) in side]
    if not pairs:
        return
    # Judge all edges at once, then flip the best ones whose triangles are still untouched.
    ends = np.array(pairs)
    left = np.array([side[a, b] for a, b in pairs])
    right = np.array([side[b, a] for a, b in pairs])
    c = t[left].sum(axis=1) - ends.sum(axis=1)
    d = t[right].sum(axis=1) - ends.sum(axis=1)
    one = np.stack([c, d, ends[:, 1]], axis=1)
    other = np.stack([d, c, ends[:, 0]], axis=1)
    p = sheet.points
    now = np.minimum(triangle_quality(p, t[left]), triangle_quality(p, t[right]))
    then = np.minimum(triangle_quality(p, one), triangle_quality(p, other))
    before = normals(p, t[left]), normals(p, t[right])
    after = normals(p, one), normals(p, other)
    flat = np.einsum("ij,ij->i", *before) > _FLAT
    for x in before:
        for y in after:
            flat &= np.einsum("ij,ij->i", x, y) > _FLAT
    gain = np.where(flat, then - now, -1.0)
    touched: set[int] = set()
    for i in np.argsort(-gain, kind="stable").tolist():
        if gain[i] <= 0.02:
            break
        pair = (int(min(c[i], d[i])), int(max(c[i], d[i])))
        if left[i] in touched or right[i] in touched or pair in taken:
            continue
        t[left[i]], t[right[i]] = one[i], other[i]
        touched.update((int(left[i]), int(right[i])))
        taken.add(pair)
        taken.discard((int(ends[i, 0]), int(ends[i, 1])))
