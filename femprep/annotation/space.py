"""A boundary in, the space between its walls as voxels out: outside, cavities, and how wide each place is.

What a ball that comes from far away cannot reach is a cavity, whatever openings it has, as long as they are narrower
than the ball (the rolling ball, or closing, of mathematical morphology).
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.ndimage import distance_transform_edt, label

from femprep.annotation.shell import Shell
from femprep.mesh.compiled import compiled
from femprep.model import BoolArray, FloatArray, IntArray

#: Radii of the ball, mm, the smallest first; and the share of the largest one's cavities that the one taken must find.
BALLS: Final = (8.0, 10.0, 12.0, 15.0)
_SHARE: Final = 0.93
#: Largest voxels, mm: walls of ventricles are a few of them thick, whatever the mesh is.
_COARSE: Final = 2.0
#: Empty space around the mesh, mm.
_MARGIN: Final = 16.0
#: Voxels along the diagonal of a heart, at most.
_FINE: Final = 150.0


@dataclass(frozen=True, eq=False)
class Space:
    """Voxels around a mesh.

    Attributes
    ----------
    origin : (3,) array
        Centre of the first voxel, mm.
    step : float
        Voxel size, mm.
    tissue : (i, j, k) array
        Voxels within the mesh.
    width : (i, j, k) array
        Distance of each other voxel from tissue, mm.
    outside : (i, j, k) array
        What the ball reaches.
    """

    origin: FloatArray
    step: float
    tissue: BoolArray
    width: FloatArray
    outside: BoolArray

    def index(self, points: FloatArray) -> IntArray:
        """Voxel of each of points ``(n, 3)``, kept within the grid."""
        found = np.rint((points - self.origin) / self.step).astype(np.int64)
        return np.clip(found, 0, np.array(self.tissue.shape) - 1)

    def at(self, values: np.ndarray, points: FloatArray) -> np.ndarray:
        """Values of the voxels at points ``(n, 3)``."""
        return np.asarray(values[tuple(self.index(points).T)])

    def world(self, index: np.ndarray) -> FloatArray:
        """Places of voxels ``(n, 3)``, mm."""
        return np.asarray(self.origin + self.step * index)


def space_of(shell: Shell) -> Space:
    """Voxels around a mesh, and what a ball that comes from outside reaches."""
    used = shell.points[np.unique(shell.triangles)]
    low, high = used.min(axis=0), used.max(axis=0)
    step = max(min(shell.edge, _COARSE), float(np.linalg.norm(high - low)) / _FINE)
    # Off the round numbers that points of regular meshes have, so that no ray runs along an edge.
    origin = low - (_MARGIN + 2.0 * step) - step * np.array([0.1379, 0.2311, 0.3173])
    shape = np.ceil((high + _MARGIN + 2.0 * step - origin) / step).astype(np.int64) + 1
    tissue = filled((shell.points - origin) / step, shell.triangles, shape)
    width = distance_transform_edt(~tissue, sampling=step)
    covered = [reached(width, step, ball) for ball in BALLS]
    void = [int(np.count_nonzero(~tissue & ~one)) for one in covered]
    chosen = next(k for k in range(len(BALLS)) if void[k] >= _SHARE * void[-1])
    return Space(origin, step, tissue, width, covered[chosen])


def filled(points: FloatArray, triangles: IntArray, shape: IntArray) -> BoolArray:
    """Voxels within a closed surface wound outward, whose points are given in steps from the first voxel."""
    turns = np.zeros(shape, dtype=np.int32)
    _cross(points, triangles, turns)
    return np.asarray(np.cumsum(turns, axis=2) > 0)


def reached(width: FloatArray, step: float, ball: float) -> BoolArray:
    """Voxels that a ball from outside covers."""
    pieces, _ = label(width >= ball)
    centres = pieces == pieces[0, 0, 0]
    return np.asarray(distance_transform_edt(~centres, sampling=step) < ball)


def reached_far(space: Space, ball: float) -> BoolArray:
    """Voxels that a larger ball from outside covers, on a coarser grid with more room around it."""
    skip = max(1, round(3.0 / space.step))
    step, pad = skip * space.step, int(np.ceil(ball / (skip * space.step))) + 1
    width = distance_transform_edt(~np.pad(space.tissue[::skip, ::skip, ::skip], pad), sampling=step)
    covered = reached(width, step, ball)[pad:-pad, pad:-pad, pad:-pad]
    fine = covered.repeat(skip, 0).repeat(skip, 1).repeat(skip, 2)
    return np.asarray(fine[tuple(slice(0, n) for n in space.tissue.shape)])


@compiled()
def _cross(points, triangles, turns):  # type: ignore[no-untyped-def]
    """Count, for each voxel, the triangles that the line along z enters (+1) or leaves (-1) the tissue by just below.

    A triangle wound out of the tissue is entered where its normal points down.
    """
    for t in range(len(triangles)):
        a, b, c = points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0:
            continue
        for i in range(int(np.ceil(min(a[0], b[0], c[0]))), int(np.floor(max(a[0], b[0], c[0]))) + 1):
            for j in range(int(np.ceil(min(a[1], b[1], c[1]))), int(np.floor(max(a[1], b[1], c[1]))) + 1):
                u = ((b[0] - i) * (c[1] - j) - (b[1] - j) * (c[0] - i)) / area
                v = ((c[0] - i) * (a[1] - j) - (c[1] - j) * (a[0] - i)) / area
                w = 1.0 - u - v
                if u >= 0.0 and v >= 0.0 and w >= 0.0:
                    k = int(np.ceil(u * a[2] + v * b[2] + w * c[2]))
                    turns[i, j, k] += -1 if area > 0.0 else 1


def flood(space: Space, seeds: IntArray) -> IntArray:
    """Give each voxel of the space the number of the seed it is widest open to (a watershed); 0 in tissue."""
    found = np.where(space.tissue, -1, seeds).astype(np.int64)
    _flood(found.ravel(), space.width.ravel().astype(np.float64), np.array(found.shape, dtype=np.int64))
    return np.maximum(found, 0)


@compiled()
def _flood(found, width, shape):  # type: ignore[no-untyped-def]
    """Meyer's flooding: the widest voxel beside a basin joins it next; -1 is a wall, 0 is free."""
    nj, nk = shape[1], shape[2]
    steps = np.array([nj * nk, -nj * nk, nk, -nk, 1, -1])
    heap = [(0.0, 0, 0) for _ in range(0)]
    count = 0
    for v in range(len(found)):
        if found[v] > 0:
            heap.append((-np.inf, count, v))
            count += 1
    heapq.heapify(heap)
    while len(heap):
        _, _, v = heapq.heappop(heap)
        j, k = (v // nk) % nj, v % nk
        for way in range(6):
            if (
                (way == 2 and j == nj - 1)
                or (way == 3 and j == 0)
                or (way == 4 and k == nk - 1)
                or (way == 5 and k == 0)
            ):
                continue
            u = v + steps[way]
            if u < 0 or u >= len(found) or found[u] != 0:
                continue
            found[u] = found[v]
            heapq.heappush(heap, (-width[u], count, u))
            count += 1
