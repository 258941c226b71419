"""Kernels over the elements around each point of a mesh of tetrahedra (its star): quality, and moves that raise it.

Points that share no element are independent of each other: they are coloured so that all of one colour may move at
once, on any number of threads and with the same result.
"""

from __future__ import annotations

from typing import Final

import numba
import numpy as np
import numpy.typing as npt

from femprep.compiled import compiled

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

#: Sine of the regular tetrahedron's dihedral angle.
REGULAR_SINE: Final = 2.0 * np.sqrt(2.0) / 3.0
#: First step of a move by the mean edge length, inside and on a curved surface, and how often a search halves it.
_FIRST_STEP: Final = 0.2
_SURFACE_STEP: Final = 0.06
_HALVINGS: Final = 5
#: How often the step along a gradient is halved, and how many such steps one visit takes.
_BACKTRACKS: Final = 4
_ASCENTS: Final = 2
#: Two thirds of a float's exponent offset, as its bits have it, and what makes the error of the first guess least.
_THIRD: Final = np.int64(0x2A9F7893782DA1CE)
#: Points one thread takes at a time.
_CHUNK: Final = 32


@compiled()
def stars(cells: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Elements around each point: those of point v are ``around[start[v]:start[v + 1]]``, ascending."""
    start = np.zeros(count + 1, dtype=np.int64)
    for i in range(len(cells)):
        for j in range(4):
            start[cells[i, j] + 1] += 1
    for v in range(count):
        start[v + 1] += start[v]
    place = start[:-1].copy()
    around = np.empty(4 * len(cells), dtype=np.int64)
    for i in range(len(cells)):
        for j in range(4):
            v = cells[i, j]
            around[place[v]] = i
            place[v] += 1
    return start, around


@compiled()
def coloured(t: IntArray, start: IntArray, around: IntArray, nodes: IntArray) -> tuple[IntArray, IntArray]:
    """Points in the order of their colours, and where each colour begins.

    Greedy, in the order given: each point takes the first colour that no point of its star has.
    """
    colour = np.full(len(start) - 1, -1, dtype=np.int64)
    taken = np.full(256, -1, dtype=np.int64)
    used = 0
    for n in range(len(nodes)):
        v = nodes[n]
        for k in range(start[v], start[v + 1]):
            for j in range(4):
                c = colour[t[around[k], j]]
                if c >= 0:
                    taken[c] = v
        c = 0
        while taken[c] == v:
            c += 1
            if c == len(taken):
                taken = np.concatenate((taken, np.full(len(taken), -1, dtype=np.int64)))
        colour[v] = c
        used = max(used, c + 1)
    first = np.zeros(used + 1, dtype=np.int64)
    for n in range(len(nodes)):
        first[colour[nodes[n]] + 1] += 1
    for c in range(used):
        first[c + 1] += first[c]
    place = first[:-1].copy()
    order = np.empty(len(nodes), dtype=np.int64)
    for n in range(len(nodes)):
        c = colour[nodes[n]]
        order[place[c]] = nodes[n]
        place[c] += 1
    return order, first


@compiled(part=True)
def _cube_root(x: float) -> float:
    """Cube root of a positive number, to 1e-14: a third of its exponent, then two of Halley's steps."""
    number = np.float64(x)
    bits = np.int64(number.view(np.int64) // 3 + _THIRD)
    root = bits.view(np.float64)
    for _ in range(2):
        cube = root * root * root
        root *= (cube + 2.0 * x) / (2.0 * cube + x)
    return root


@compiled(part=True)
def _sizes(p: FloatArray, a: int, b: int, c: int, d: int) -> tuple[float, float, float, float]:
    """What a shape is made of: six volumes, the sum of squared edges, and two numbers for the least sine.

    The squared sine at an edge is that of six volumes times its length by the product of the areas of its two faces.
    Over the product of all four areas (the last number) the least of them takes one division.
    """
    ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
    vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
    wx, wy, wz = p[d, 0] - p[a, 0], p[d, 1] - p[a, 1], p[d, 2] - p[a, 2]
    # Twice the area vectors of the faces opposite to d, c, b; that opposite to a closes the surface.
    dx, dy, dz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    cx, cy, cz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
    bx, by, bz = vy * wz - vz * wy, vz * wx - vx * wz, vx * wy - vy * wx
    ax, ay, az = bx + cx + dx, by + cy + dy, bz + cz + dz
    six = ux * bx + uy * by + uz * bz
    area_a, area_b = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz
    area_c, area_d = cx * cx + cy * cy + cz * cz, dx * dx + dy * dy + dz * dz
    ab, ac, ad = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
    bc = (vx - ux) ** 2 + (vy - uy) ** 2 + (vz - uz) ** 2
    bd = (wx - ux) ** 2 + (wy - uy) ** 2 + (wz - uz) ** 2
    cd = (wx - vx) ** 2 + (wy - vy) ** 2 + (wz - vz) ** 2
    total = ab + ac + ad + bc + bd + cd
    product = area_a * area_b * area_c * area_d
    square = min(ab * area_a * area_b, ac * area_a * area_c, ad * area_a * area_d)
    square = min(square, bc * area_b * area_c, bd * area_b * area_d, cd * area_c * area_d)
    return six, total, square, product


@compiled()
def _shape(p: FloatArray, a: int, b: int, c: int, d: int) -> tuple[float, float]:
    """Mean ratio, and least sine over REGULAR_SINE, both signed by the volume."""
    six, total, square, product = _sizes(p, a, b, c, d)
    if product <= 0.0 or total <= 0.0:
        return -1.0, -1.0
    ratio = 12.0 * np.cbrt(0.25 * six * six) / total
    if six < 0.0:
        ratio = -ratio
    return ratio, six * np.sqrt(square / product) / REGULAR_SINE


@compiled(parallel=True)
def qualities(p: FloatArray, t: IntArray, out: FloatArray) -> None:
    """Lesser of mean ratio and least sine of each tetrahedron."""
    for i in numba.prange(len(t)):
        ratio, sine = _shape(p, t[i, 0], t[i, 1], t[i, 2], t[i, 3])
        out[i] = min(ratio, sine)


@compiled()
def _worst(p: FloatArray, t: IntArray, start: IntArray, around: IntArray, v: int, enough: float) -> float:
    """Worst quality of the elements around a point; any value not above ``enough`` as soon as it is certain."""
    worst: float = np.inf
    for k in range(start[v], start[v + 1]):
        i = around[k]
        ratio, sine = _shape(p, t[i, 0], t[i, 1], t[i, 2], t[i, 3])
        worst = min(worst, ratio, sine)
        if worst <= enough:
            return worst
    return worst


@compiled()
def _reached(p: FloatArray, t: IntArray, start: IntArray, around: IntArray, v: int, enough: float) -> bool:
    """Whether all elements around a point have at least a positive quality: powers of both are compared."""
    sine = (enough * REGULAR_SINE) ** 2
    for k in range(start[v], start[v + 1]):
        i = around[k]
        six, total, square, product = _sizes(p, t[i, 0], t[i, 1], t[i, 2], t[i, 3])
        if six <= 0.0 or product <= 0.0:
            return False
        if 432.0 * six * six < (enough * total) ** 3 or six * six * square < sine * product:
            return False
    return True


@compiled()
def _mark(t: IntArray, start: IntArray, around: IntArray, v: int, fresh: BoolArray) -> None:
    """Note that a point moved: a search around any point of its star may now find more."""
    for k in range(start[v], start[v + 1]):
        for j in range(4):
            fresh[t[around[k], j]] = True


@compiled(parallel=True)
def try_places(
    p: FloatArray,
    t: IntArray,
    start: IntArray,
    around: IntArray,
    order: IntArray,
    first: IntArray,
    places: FloatArray,
    sound: float,
    fresh: BoolArray,
) -> None:
    """Put coloured points at their rows of ``places`` where the worst element around stays sound or gets no worse."""
    for c in range(len(first) - 1):
        for n in numba.prange(first[c], first[c + 1]):
            v = order[n]
            x, y, z = p[v, 0], p[v, 1], p[v, 2]
            p[v, 0], p[v, 1], p[v, 2] = places[v, 0], places[v, 1], places[v, 2]
            after = _worst(p, t, start, around, v, -np.inf)
            if after < sound:
                p[v, 0], p[v, 1], p[v, 2] = x, y, z
                if _worst(p, t, start, around, v, -np.inf) <= after:
                    p[v, 0], p[v, 1], p[v, 2] = places[v, 0], places[v, 1], places[v, 2]
            if p[v, 0] != x or p[v, 1] != y or p[v, 2] != z:
                _mark(t, start, around, v, fresh)


@compiled()
def _gather(p: FloatArray, t: IntArray, start: IntArray, around: IntArray, v: int, star: FloatArray) -> float:
    """What the mean ratio of each element around a point depends on as the point moves; their mean edge length there.

    A row holds, with the point as origin and a, b, c the other corners: the vector N and the number k of six volumes
    ``k - N.x``, the vector m and the number q of the sum of squared edges ``3 x.x - 2 m.x + q``.
    """
    length = 0.0
    for k in range(start[v], start[v + 1]):
        i = around[k]
        # The other corners so that the point sees them as the first corner of an element sees the rest.
        if t[i, 0] == v:
            a, b, c = t[i, 1], t[i, 2], t[i, 3]
        elif t[i, 1] == v:
            a, b, c = t[i, 0], t[i, 3], t[i, 2]
        elif t[i, 2] == v:
            a, b, c = t[i, 3], t[i, 0], t[i, 1]
        else:
            a, b, c = t[i, 2], t[i, 1], t[i, 0]
        ax, ay, az = p[a, 0] - p[v, 0], p[a, 1] - p[v, 1], p[a, 2] - p[v, 2]
        bx, by, bz = p[b, 0] - p[v, 0], p[b, 1] - p[v, 1], p[b, 2] - p[v, 2]
        cx, cy, cz = p[c, 0] - p[v, 0], p[c, 1] - p[v, 1], p[c, 2] - p[v, 2]
        ux, uy, uz, wx, wy, wz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
        nx, ny, nz = uy * wz - uz * wy, uz * wx - ux * wz, ux * wy - uy * wx
        aa, bb, cc = ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz
        far = ux * ux + uy * uy + uz * uz + wx * wx + wy * wy + wz * wz
        far += (cx - bx) ** 2 + (cy - by) ** 2 + (cz - bz) ** 2
        row = star[k - start[v]]
        row[0], row[1], row[2], row[3] = nx, ny, nz, nx * ax + ny * ay + nz * az
        row[4], row[5], row[6], row[7] = ax + bx + cx, ay + by + cy, az + bz + cz, aa + bb + cc + far
        length += np.sqrt(aa) + np.sqrt(bb) + np.sqrt(cc)
    return float(length / (3.0 * (start[v + 1] - start[v])))


@compiled()
def _mean_at(star: FloatArray, count: int, x: float, y: float, z: float) -> float:
    """Sum of the mean ratios of a star with its point at x, y, z; minus infinity if an element is inverted."""
    total = 0.0
    for k in range(count):
        six = star[k, 3] - star[k, 0] * x - star[k, 1] * y - star[k, 2] * z
        if six <= 0.0:
            return -np.inf
        edges = 3.0 * (x * x + y * y + z * z) + star[k, 7]
        edges -= 2.0 * (star[k, 4] * x + star[k, 5] * y + star[k, 6] * z)
        total += 12.0 * _cube_root(0.25 * six * six) / edges
    return total


@compiled()
def _gradient(star: FloatArray, count: int, x: float, y: float, z: float, out: FloatArray) -> None:
    """Gradient of that sum, at a place where no element is inverted."""
    out[:] = 0.0
    for k in range(count):
        six = star[k, 3] - star[k, 0] * x - star[k, 1] * y - star[k, 2] * z
        edges = 3.0 * (x * x + y * y + z * z) + star[k, 7]
        edges -= 2.0 * (star[k, 4] * x + star[k, 5] * y + star[k, 6] * z)
        ratio = 12.0 * _cube_root(0.25 * six * six) / edges
        by_volume, by_edges = 2.0 / 3.0 * ratio / six, 2.0 * ratio / edges
        out[0] -= by_volume * star[k, 0] + by_edges * (3.0 * x - star[k, 4])
        out[1] -= by_volume * star[k, 1] + by_edges * (3.0 * y - star[k, 5])
        out[2] -= by_volume * star[k, 2] + by_edges * (3.0 * z - star[k, 6])


@compiled()
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


@compiled()
def _ascend(
    p: FloatArray,
    t: IntArray,
    start: IntArray,
    around: IntArray,
    v: int,
    freedom: int,
    basis: FloatArray,
    poor: float,
    star: FloatArray,
    slope: FloatArray,
) -> bool:
    """Move one point along the gradient of the mean ratio around it, no element becoming poor, or poorer if it is."""
    count = start[v + 1] - start[v]
    size = (_FIRST_STEP if freedom == 3 else _SURFACE_STEP) * _gather(p, t, start, around, v, star)
    best = _mean_at(star, count, 0.0, 0.0, 0.0)
    if best == -np.inf:  # an inverted element has no gradient; the search for the worst element mends it
        return False
    hx, hy, hz = p[v, 0], p[v, 1], p[v, 2]
    x, y, z, before = 0.0, 0.0, 0.0, np.inf
    moved = False
    for _ in range(_ASCENTS):
        _gradient(star, count, x, y, z, slope)
        if _project(slope, freedom, basis) == 0.0:
            break
        better = False
        for _ in range(_BACKTRACKS):
            nx, ny, nz = x + size * slope[0], y + size * slope[1], z + size * slope[2]
            value = _mean_at(star, count, nx, ny, nz)
            if value > best:
                p[v, 0], p[v, 1], p[v, 2] = hx + nx, hy + ny, hz + nz
                sound = _reached(p, t, start, around, v, poor)
                if not sound:
                    after = _worst(p, t, start, around, v, -np.inf)
                    if before == np.inf:
                        p[v, 0], p[v, 1], p[v, 2] = hx, hy, hz
                        before = _worst(p, t, start, around, v, -np.inf)
                    sound = after >= min(poor, before)
                if sound:
                    x, y, z, best, better = nx, ny, nz, value, True
                    break
            size *= 0.5
        if not better:
            break
        moved = True
    p[v, 0], p[v, 1], p[v, 2] = hx + x, hy + y, hz + z
    return moved


@compiled(parallel=True)
def relax(
    p: FloatArray,
    t: IntArray,
    start: IntArray,
    around: IntArray,
    order: IntArray,
    first: IntArray,
    freedom: IntArray,
    basis: FloatArray,
    poor: float,
    fresh: BoolArray,
) -> None:
    """Move each point once to a better mean ratio around it, colour by colour."""
    largest = 0
    for v in range(len(p)):
        largest = max(largest, start[v + 1] - start[v])
    for c in range(len(first) - 1):
        chunks = (first[c + 1] - first[c] + _CHUNK - 1) // _CHUNK
        for chunk in numba.prange(chunks):
            star, slope = np.empty((largest, 8)), np.empty(3)
            for n in range(first[c] + chunk * _CHUNK, min(first[c] + (chunk + 1) * _CHUNK, first[c + 1])):
                v = order[n]
                if freedom[v] > 0 and _ascend(p, t, start, around, v, freedom[v], basis[v], poor, star, slope):
                    _mark(t, start, around, v, fresh)


@compiled()
def _climb(
    p: FloatArray, t: IntArray, start: IntArray, around: IntArray, v: int, freedom: int, basis: FloatArray
) -> bool:
    """Move one point to where the worst element around it is best: compass search along its free directions."""
    best = _worst(p, t, start, around, v, -np.inf)
    length, count = 0.0, 0
    mx, my, mz = 0.0, 0.0, 0.0
    for k in range(start[v], start[v + 1]):
        for j in range(4):
            w = t[around[k], j]
            if w != v:
                x, y, z = p[w, 0] - p[v, 0], p[w, 1] - p[v, 1], p[w, 2] - p[v, 2]
                length += np.sqrt(x * x + y * y + z * z)
                mx, my, mz = mx + x, my + y, mz + z
                count += 1
    size = (_FIRST_STEP if freedom == 3 else _SURFACE_STEP) * length / count
    moved = False
    if freedom == 3:  # first the middle of the neighbours
        x, y, z = p[v, 0], p[v, 1], p[v, 2]
        p[v, 0], p[v, 1], p[v, 2] = x + mx / count, y + my / count, z + mz / count
        value = _worst(p, t, start, around, v, best)
        if value > best:
            best, moved = value, True
        else:
            p[v, 0], p[v, 1], p[v, 2] = x, y, z
    for _ in range(_HALVINGS):
        for _ in range(4):
            x, y, z = p[v, 0], p[v, 1], p[v, 2]
            chosen, sign = -1, 0.0
            for k in range(freedom):
                for way in (-1.0, 1.0):
                    step = way * size
                    p[v, 0], p[v, 1], p[v, 2] = x + step * basis[k, 0], y + step * basis[k, 1], z + step * basis[k, 2]
                    value = _worst(p, t, start, around, v, best)
                    if value > best:
                        best, chosen, sign = value, k, step
            if chosen < 0:
                p[v, 0], p[v, 1], p[v, 2] = x, y, z
                break
            moved = True
            for axis, home in enumerate((x, y, z)):
                p[v, axis] = home + sign * basis[chosen, axis]
        size *= 0.5
    return moved


@compiled(parallel=True)
def search(
    p: FloatArray,
    t: IntArray,
    start: IntArray,
    around: IntArray,
    order: IntArray,
    first: IntArray,
    freedom: IntArray,
    basis: FloatArray,
    fresh: BoolArray,
) -> None:
    """Move each point that is fresh to where the worst element around it is best, colour by colour.

    A point is fresh while something in its star has moved since it was searched last: else it would find nothing.
    """
    for c in range(len(first) - 1):
        for n in numba.prange(first[c], first[c + 1]):
            v = order[n]
            if freedom[v] > 0 and fresh[v]:
                fresh[v] = False
                if _climb(p, t, start, around, v, freedom[v], basis[v]):
                    _mark(t, start, around, v, fresh)
