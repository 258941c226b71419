"""An object on isotropic voxels in, singularities inside it out: points flown in from the sphere (2.6)."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
from numba import prange

from femprep.compiled import compiled
from femprep.errors import InputError
from femprep.harmonic.laplace import BoolArray, solve_laplace
from femprep.model import FloatArray

_log = logging.getLogger(__name__)

#: Erosions of the paper, in voxels.
EROSIONS = 2.0
#: Where the object is thin, the depth is this share of its half thickness.
THIN_SHARE = 0.6
#: Moves of a point on its way in, in voxels.
_MOVE = 0.25


@compiled()
def _corner_weights(x: float, y: float, z: float, n: int) -> tuple[int, int, int, float, float, float]:
    """Lowest corner of the cell a point lies in, and where in it the point lies."""
    i = min(max(int(np.floor(x)), 0), n - 2)
    j = min(max(int(np.floor(y)), 0), n - 2)
    k = min(max(int(np.floor(z)), 0), n - 2)
    return i, j, k, x - i, y - j, z - k


@compiled()
def _uphill(value: Any, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Gradient of the trilinear interpolation at a point in index coordinates."""
    i, j, k, a, b, c = _corner_weights(x, y, z, value.shape[0])
    v000 = value[i, j, k]
    v001 = value[i, j, k + 1]
    v010 = value[i, j + 1, k]
    v011 = value[i, j + 1, k + 1]
    v100 = value[i + 1, j, k]
    v101 = value[i + 1, j, k + 1]
    v110 = value[i + 1, j + 1, k]
    v111 = value[i + 1, j + 1, k + 1]
    gx = (
        (v100 - v000) * (1 - b) * (1 - c)
        + (v101 - v001) * (1 - b) * c
        + (v110 - v010) * b * (1 - c)
        + (v111 - v011) * b * c
    )
    gy = (
        (v010 - v000) * (1 - a) * (1 - c)
        + (v011 - v001) * (1 - a) * c
        + (v110 - v100) * a * (1 - c)
        + (v111 - v101) * a * c
    )
    gz = (
        (v001 - v000) * (1 - a) * (1 - b)
        + (v011 - v010) * (1 - a) * b
        + (v101 - v100) * a * (1 - b)
        + (v111 - v110) * a * b
    )
    return gx, gy, gz


@compiled(parallel=True)
def _climb(value: Any, inner: Any, points: Any, moves: int, arrived: Any) -> None:
    """Move points (index coordinates, in place) uphill until their voxel is an inner one."""
    last = value.shape[0] - 1
    for p in prange(points.shape[0]):
        for _ in range(moves):
            x = points[p, 0]
            y = points[p, 1]
            z = points[p, 2]
            if inner[int(np.rint(x)), int(np.rint(y)), int(np.rint(z))]:
                arrived[p] = True
                break
            gx, gy, gz = _uphill(value, x, y, z)
            length = np.sqrt(gx * gx + gy * gy + gz * gz)
            if length == 0.0:
                break
            # Midpoint rule: the field turns quickly near the object.
            mx = x + 0.5 * _MOVE * gx / length
            my = y + 0.5 * _MOVE * gy / length
            mz = z + 0.5 * _MOVE * gz / length
            hx, hy, hz = _uphill(value, mx, my, mz)
            second = np.sqrt(hx * hx + hy * hy + hz * hz)
            if second > 0.0:
                gx, gy, gz, length = hx, hy, hz, second
            points[p, 0] = min(max(x + _MOVE * gx / length, 0.0), last)
            points[p, 1] = min(max(y + _MOVE * gy / length, 0.0), last)
            points[p, 2] = min(max(z + _MOVE * gz / length, 0.0), last)


def erode(solid: BoolArray) -> tuple[BoolArray, float]:
    """Erode an object twice, less deeply where that would delete it.

    The depth of a voxel is its distance to the outside. Two erosions keep what is deeper than two voxels. Where the
    object is thin (its greatest depth nearby, connected within it, is less than 2 / 0.6 voxels) the depth asked for is
    0.6 of that greatest depth, so that an inner sheet is left: here the paper is silent.

    Parameters
    ----------
    solid : (n, n, n) bool array
        The object on isotropic voxels.

    Returns
    -------
    eroded : (n, n, n) bool array
        The eroded object, not empty.
    thin : float
        Share of the object's voxels at which the depth was reduced.

    Raises
    ------
    InputError
        The object has no voxel.
    """
    from scipy import ndimage

    if not solid.any():
        raise InputError("the object has no voxel on the grid its singularities are placed on; it is too small")
    box = tuple(slice(max(s.start - 1, 0), s.stop + 1) for s in ndimage.find_objects(solid.astype(np.int8))[0])
    part = solid[box]
    depth = ndimage.distance_transform_edt(np.pad(part, 1))[1:-1, 1:-1, 1:-1]
    # No need to know more than what makes the paper's depth possible.
    enough = EROSIONS / THIN_SHARE
    greatest = np.minimum(depth, enough)
    for _ in range(int(np.ceil(enough))):
        greatest = ndimage.maximum_filter(greatest, size=3) * part
    wanted = np.minimum(EROSIONS, THIN_SHARE * greatest)
    eroded = np.zeros_like(solid)
    eroded[box] = part & (depth > wanted)
    return eroded, float(np.count_nonzero(part & (wanted < EROSIONS)) / np.count_nonzero(part))


def place_sources(
    directions: FloatArray, solid: BoolArray, voxel: float, radius: float
) -> tuple[FloatArray, dict[str, Any]]:
    """Place singularities inside an object, near its surface, by flow in from the sphere (section 2.6).

    Laplace's equation is solved numerically between the sphere (0) and the eroded object (1); evenly spread points of
    the sphere climb the solution until they are in the eroded object.

    Parameters
    ----------
    directions : (M, 3) array
        Unit vectors, evenly spread.
    solid : (n, n, n) bool array
        The object on isotropic voxels, n odd; the sphere's centre is the centre of the middle voxel.
    voxel : float
        Edge of a voxel, mm.
    radius : float
        Radius of the sphere, mm; the sphere has to lie within the grid.

    Returns
    -------
    sources : (M, 3) array
        Singularities, mm from the sphere's centre.
    info : dict
        ``voxel`` (mm), ``thin_share`` (of the object, where the depth departs from two erosions), ``stray`` (points
        that did not arrive and were put on the nearest eroded voxel).

    Raises
    ------
    InputError
        The object has no voxel on this grid.
    """
    from scipy.spatial import cKDTree

    size = solid.shape[0]
    middle = size // 2
    eroded, thin = erode(solid)
    axis = (np.arange(size) - middle) * voxel
    squared = axis * axis
    outer = squared[:, None, None] + squared[None, :, None] + squared[None, None, :] >= radius * radius
    value = solve_laplace(eroded, outer)
    # From just inside the sphere: its voxels are steps, and nothing leads away from them.
    points = np.ascontiguousarray(middle + directions * (radius / voxel - 1.5))
    arrived = np.zeros(len(points), dtype=np.bool_)
    _climb(value, eroded, points, int(np.ceil(4 * size / _MOVE)), arrived)
    stray = np.flatnonzero(~arrived)
    if len(stray):
        _log.info("%d singularities did not arrive and were put on the nearest eroded voxel", len(stray))
        inside = np.argwhere(eroded)
        points[stray] = inside[cKDTree(inside).query(points[stray])[1]]
    return (points - middle) * voxel, {"voxel": float(voxel), "thin_share": thin, "stray": len(stray)}
