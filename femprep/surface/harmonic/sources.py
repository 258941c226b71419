"""An object on isotropic voxels in, singularities inside it out: points flown in from the sphere (2.6)."""

from __future__ import annotations

import logging
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.mesh.compiled import compiled
from femprep.model import BoolArray, FloatArray
from femprep.surface.harmonic.laplace import solve_laplace

_log = logging.getLogger(__name__)

#: Erosions of the paper, in voxels.
EROSIONS = 2.0
#: Where the object is thin, the depth is this share of its half thickness.
THIN_SHARE = 0.6
#: Moves of a point on its way in, in voxels.
_MOVE = 0.25


@compiled(part=True)
def _cell(value: Any, x: float, y: float, z: float) -> tuple[int, int, int, float, float, float]:
    """Lowest corner of the cell a point lies in, and where in it the point lies."""
    ni, nj, nk = value.shape
    i = min(max(int(np.floor(x)), 0), ni - 2)
    j = min(max(int(np.floor(y)), 0), nj - 2)
    k = min(max(int(np.floor(z)), 0), nk - 2)
    return i, j, k, x - i, y - j, z - k


@compiled(part=True)
def _uphill(value: Any, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Gradient of the trilinear interpolation at a point in index coordinates."""
    i, j, k, a, b, c = _cell(value, x, y, z)
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


@compiled(grain=64)
def _climb(first: int, last: int, value: Any, inner: Any, points: Any, moves: int, arrived: Any) -> None:
    """Move points (index coordinates, in place) uphill until their voxel is an inner one."""
    ni, nj, nk = value.shape
    for p in range(first, last):
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
            points[p, 0] = min(max(x + _MOVE * gx / length, 0.0), ni - 1.0)
            points[p, 1] = min(max(y + _MOVE * gy / length, 0.0), nj - 1.0)
            points[p, 2] = min(max(z + _MOVE * gz / length, 0.0), nk - 1.0)


def erode(solid: BoolArray) -> tuple[BoolArray, float]:
    """Erode an object twice, less deeply where that would delete it.

    The depth of a voxel is its distance to the outside. Two erosions keep what is deeper than two voxels. Where the
    object is thin (its greatest depth nearby, connected within it, is less than 2 / 0.6 voxels) the depth asked for is
    0.6 of that greatest depth, so that an inner sheet is left: here the paper is silent.

    Parameters
    ----------
    solid : (ni, nj, nk) bool array
        The object on isotropic voxels.

    Returns
    -------
    eroded : (ni, nj, nk) bool array
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
    directions: FloatArray, solid: BoolArray, middle: FloatArray, voxel: float, radius: float
) -> tuple[FloatArray, dict[str, Any]]:
    """Place singularities inside an object, near its surface, by flow in from the sphere (section 2.6).

    Laplace's equation is solved numerically between the sphere (0) and the eroded object (1); evenly spread points of
    the sphere climb the solution until they are in the eroded object.

    Parameters
    ----------
    directions : (M, 3) array
        Unit vectors, evenly spread, along the grid's axes.
    solid : (ni, nj, nk) bool array
        The object on isotropic voxels.
    middle : (3,) array
        Centre of the sphere as a (fractional) index of that grid.
    voxel : float
        Edge of a voxel, mm.
    radius : float
        Radius of the sphere, mm.

    Returns
    -------
    sources : (M, 3) array
        Singularities, mm from the sphere's centre along the grid's axes.
    info : dict
        ``voxel`` (mm), ``thin_share`` (of the object, where the depth departs from two erosions), ``stray`` (points
        that did not arrive and were put on the nearest eroded voxel).

    Raises
    ------
    InputError
        The object has no voxel on this grid.
    """
    from scipy.spatial import cKDTree

    # A grid that holds the sphere and a layer of voxels around it.
    reach = radius / voxel
    low = np.floor(middle - reach).astype(int) - 1
    high = np.ceil(middle + reach).astype(int) + 1
    solid = _window(solid, low, high)
    middle = middle - low
    eroded, thin = erode(solid)
    x, y, z = ((np.arange(n) - m) ** 2 for n, m in zip(solid.shape, middle))
    outer = x[:, None, None] + y[None, :, None] + z[None, None, :] >= reach * reach
    value = solve_laplace(eroded, outer)
    # From just inside the sphere: its voxels are steps, and nothing leads away from them.
    points = np.ascontiguousarray(middle + directions * (reach - 1.5))
    arrived = np.zeros(len(points), dtype=np.bool_)
    _climb(len(points), value, eroded, points, int(np.ceil(8.0 * reach / _MOVE)), arrived)
    stray = np.flatnonzero(~arrived)
    if len(stray):
        _log.info("%d singularities did not arrive and were put on the nearest eroded voxel", len(stray))
        inside = np.argwhere(eroded)
        points[stray] = inside[cKDTree(inside).query(points[stray])[1]]
    return np.asarray((points - middle) * voxel), {"voxel": float(voxel), "thin_share": thin, "stray": len(stray)}


def _window(solid: BoolArray, low: npt.NDArray[np.int64], high: npt.NDArray[np.int64]) -> BoolArray:
    """The part of a mask from index ``low`` to ``high``, both included; what lies beyond the mask is empty."""
    out = np.zeros(high - low + 1, dtype=np.bool_)
    first, last = np.maximum(low, 0), np.minimum(high + 1, solid.shape)
    target = tuple(slice(a - b, c - b) for a, b, c in zip(first, low, last))
    out[target] = solid[tuple(slice(a, b) for a, b in zip(first, last))]
    return out
