"""Points and charges of the unit sphere in, field sums and flow lines out: the compiled loops.

Everything here is in units of the sphere's radius, about its centre. A block of points goes through the charges at a
time: vector units are filled with points, so that each point's sums run over the charges in their order, whatever the
processor's width and whatever block or thread has it. Results are the same on every machine.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.model import FloatArray

#: Softening of distances: keeps a point that coincides with a charge finite, and is lost in rounding elsewhere.
_SOFT = 1e-24
#: Least squared gradient (of u, per radius): at a stagnation point the flow stands still instead of blowing up.
_FLAT = 1e-12
#: Longest move in one stage of a flow step, in radii.
_LEAP = 0.25

#: Points of a block: kernels are called with the number of blocks.
_BLOCK = 32
#: Rows of a block's room: start of each step and where the field is asked for, its sums there, and what a step needs.
#: They are parts of one array: the compiler then knows that they do not overlap, and fills vector units.
_X, _Y, _Z, _OUTSIDE, _SUM, _GX, _GY, _GZ = (_BLOCK * k for k in range(8))
_FROM_X, _FROM_Y, _FROM_Z, _RISE, _MOVE_X, _MOVE_Y, _MOVE_Z = (_BLOCK * k for k in range(8, 15))
_ROOM = _BLOCK * 15


def blocks(points: FloatArray) -> int:
    """Number of blocks of points ``(n, 3)``."""
    return -(-len(points) // _BLOCK)


@compiled(part=True)
def _put(points: Any, first: int, room: Any) -> int:
    """Put a block of points, of which it returns the number; the last one again where there are no more."""
    count = min(_BLOCK, points.shape[0] - first)
    for i in range(_BLOCK):
        at = first + min(i, count - 1)
        room[_X + i] = points[at, 0]
        room[_Y + i] = points[at, 1]
        room[_Z + i] = points[at, 2]
    return count


@compiled(part=True)
def _take(room: Any, at: int, first: int, count: int, out: Any) -> None:
    """Take three rows of a block's room, from the place of the first, as points."""
    for i in range(count):
        for k in range(3):
            out[first + i, k] = room[at + _BLOCK * k + i]


@compiled(part=True)
def _potentials(room: Any, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any) -> None:
    """Potential u at a block of points, into the sum: sum of w (1/|r-s| - image), Eq. A.5.

    With R = 1 the image's denominator is |s|^2 |r|^2 - 2 r.s + 1 = |r-s|^2 + (1-|s|^2)(1-|r|^2), which equals the
    charge's own on the sphere, so that u = 0 there exactly, and needs no division by |s|.
    """
    for i in range(_BLOCK):
        x, y, z = room[_X + i], room[_Y + i], room[_Z + i]
        room[_OUTSIDE + i] = 1.0 - (x * x + y * y + z * z)
        room[_SUM + i] = 0.0
    for m in range(sx.shape[0]):
        px, py, pz, g, w = sx[m], sy[m], sz[m], gap[m], weight[m]
        for i in range(_BLOCK):
            dx = px - room[_X + i]
            dy = py - room[_Y + i]
            dz = pz - room[_Z + i]
            a = dx * dx + dy * dy + dz * dz + _SOFT
            b = a + g * room[_OUTSIDE + i]
            ra = np.sqrt(a)
            rb = np.sqrt(b)
            # 1/ra - 1/rb with one division.
            room[_SUM + i] += w * (rb - ra) / (ra * rb)


@compiled(part=True)
def _gradients(room: Any, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any) -> None:
    """Gradient of u at a block, Eq. A.6 rearranged: sum of w [(s-r)(a^-3/2 - b^-3/2) - r (1-|s|^2) b^-3/2]."""
    for i in range(_BLOCK):
        x, y, z = room[_X + i], room[_Y + i], room[_Z + i]
        room[_OUTSIDE + i] = 1.0 - (x * x + y * y + z * z)
        room[_SUM + i] = 0.0
        room[_GX + i] = 0.0
        room[_GY + i] = 0.0
        room[_GZ + i] = 0.0
    for m in range(sx.shape[0]):
        px, py, pz, g, w = sx[m], sy[m], sz[m], gap[m], weight[m]
        for i in range(_BLOCK):
            dx = px - room[_X + i]
            dy = py - room[_Y + i]
            dz = pz - room[_Z + i]
            a = dx * dx + dy * dy + dz * dz + _SOFT
            b = a + g * room[_OUTSIDE + i]
            ca = a * np.sqrt(a)
            cb = b * np.sqrt(b)
            # w/ca and w/cb with one division: divisions are what this loop waits for.
            q = w / (ca * cb)
            pb = q * ca
            p = q * cb - pb
            room[_GX + i] += dx * p
            room[_GY + i] += dy * p
            room[_GZ + i] += dz * p
            room[_SUM + i] += g * pb
    for i in range(_BLOCK):
        inward = room[_SUM + i]
        room[_GX + i] -= room[_X + i] * inward
        room[_GY + i] -= room[_Y + i] * inward
        room[_GZ + i] -= room[_Z + i] * inward


