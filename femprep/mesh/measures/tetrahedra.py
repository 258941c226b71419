"""Linear tetrahedra in, all their measures out in one pass: what ``volume_elements`` defines, but quick."""

from __future__ import annotations

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.model import FloatArray, IntArray

#: The rows that :func:`tetra_measures` fills.
NAMES = (
    *("volume", "scaled_jacobian", "relative_jacobian", "mean_ratio", "minimum_dihedral", "maximum_dihedral"),
    *("shortest_edge", "longest_edge", "edge_ratio", "characteristic_length", "radius_ratio", "aspect_ratio"),
)


def tetra_measures(points: FloatArray, cells: IntArray) -> dict[str, FloatArray]:
    """All measures of tetrahedra with straight edges.

    Parameters
    ----------
    points : (n, 3) array
        mm.
    cells : (m, 4) array

    Returns
    -------
    dict of str to (m,) array
        As from ``volume_elements.element_measures``.
    """
    table = np.empty((len(NAMES), len(cells)))
    _measure(len(cells), np.ascontiguousarray(points), np.ascontiguousarray(cells), table)
    return dict(zip(NAMES, table))


def tetra_volumes(points: FloatArray, cells: IntArray) -> FloatArray:
    """Volume of each of tetrahedra ``(m, 4)`` with straight edges, ``(m,)`` mm3: bit for bit the measure's."""
    out = np.empty(len(cells))
    _volumes(len(cells), np.ascontiguousarray(points), np.ascontiguousarray(cells), out)
    return out


@compiled(grain=16384, writes="out")
def _volumes(first: int, last: int, p: FloatArray, t: IntArray, out: FloatArray) -> None:
    for i in range(first, last):
        a, b, c, d = t[i, 0], t[i, 1], t[i, 2], t[i, 3]
        ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
        vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
        wx, wy, wz = p[d, 0] - p[a, 0], p[d, 1] - p[a, 1], p[d, 2] - p[a, 2]
        bx, by, bz = vy * wz - vz * wy, vz * wx - vx * wz, vx * wy - vy * wx
        out[i] = (ux * bx + uy * by + uz * bz) / 6.0


@compiled(inner=True, part=True)
def _angle(along: float, volume: float, dot: float) -> float:
    """Dihedral angle at an edge, degrees, from its length, six volumes and the product of its two faces' normals."""
    return float(np.degrees(np.arctan2(along * volume, 0.0 - dot)))


@compiled(grain=1024, writes="out")
def _measure(first: int, last: int, p: FloatArray, t: IntArray, out: FloatArray) -> None:
    for i in range(first, last):
        a, b, c, d = t[i, 0], t[i, 1], t[i, 2], t[i, 3]
        ux, uy, uz = p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]
        vx, vy, vz = p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]
        wx, wy, wz = p[d, 0] - p[a, 0], p[d, 1] - p[a, 1], p[d, 2] - p[a, 2]
        # Twice the area vectors of the faces opposite to d, c, b and a, all to the same side.
        dx, dy, dz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        cx, cy, cz = wy * uz - wz * uy, wz * ux - wx * uz, wx * uy - wy * ux
        bx, by, bz = vy * wz - vz * wy, vz * wx - vx * wz, vx * wy - vy * wx
        rx, ry, rz, sx, sy, sz = vx - ux, vy - uy, vz - uz, wx - ux, wy - uy, wz - uz
        ax, ay, az = sy * rz - sz * ry, sz * rx - sx * rz, sx * ry - sy * rx
        six = ux * bx + uy * by + uz * bz
        area_a, area_b = np.sqrt(ax * ax + ay * ay + az * az), np.sqrt(bx * bx + by * by + bz * bz)
        area_c, area_d = np.sqrt(cx * cx + cy * cy + cz * cz), np.sqrt(dx * dx + dy * dy + dz * dz)
        uu, vv, ww = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, wx * wx + wy * wy + wz * wz
        rr, ss = rx * rx + ry * ry + rz * rz, sx * sx + sy * sy + sz * sz
        qq = (wx - vx) ** 2 + (wy - vy) ** 2 + (wz - vz) ** 2
        ab, ac, ad, bc, bd, cd = np.sqrt(uu), np.sqrt(vv), np.sqrt(ww), np.sqrt(rr), np.sqrt(ss), np.sqrt(qq)
        short, long = min(ab, ac, ad, bc, bd, cd), max(ab, ac, ad, bc, bd, cd)
        # The angle between two faces from the area vectors of both, which meet at the edge between the other corners.
        angle = _angle(ab, six, cx * dx + cy * dy + cz * dz)
        least = most = angle
        for along, dot in (
            (ac, bx * dx + by * dy + bz * dz),
            (ad, bx * cx + by * cy + bz * cz),
            (bc, ax * dx + ay * dy + az * dz),
            (bd, ax * cx + ay * cy + az * cz),
            (cd, ax * bx + ay * by + az * bz),
        ):
            angle = _angle(along, six, dot)
            least, most = min(least, angle), max(most, angle)
        product = max(ab * ac * ad, ab * bc * bd, ac * bc * cd, ad * bd * cd)
        faces, edges = area_a + area_b + area_c + area_d, uu + vv + ww + rr + ss + qq
        largest = max(area_a, area_b, area_c, area_d)
        inscribed = six / faces if faces > 0.0 else 0.0
        ox = uu * bx + vv * cx + ww * dx
        oy = uu * by + vv * cy + ww * dy
        oz = uu * bz + vv * cz + ww * dz
        centre = np.sqrt(ox * ox + oy * oy + oz * oz)
        out[0, i] = six / 6.0
        # Of negative quotients the least has the least denominator.
        smaller = product if six >= 0.0 else min(ab * ac * ad, ab * bc * bd, ac * bc * cd, ad * bd * cd)
        out[1, i] = np.sqrt(2.0) * six / smaller if smaller > 0.0 else 0.0
        out[2, i] = np.sign(six)
        ratio = 12.0 * np.cbrt(0.25 * six * six) / edges if edges > 0.0 else 0.0
        out[3, i] = ratio if six >= 0.0 else -ratio
        out[4, i], out[5, i] = least, most
        out[6, i], out[7, i] = short, long
        out[8, i] = long / short if short > 0.0 else np.inf
        out[9, i] = six / largest if largest > 0.0 else 0.0
        out[10, i] = 6.0 * inscribed * abs(six) / centre if centre > 0.0 else 0.0
        size = 2.0 * np.sqrt(6.0) * abs(inscribed)
        out[11, i] = long / size if size > 0.0 else np.inf
