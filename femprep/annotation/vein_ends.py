"""The cut end of a vein in, the facets that are its rim out: told by the crest of the end.

A vein that was cut ends in a round rim. Going outward from where its inside meets the outside the surface rises to a
crest and falls again; the rim is what lies near the crest. Where the crest is flat the plane through it tells, as that
of the cut did; elsewhere the distance from the crest; and where no crest is found the way along the surface.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.ndimage import median_filter
from scipy.spatial import cKDTree

from femprep.annotation.shell import Shell
from femprep.mesh.tangents import tangents
from femprep.model import BoolArray, FloatArray, IntArray

#: Sectors in which the crest is looked for, how far from the inside along the surface, mm, and how far the surface
#: falls behind it, mm.
_SECTORS, _REACH, _FALL = 24, 5.0, 0.3
#: A crest is flat to within this, mm (root mean square); a sector's place is none where it is further from those beside
#: it; and there is no crest where more sectors than this have none.
_FLAT, _STRAY, _LOST = 0.25, 1.2, 1
#: The rim of a flat end lies so far below the plane of its crest at most, outside and in the cavity; that of any
#: other so near to the crest, and that without a crest so far along the surface, mm.
_BELOW, _NEAR, _ALONG = (1.25, 3.0), (2.5, 3.0), (3.5, 3.0)
#: No rim reaches further along the surface, mm.
_LIMIT: Final = 11.0


def vein_rim(shell: Shell, inside: BoolArray, apart: IntArray, outward: FloatArray) -> BoolArray:
    """Facets of the rim at the cut end of a vein.

    Parameters
    ----------
    shell : Shell
    inside : (n_facets,) array of bool
        Facets that look into the cavity.
    apart : (k,) array
        Facets beside the line that parts the vein's inside from the outside.
    outward : (3,) array
        The way out of the vein.
    """
    way = shell.along(apart, _LIMIT)
    near = np.flatnonzero(way < _LIMIT)
    rows = near[(way[near] < _REACH) & ~inside[near]]
    if len(rows) < _SECTORS:
        return way < np.where(inside, _ALONG[1], _ALONG[0])
    centre, normal = plane_along(shell.centre[apart], outward)
    for _ in range(4):
        crest, height = _crest(shell.centre[rows], way[rows], centre, normal)
        centre, normal = plane_along(crest, normal)
    crest, height = _crest(shell.centre[rows], way[rows], centre, normal)
    own = np.zeros(len(shell), dtype=bool)
    at, inner = shell.centre[near], inside[near]
    kept = np.abs(height - median_filter(height, 7, mode="wrap")) < _STRAY
    ends = crest[kept]
    steps = np.linspace(0.0, 1.0, 6)[:-1, None, None]
    line = (ends + steps * (np.roll(ends, -1, axis=0) - ends)).reshape(-1, 3)
    distance = cKDTree(line).query(at)[0]
    if np.sqrt(np.mean(height**2)) < _FLAT:
        below = np.median(height) - (at - centre) @ normal
        own[near] = below < np.where(inner, _BELOW[1], _BELOW[0])
    elif np.count_nonzero(~kept) <= _LOST:
        own[near] = distance < np.where(inner, _NEAR[1], _NEAR[0])
    else:
        own[near] = way[near] < np.where(inner, _ALONG[1], _ALONG[0])
    return own


def _crest(at: FloatArray, way: FloatArray, centre: FloatArray, normal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Highest place of each sector before the surface falls, and its height over the plane."""
    step = at - centre
    height = step @ normal
    x, y = tangents(normal[None])[0] @ step.T
    sector = np.floor(np.arctan2(y, x) * _SECTORS / (2 * np.pi)).astype(np.int64)
    found = []
    for k in np.unique(sector):
        rows = np.flatnonzero(sector == k)
        rows = rows[np.argsort(way[rows], kind="stable")]
        top = np.maximum.accumulate(height[rows])
        # Facets lie to and fro on the way: it falls where all of the next 1.5 mm do.
        ahead = np.searchsorted(way[rows], way[rows] + 1.5)
        falls = np.array([height[rows[i:j]].max() for i, j in enumerate(ahead)]) < top - _FALL
        falls &= way[rows] > 1.0
        last = int(falls.argmax()) if falls.any() else len(rows)
        found.append(rows[np.argmax(height[rows[: max(last, 1)]])])
    return at[found], height[found]


def plane_along(at: FloatArray, outward: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Centre and normal of the plane along most of some places."""
    weight = np.ones(len(at))
    for _ in range(6):
        centre = np.average(at, axis=0, weights=weight)
        normal = np.linalg.svd((at - centre) * np.sqrt(weight)[:, None], full_matrices=False)[2][2]
        weight = 1.0 / (1.0 + ((at - centre) @ normal) ** 2)
    return centre, normal if normal @ outward > 0 else -normal
