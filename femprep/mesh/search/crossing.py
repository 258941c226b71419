"""Two triangles to whether they meet, exactly: every case of touching, lying in one plane or having no area."""

from __future__ import annotations

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.mesh.search.predicates import orient2d, orient3d
from femprep.model import FloatArray


@compiled(inner=True)
def _turn(a: FloatArray, b: FloatArray, c: FloatArray, axis: int) -> int:
    """Sense of a, b, c seen along an axis."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    return orient2d(a[i], a[j], b[i], b[j], c[i], c[j])


@compiled(inner=True)
def _in_box(p: FloatArray, q: FloatArray, r: FloatArray, axis: int) -> bool:
    """Whether r lies in the box of p and q, seen along an axis."""
    inside = True
    for k in range(3):
        inside &= k == axis or min(p[k], q[k]) <= r[k] <= max(p[k], q[k])
    return inside


@compiled(inner=True)
def _segments_meet_flat(p: FloatArray, q: FloatArray, r: FloatArray, s: FloatArray, axis: int) -> bool:
    """Whether two closed segments meet, seen along an axis."""
    r_side, s_side = _turn(p, q, r, axis), _turn(p, q, s, axis)
    p_side, q_side = _turn(r, s, p, axis), _turn(r, s, q, axis)
    if r_side * s_side < 0 and p_side * q_side < 0:
        return True
    return (
        (r_side == 0 and _in_box(p, q, r, axis))
        or (s_side == 0 and _in_box(p, q, s, axis))
        or (p_side == 0 and _in_box(r, s, p, axis))
        or (q_side == 0 and _in_box(r, s, q, axis))
    )


@compiled(inner=True)
def _segments_meet(p: FloatArray, q: FloatArray, r: FloatArray, s: FloatArray) -> bool:
    """Whether two closed segments in space meet; either may be a point."""
    if orient3d(p, q, r, s) != 0:
        return False
    for axis in range(3):
        # Seen along this axis their common plane is no line, so that meeting there is meeting in space.
        if (
            _turn(p, q, r, axis) != 0
            or _turn(p, q, s, axis) != 0
            or _turn(r, s, p, axis) != 0
            or _turn(r, s, q, axis) != 0
        ):
            return _segments_meet_flat(p, q, r, s, axis)
    # All four points on one line: the segments meet where their boxes do.
    overlap = True
    for k in range(3):
        overlap &= min(p[k], q[k]) <= max(r[k], s[k]) and min(r[k], s[k]) <= max(p[k], q[k])
    return overlap


@compiled(inner=True)
def _flat_segment_meets(p: FloatArray, q: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray) -> bool:
    """Whether the segment p, q meets the triangle a, b, c of the same plane; the triangle may have no area."""
    for axis in range(3):
        turn = _turn(a, b, c, axis)
        if turn != 0:
            # Seen along this axis the plane is no line, so that meeting there is meeting in space.
            first, second, third = _turn(a, b, p, axis), _turn(b, c, p, axis), _turn(c, a, p, axis)
            if first != -turn and second != -turn and third != -turn:
                return True
            return (
                _segments_meet_flat(p, q, a, b, axis)
                or _segments_meet_flat(p, q, b, c, axis)
                or _segments_meet_flat(p, q, c, a, axis)
            )
    return _segments_meet(p, q, a, b) or _segments_meet(p, q, b, c) or _segments_meet(p, q, c, a)


@compiled(inner=True)
def _segment_meets(
    p: FloatArray, q: FloatArray, p_side: int, q_side: int, a: FloatArray, b: FloatArray, c: FloatArray
) -> bool:
    """Whether the closed segment p, q meets the closed triangle a, b, c, given the sides of its plane they lie on."""
    if p_side * q_side > 0:
        return False
    if p_side == 0 and q_side == 0:
        return _flat_segment_meets(p, q, a, b, c)
    first = orient3d(p, q, a, b)
    second = orient3d(p, q, b, c)
    if first * second < 0:
        return False
    third = orient3d(p, q, c, a)
    return first * third >= 0 and second * third >= 0


@compiled(inner=True)
def apart(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, e: FloatArray, f: FloatArray) -> bool:
    """Whether a plane across the line between their middles separates the triangles for certain: the quick answer.

    Heights above a are compared with room for rounding, so that False only means not certain.
    """
    nx = (a[0] - d[0]) + (b[0] - e[0]) + (c[0] - f[0])
    ny = (a[1] - d[1]) + (b[1] - e[1]) + (c[1] - f[1])
    nz = (a[2] - d[2]) + (b[2] - e[2]) + (c[2] - f[2])
    lowest, highest, size = 0.0, -np.inf, 0.0
    for i in range(5):
        p = b if i == 0 else c if i == 1 else d if i == 2 else e if i == 3 else f
        x, y, z = (p[0] - a[0]) * nx, (p[1] - a[1]) * ny, (p[2] - a[2]) * nz
        size = max(size, abs(x) + abs(y) + abs(z))
        if i < 2:
            lowest = min(lowest, x + y + z)
        else:
            highest = max(highest, x + y + z)
    return lowest - highest > 1e-14 * size


@compiled(inner=True)
def triangles_meet(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray, e: FloatArray, f: FloatArray) -> bool:
    """Whether the closed triangles a, b, c and d, e, f have a point in common."""
    d_side, e_side, f_side = orient3d(a, b, c, d), orient3d(a, b, c, e), orient3d(a, b, c, f)
    if d_side == e_side == f_side and d_side != 0:
        return False
    a_side, b_side, c_side = orient3d(d, e, f, a), orient3d(d, e, f, b), orient3d(d, e, f, c)
    if a_side == b_side == c_side and a_side != 0:
        return False
    return (
        _segment_meets(d, e, d_side, e_side, a, b, c)
        or _segment_meets(e, f, e_side, f_side, a, b, c)
        or _segment_meets(f, d, f_side, d_side, a, b, c)
        or _segment_meets(a, b, a_side, b_side, d, e, f)
        or _segment_meets(b, c, b_side, c_side, d, e, f)
        or _segment_meets(c, a, c_side, a_side, d, e, f)
    )


@compiled(inner=True)
def apart_at(v: FloatArray, a: FloatArray, b: FloatArray, d: FloatArray, e: FloatArray) -> bool:
    """Whether a plane through v separates a, b from d, e for certain: the quick answer for most of a vertex's fan.

    The plane's normal joins the middles of the two sides opposite v, or of what is left of them at the same distance
    from v; else the plane is that of one triangle. Each side of it is decided with room for rounding, so that False
    only means not certain.
    """
    for equal in range(2):
        nx, ny, nz = 0.0, 0.0, 0.0
        for i in range(4):
            p = a if i == 0 else b if i == 1 else d if i == 2 else e
            x, y, z = p[0] - v[0], p[1] - v[1], p[2] - v[2]
            size = (1.0 if i < 2 else -1.0) / (np.sqrt(x * x + y * y + z * z) if equal else 1.0)
            nx, ny, nz = nx + size * x, ny + size * y, nz + size * z
        between = True
        for i in range(4):
            p = a if i == 0 else b if i == 1 else d if i == 2 else e
            x, y, z = (p[0] - v[0]) * nx, (p[1] - v[1]) * ny, (p[2] - v[2]) * nz
            side = x + y + z if i < 2 else -(x + y + z)
            between &= side > 1e-14 * (abs(x) + abs(y) + abs(z))
        if between:
            return True
    return _off_plane(v, a, b, d, e) or _off_plane(v, d, e, a, b)


@compiled(inner=True)
def _off_plane(v: FloatArray, a: FloatArray, b: FloatArray, d: FloatArray, e: FloatArray) -> bool:
    """Whether d and e lie on one side of the plane v, a, b for certain."""
    ux, uy, uz = a[0] - v[0], a[1] - v[1], a[2] - v[2]
    wx, wy, wz = b[0] - v[0], b[1] - v[1], b[2] - v[2]
    heights, sure = 0.0, True
    for i in range(2):
        p = d if i == 0 else e
        x, y, z = p[0] - v[0], p[1] - v[1], p[2] - v[2]
        height = x * (uy * wz - uz * wy) + y * (uz * wx - ux * wz) + z * (ux * wy - uy * wx)
        size = abs(x) * (abs(uy * wz) + abs(uz * wy)) + abs(y) * (abs(uz * wx) + abs(ux * wz))
        size += abs(z) * (abs(ux * wy) + abs(uy * wx))
        sure &= abs(height) > 1e-14 * size
        heights = height if i == 0 else heights * height
    return sure and heights > 0.0


@compiled(inner=True)
def meet_beyond_vertex(v: FloatArray, a: FloatArray, b: FloatArray, d: FloatArray, e: FloatArray) -> bool:
    """Whether the triangles v, a, b and v, d, e have more than their vertex v in common.

    What they share is convex and holds v, so that more than v reaches a side opposite v.
    """
    if _segment_meets(d, e, orient3d(v, a, b, d), orient3d(v, a, b, e), v, a, b):
        return True
    return _segment_meets(a, b, orient3d(v, d, e, a), orient3d(v, d, e, b), v, d, e)


@compiled(inner=True)
def apart_over(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> bool:
    """Whether c and d lead away from the edge a, b in other directions for certain: the quick answer for most."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    px, py, pz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    qx, qy, qz = d[0] - a[0], d[1] - a[1], d[2] - a[2]
    mx, my, mz = uy * pz - uz * py, uz * px - ux * pz, ux * py - uy * px
    nx, ny, nz = uy * qz - uz * qy, uz * qx - ux * qz, ux * qy - uy * qx
    dot = mx * nx + my * ny + mz * nz
    m, n = mx * mx + my * my + mz * mz, nx * nx + ny * ny + nz * nz
    u, p, q = ux * ux + uy * uy + uz * uz, px * px + py * py + pz * pz, qx * qx + qy * qy + qz * qz
    flat = dot < 0.0 and dot * dot > 1e-6 * m * n and m > 1e-12 * u * p and n > 1e-12 * u * q
    return flat or _off_plane(a, b, c, d, d)


@compiled(inner=True)
def meet_beyond_edge(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> bool:
    """Whether the triangles a, b, c and a, b, d lie folded onto each other: in one plane, on one side of a, b."""
    if orient3d(a, b, c, d) != 0:
        return False
    for axis in range(3):
        turn = _turn(a, b, c, axis)
        if turn != 0:
            return _turn(a, b, d, axis) == turn
    return False
