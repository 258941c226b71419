"""Points and charges of the unit sphere in, field sums and flow lines out: the compiled loops.

Everything here is in units of the sphere's radius, about its centre. Charges come as contiguous arrays per
coordinate so that the inner loop over them runs on vector units; the outer loop over points is shared among threads.
Each point is computed by the same instructions whatever thread has it, so results do not depend on their number.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import prange

from femprep.compiled import compiled

#: Softening of distances: keeps a point that coincides with a charge finite, and is lost in rounding elsewhere.
_SOFT = 1e-24
#: Least squared gradient (of u, per radius): at a stagnation point the flow stands still instead of blowing up.
_FLAT = 1e-12
#: Longest move in one stage of a flow step, in radii.
_LEAP = 0.25


@compiled(fast_sums=True, part=True)
def _potential(x: float, y: float, z: float, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any) -> float:
    """Potential u at one point: sum of w (1/|r-s| - image), Eq. A.5.

    With R = 1 the image's denominator is |s|^2 |r|^2 - 2 r.s + 1 = |r-s|^2 + (1-|s|^2)(1-|r|^2), which equals the
    charge's own on the sphere, so that u = 0 there exactly, and needs no division by |s|.
    """
    outside = 1.0 - (x * x + y * y + z * z)
    total = 0.0
    for m in range(sx.shape[0]):
        dx = sx[m] - x
        dy = sy[m] - y
        dz = sz[m] - z
        a = dx * dx + dy * dy + dz * dz + _SOFT
        b = a + gap[m] * outside
        ra = np.sqrt(a)
        rb = np.sqrt(b)
        # 1/ra - 1/rb with one division.
        total += weight[m] * (rb - ra) / (ra * rb)
    return total


@compiled(fast_sums=True, part=True)
def _gradient(
    x: float, y: float, z: float, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any
) -> tuple[float, float, float]:
    """Gradient of u at one point, Eq. A.6 rearranged: sum of w [(s-r)(a^-3/2 - b^-3/2) - r (1-|s|^2) b^-3/2]."""
    outside = 1.0 - (x * x + y * y + z * z)
    gx = 0.0
    gy = 0.0
    gz = 0.0
    inward = 0.0
    for m in range(sx.shape[0]):
        dx = sx[m] - x
        dy = sy[m] - y
        dz = sz[m] - z
        a = dx * dx + dy * dy + dz * dz + _SOFT
        b = a + gap[m] * outside
        ca = a * np.sqrt(a)
        cb = b * np.sqrt(b)
        # w/ca and w/cb with one division: divisions are what this loop waits for.
        q = weight[m] / (ca * cb)
        pb = q * ca
        p = q * cb - pb
        gx += dx * p
        gy += dy * p
        gz += dz * p
        inward += gap[m] * pb
    return gx - x * inward, gy - y * inward, gz - z * inward


@compiled(parallel=True)
def potential(points: Any, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any, out: Any) -> None:
    """u at points ``(n, 3)``, into ``out``."""
    for i in prange(points.shape[0]):
        out[i] = _potential(points[i, 0], points[i, 1], points[i, 2], sx, sy, sz, gap, weight)


@compiled(parallel=True)
def gradient(points: Any, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any, out: Any) -> None:
    """Gradient of u at points ``(n, 3)``, into ``out`` ``(n, 3)``."""
    for i in prange(points.shape[0]):
        gx, gy, gz = _gradient(points[i, 0], points[i, 1], points[i, 2], sx, sy, sz, gap, weight)
        out[i, 0] = gx
        out[i, 1] = gy
        out[i, 2] = gz


@compiled(part=True)
def _slope(
    x: float, y: float, z: float, step: float, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any
) -> tuple[float, float, float]:
    """step * dr/du = step * grad u / |grad u|^2, never longer than a leap."""
    gx, gy, gz = _gradient(x, y, z, sx, sy, sz, gap, weight)
    squared = max(gx * gx + gy * gy + gz * gz, _FLAT)
    factor = step / squared
    length = abs(factor) * np.sqrt(squared)
    if length > _LEAP:
        factor *= _LEAP / length
    return gx * factor, gy * factor, gz * factor


@compiled(part=True)
def _carry(
    points: Any, i: int, start: Any, stop: Any, steps: int, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any, out: Any
) -> None:
    """Carry one point from its level ``start`` to its level ``stop``."""
    x = points[i, 0]
    y = points[i, 1]
    z = points[i, 2]
    h = (stop[i] - start[i]) / steps
    for _ in range(steps):
        ax, ay, az = _slope(x, y, z, h, sx, sy, sz, gap, weight)
        bx, by, bz = _slope(x + 0.5 * ax, y + 0.5 * ay, z + 0.5 * az, h, sx, sy, sz, gap, weight)
        cx, cy, cz = _slope(x + 0.5 * bx, y + 0.5 * by, z + 0.5 * bz, h, sx, sy, sz, gap, weight)
        dx, dy, dz = _slope(x + cx, y + cy, z + cz, h, sx, sy, sz, gap, weight)
        x += (ax + 2.0 * (bx + cx) + dx) / 6.0
        y += (ay + 2.0 * (by + cy) + dy) / 6.0
        z += (az + 2.0 * (bz + cz) + dz) / 6.0
    out[i, 0] = x
    out[i, 1] = y
    out[i, 2] = z


@compiled(parallel=True)
def flow(
    points: Any, start: Any, stop: Any, steps: int, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any, out: Any
) -> None:
    """Move each point along grad u from level ``start`` to level ``stop`` by classical Runge-Kutta steps in u."""
    for i in prange(points.shape[0]):
        _carry(points, i, start, stop, steps, sx, sy, sz, gap, weight, out)


@compiled()
def flow_alone(
    points: Any, start: Any, stop: Any, steps: int, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any, out: Any
) -> None:
    """As flow, by one thread: for few points, which threads would spend on waiting for each other."""
    for i in range(points.shape[0]):
        _carry(points, i, start, stop, steps, sx, sy, sz, gap, weight, out)


@compiled(parallel=True)
def settle(points: Any, level: Any, sweeps: int, sx: Any, sy: Any, sz: Any, gap: Any, weight: Any) -> None:
    """Newton steps along grad u, in place, that put points near their level onto it."""
    for i in prange(points.shape[0]):
        for _ in range(sweeps):
            x = points[i, 0]
            y = points[i, 1]
            z = points[i, 2]
            short = level[i] - _potential(x, y, z, sx, sy, sz, gap, weight)
            mx, my, mz = _slope(x, y, z, short, sx, sy, sz, gap, weight)
            points[i, 0] = x + mx
            points[i, 1] = y + my
            points[i, 2] = z + mz