@compiled(part=True)
def _slopes(room: Any, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any) -> None:
    """rise * dr/du = rise * grad u / |grad u|^2 of a block, in place of the gradient, never longer than a leap."""
    _gradients(room, sx, sy, sz, gap, weight)
    for i in range(_BLOCK):
        gx, gy, gz = room[_GX + i], room[_GY + i], room[_GZ + i]
        squared = max(gx * gx + gy * gy + gz * gz, _FLAT)
        factor = room[_RISE + i] / squared
        length = abs(factor) * np.sqrt(squared)
        if length > _LEAP:
            factor *= _LEAP / length
        room[_GX + i] = gx * factor
        room[_GY + i] = gy * factor
        room[_GZ + i] = gz * factor


@compiled(grain=2, writes="out")
def potential(begin: int, end: int, points: Any, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any, out: Any) -> None:
    """u at points ``(n, 3)``, into ``out``."""
    for first in range(begin * _BLOCK, end * _BLOCK, _BLOCK):
        room = np.empty(_ROOM)
        count = _put(points, first, room)
        _potentials(room, sx, sy, sz, gap, weight)
        for i in range(count):
            out[first + i] = room[_SUM + i]


@compiled(grain=2, writes="out")
def gradient(begin: int, end: int, points: Any, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any, out: Any) -> None:
    """Gradient of u at points ``(n, 3)``, into ``out`` ``(n, 3)``."""
    for first in range(begin * _BLOCK, end * _BLOCK, _BLOCK):
        room = np.empty(_ROOM)
        count = _put(points, first, room)
        _gradients(room, sx, sy, sz, gap, weight)
        _take(room, _GX, first, count, out)


@compiled(grain=2, writes="out")
def flow(
    begin: int,
    end: int,
    points: Any,
    start: Any,
    stop: Any,
    steps: int,
    sx: Any,
    sy: Any,
    sz: Any,
    gap: Any,
    weight: Any,
    out: Any,
) -> None:
    """Move each point along grad u from level ``start`` to level ``stop`` by classical Runge-Kutta steps in u."""
    for first in range(begin * _BLOCK, end * _BLOCK, _BLOCK):
        room = np.empty(_ROOM)
        count = _put(points, first, room)
        for i in range(_BLOCK):
            at = first + min(i, count - 1)
            room[_RISE + i] = (stop[at] - start[at]) / steps
            room[_FROM_X + i] = room[_X + i]
            room[_FROM_Y + i] = room[_Y + i]
            room[_FROM_Z + i] = room[_Z + i]
        for _ in range(steps):
            for i in range(_BLOCK):
                room[_MOVE_X + i] = 0.0
                room[_MOVE_Y + i] = 0.0
                room[_MOVE_Z + i] = 0.0
            for stage in range(4):
                _slopes(room, sx, sy, sz, gap, weight)
                counts = 2.0 if stage in (1, 2) else 1.0
                ahead = 0.5 if stage < 2 else 1.0
                for i in range(_BLOCK):
                    room[_MOVE_X + i] += counts * room[_GX + i]
                    room[_MOVE_Y + i] += counts * room[_GY + i]
                    room[_MOVE_Z + i] += counts * room[_GZ + i]
                    room[_X + i] = room[_FROM_X + i] + ahead * room[_GX + i]
                    room[_Y + i] = room[_FROM_Y + i] + ahead * room[_GY + i]
                    room[_Z + i] = room[_FROM_Z + i] + ahead * room[_GZ + i]
            for i in range(_BLOCK):
                room[_FROM_X + i] += room[_MOVE_X + i] / 6.0
                room[_FROM_Y + i] += room[_MOVE_Y + i] / 6.0
                room[_FROM_Z + i] += room[_MOVE_Z + i] / 6.0
                room[_X + i] = room[_FROM_X + i]
                room[_Y + i] = room[_FROM_Y + i]
                room[_Z + i] = room[_FROM_Z + i]
        _take(room, _X, first, count, out)


@compiled(grain=2, writes="points")
def settle(
    begin: int, end: int, points: Any, level: Any, sweeps: int, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any
) -> None:
    """Newton steps along grad u, in place, that put points near their level onto it."""
    for first in range(begin * _BLOCK, end * _BLOCK, _BLOCK):
        room = np.empty(_ROOM)
        count = _put(points, first, room)
        for _ in range(sweeps):
            _potentials(room, sx, sy, sz, gap, weight)
            for i in range(_BLOCK):
                room[_RISE + i] = level[first + min(i, count - 1)] - room[_SUM + i]
            _slopes(room, sx, sy, sz, gap, weight)
            for i in range(_BLOCK):
                room[_X + i] += room[_GX + i]
                room[_Y + i] += room[_GY + i]
                room[_Z + i] += room[_GZ + i]
        _take(room, _X, first, count, points)
