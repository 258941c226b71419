"""Points moved along the gradient of the mean ratio around them: what raises the mean quality."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.mesh.stars import each_colour, mark_star
from femprep.model import BoolArray, FloatArray, IntArray
from femprep.volume.optimise.quality import REGULAR_SINE, sizes, worst_around

#: First step of a move by the mean edge length around, inside and on a curved surface.
FIRST_STEP: Final = 0.2
SURFACE_STEP: Final = 0.06
#: How many steps along a gradient are tried at most, each half of the one before.
_BACKTRACKS: Final = 4
#: A bound that is below what it bounds by this factor is so whatever is rounded.
_CERTAIN: Final = 1.0 - 1e-9
#: Points one thread takes at a time, at least.
_CHUNK: Final = 32


@compiled(inner=True)
def _gather(mesh: Any, v: int, star: FloatArray) -> float:
    """What the mean ratio of each element around a point depends on as the point moves; their mean edge length there.

    A column holds, with the point as origin, the other corners a, b, c; the vector N and the number k of six volumes
    ``k - N.x``; the vector m and the number q of the sum of squared edges ``3 x.x - 2 m.x + q``; and room.
    """
    p, t, start, around = mesh
    count = start[v + 1] - start[v]
    for n in range(count):
        i = around[start[v] + n]
        # The other corners so that the point sees them as the first corner of an element sees the rest.
        if t[i, 0] == v:
            a, b, c = t[i, 1], t[i, 2], t[i, 3]
        elif t[i, 1] == v:
            a, b, c = t[i, 0], t[i, 3], t[i, 2]
        elif t[i, 2] == v:
            a, b, c = t[i, 3], t[i, 0], t[i, 1]
        else:
            a, b, c = t[i, 2], t[i, 1], t[i, 0]
        for axis in range(3):
            home = p[v, axis]
            star[axis, n], star[3 + axis, n], star[6 + axis, n] = (
                p[a, axis] - home,
                p[b, axis] - home,
                p[c, axis] - home,
            )
    for n in range(count):
        ax, ay, az = star[0, n], star[1, n], star[2, n]
        bx, by, bz = star[3, n], star[4, n], star[5, n]
        cx, cy, cz = star[6, n], star[7, n], star[8, n]
        ux, uy, uz, wx, wy, wz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        aa, bb, cc = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz
        far = ux * ux + uy * uy + uz * uz + wx * wx + wy * wy + wz * wz
        far += (cx - bx) ** 2 + (cy - by) ** 2 + (cz - bz) ** 2
        star[9, n], star[10, n], star[11, n], star[12, n] = nx, ny, nz, nx * ax + ny * ay + nz * az
        star[13, n], star[14, n], star[15, n] = ax + bx + cx, ay + by + cy, az + bz + cz
        star[16, n] = aa + bb + cc + far
        star[17, n] = np.sqrt(aa) + np.sqrt(bb) + np.sqrt(cc)
    length = 0.0
    for n in range(count):
        length += star[17, n]
    return float(length / (3.0 * count))


@compiled(inner=True)
def _mean_at(star: FloatArray, count: int, x: float, y: float, z: float) -> float:
    """Sum of the mean ratios of a star with its point at x, y, z; minus infinity if an element is inverted."""
    for n in range(count):
        six = star[12, n] - star[9, n] * x - star[10, n] * y - star[11, n] * z
        edges = 3.0 * (x * x + y * y + z * z) + star[16, n]
        edges -= 2.0 * (star[13, n] * x + star[14, n] * y + star[15, n] * z)
        star[17, n] = six
        star[18, n] = 12.0 * np.cbrt(0.25 * six * six) / edges
    total = 0.0
    for n in range(count):
        if star[17, n] <= 0.0:
            return -np.inf
        total += star[18, n]
    return total


@compiled(inner=True)
def _falls(star: FloatArray, count: int, x: float, y: float, z: float, best: float) -> bool:
    """Whether that sum is certainly below its value where the point is, ``best``, with the point at x, y, z.

    A cube root lies below its tangent: of the mean ratios' cubes, which take no root, follows a bound of the sum. Most
    places are worse, and a root takes longer than all else.
    """
    for n in range(count):
        six = star[12, n] - star[9, n] * x - star[10, n] * y - star[11, n] * z
        edges = 3.0 * (x * x + y * y + z * z) + star[16, n]
        edges -= 2.0 * (star[13, n] * x + star[14, n] * y + star[15, n] * z)
        star[17, n] = star[20, n] * (six * six / (edges * edges * edges))
    bound = 2.0 / 3.0 * best
    for n in range(count):
        bound += star[17, n]
    return bound < _CERTAIN * best


@compiled(inner=True)
def _gradient(star: FloatArray, count: int, out: FloatArray) -> None:
    """Gradient of that sum where the point is, which it was just taken at; no element is inverted there."""
    for n in range(count):
        six, ratio = star[17, n], star[18, n]
        star[20, n] = 144.0 / (ratio * ratio)
        by_volume, by_edges = 2.0 / 3.0 * ratio / six, 2.0 * ratio / star[16, n]
        star[17, n] = by_volume * star[9, n] - by_edges * star[13, n]
        star[18, n] = by_volume * star[10, n] - by_edges * star[14, n]
        star[19, n] = by_volume * star[11, n] - by_edges * star[15, n]
    out[:] = 0.0
    for n in range(count):
        out[0] -= star[17, n]
        out[1] -= star[18, n]
        out[2] -= star[19, n]


@compiled(inner=True)
def _all_reach(star: FloatArray, count: int, x: float, y: float, z: float, enough: float) -> bool:
    """Whether all elements have at least a positive quality with the point at x, y, z: powers of both are compared."""
    sine = (enough * REGULAR_SINE) ** 2
    for n in range(count):
        six, total, square, product = sizes(
            *(star[0, n] - x, star[1, n] - y, star[2, n] - z),
            *(star[3, n] - x, star[4, n] - y, star[5, n] - z),
            *(star[6, n] - x, star[7, n] - y, star[8, n] - z),
        )
        round_enough = 432.0 * six * six >= (enough * total) ** 3
        sharp = six * six * square < sine * product
        star[17, n] = (six > 0.0) & (product > 0.0) & round_enough & ~sharp
    reached = 0.0
    for n in range(count):
        reached += star[17, n]
    return reached == count


@compiled(inner=True)
def _project(vector: FloatArray, freedom: int, basis: FloatArray) -> float:
    """Leave of a vector what points in the free directions, with length 1; its length before."""
    if freedom < 3:
        x, y, z = vector[0], vector[1], vector[2]
        vector[:] = 0.0
        for k in range(freedom):
            along = x * basis[k, 0] + y * basis[k, 1] + z * basis[k, 2]
            for axis in range(3):
                vector[axis] += along * basis[k, axis]
    size = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    if size > 0.0:
        for axis in range(3):
            vector[axis] /= size
    return float(size)


@compiled(inner=True)
def _ascend(
    mesh: Any, v: int, freedom: int, basis: FloatArray, poor: float, star: FloatArray, slope: FloatArray
) -> bool:
    """Move one point along the gradient of the mean ratio around it, no element becoming poor, or poorer if it is."""
    p, _, start, _ = mesh
    count = start[v + 1] - start[v]
    size = (FIRST_STEP if freedom == 3 else SURFACE_STEP) * _gather(mesh, v, star)
    best = _mean_at(star, count, 0.0, 0.0, 0.0)
    if best == -np.inf:  # an inverted element has no gradient; the search for the worst element mends it
        return False
    _gradient(star, count, slope)
    if _project(slope, freedom, basis) == 0.0:
        return False
    hx, hy, hz, before = p[v, 0], p[v, 1], p[v, 2], np.inf
    for _ in range(_BACKTRACKS):
        x, y, z = size * slope[0], size * slope[1], size * slope[2]
        if not _falls(star, count, x, y, z, best) and _mean_at(star, count, x, y, z) > best:
            p[v, 0], p[v, 1], p[v, 2] = hx + x, hy + y, hz + z
            if _all_reach(star, count, x, y, z, poor):
                return True
            after = worst_around(mesh, v, -np.inf)
            p[v, 0], p[v, 1], p[v, 2] = hx, hy, hz
            if before == np.inf:
                before = worst_around(mesh, v, -np.inf)
            if after >= min(poor, before):
                p[v, 0], p[v, 1], p[v, 2] = hx + x, hy + y, hz + z
                return True
        size *= 0.5
    return False


def relax(mesh: Any, colours: Any, freedom: IntArray, basis: FloatArray, poor: float, fresh: BoolArray) -> None:
    """Move each point once to a better mean ratio around it, colour by colour."""
    largest = int(np.diff(mesh[2]).max(initial=0))
    for nodes in each_colour(colours):
        _relax(len(nodes), mesh, nodes, largest, freedom, basis, poor, fresh)


@compiled(grain=_CHUNK)
def _relax(
    first: int,
    last: int,
    mesh: Any,
    nodes: IntArray,
    largest: int,
    freedom: IntArray,
    basis: FloatArray,
    poor: float,
    fresh: BoolArray,
) -> None:
    """Move points that share no element."""
    _, t, start, around = mesh
    star, slope = np.empty((21, largest)), np.empty(3)
    for n in range(first, last):
        v = nodes[n]
        if freedom[v] > 0 and _ascend(mesh, v, freedom[v], basis[v], poor, star, slope):
            mark_star(t, start, around, v, fresh)
