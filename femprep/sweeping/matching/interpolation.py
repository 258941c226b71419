"""Positions on one cup in, positions on another of a different resolution out: interpolation on the disk."""

from __future__ import annotations

import numpy as np

from femprep.errors import StageError
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FloatArray, split_quads
from femprep.model.functions import exponential
from femprep.model.products import length
from femprep.sweeping.cup.cup import Cup

#: Cells looked at for each vertex: those with the nearest middles.
_CANDIDATES = 8
#: A place within this distance of a triangle lies on it, but for rounding; the disk's radius is 1.
_OUTSIDE = 1e-9


def scatter(disk: FloatArray, values: FloatArray, wanted: FloatArray) -> FloatArray:
    """Interpolate positions ``(n, 3)``, given at places ``(n, 2)`` of the disk, at other places ``(m, 2)``.

    Raises
    ------
    StageError
        A place lies outside of those given.
    """
    from scipy.spatial import Delaunay

    # Searched by our own finder: Delaunay's asks a linear algebra library for each triangle's map, one by one, of which
    # the threads then wait for each other.
    triangles = Delaunay(disk).simplices.astype(np.int64)
    found = ClosestFinder(_lifted(disk), triangles)(_lifted(wanted))
    outside = found.distance > _OUTSIDE
    if outside.any():
        raise StageError(
            f"{np.count_nonzero(outside)} of {len(wanted)} vertices of the cup find no place on a surface; the base "
            "plane cuts it too near its end"
        )
    return np.asarray(np.einsum("nk,nkj->nj", found.weights, values[triangles[found.triangle]]))


def _lifted(disk: FloatArray) -> FloatArray:
    return np.column_stack([disk, np.zeros(len(disk))])


def carry_over(coarse: Cup, values: FloatArray, fine: Cup) -> FloatArray:
    """Carry positions ``(V, 3)`` from the vertices of one cup to those of another, linearly within its cells.

    Vertices that lie a little beyond a rim, a polygon on the disk, are extrapolated from the cell next to it.
    """
    from scipy.spatial import cKDTree

    triangles = split_quads(coarse.cells)
    here, there = _even(coarse, coarse.disk), _even(coarse, fine.disk)
    corner = here[triangles]
    found = cKDTree(corner.mean(axis=1)).query(there, k=min(_CANDIDATES, len(triangles)))[1]
    near = np.asarray(found, dtype=np.int64)
    a, b, c = (corner[near][:, :, k] for k in range(3))
    whole = _cross(b - a, c - a)
    point = there[:, None]
    weights = np.stack(
        [_cross(b - point, c - point), _cross(c - point, a - point), _cross(a - point, b - point)], axis=2
    )
    weights /= whole[..., None]
    row = np.arange(len(there))
    best = np.argmax(weights.min(axis=2), axis=1)
    return np.asarray(np.einsum("nk,nkj->nj", weights[row, best], values[triangles[near[row, best]]]))


def _even(cup: Cup, disk: FloatArray) -> FloatArray:
    """The disk stretched outwards so that cells of the cup are about as high as wide everywhere."""
    share = np.linalg.norm(disk, axis=1)
    if len(cup.apex):
        hole = length(cup.disk[cup.apex[0]])
        stretched = exponential((share - 1.0) / (1.0 - hole) * 2.0 * np.pi * cup.rows / cup.columns)
    else:
        # Up to here rows grow wider, from here on they stay.
        sectors = cup.columns / (5.0 if cup.cells.shape[1] == 3 else 8.0)
        turn = sectors / (sectors + cup.rows)
        stretched = np.where(share > turn, turn * exponential(np.maximum(share / turn - 1.0, 0.0)), share)
    return np.asarray(disk * (stretched / np.maximum(share, 1e-300))[:, None])


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
