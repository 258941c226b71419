"""Quality of tetrahedra, and of the worst one around a point, as compiled kernels."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.model import BoolArray, FloatArray, IntArray

#: Sine of the regular tetrahedron's dihedral angle.
REGULAR_SINE: Final = 2.0 * np.sqrt(2.0) / 3.0


@compiled(inner=True, part=True)
def sizes(
    ux: float, uy: float, uz: float, vx: float, vy: float, vz: float, wx: float, wy: float, wz: float
) -> tuple[float, float, float, float]:
    """What the shape with three edges from a first corner is made of.

    Six volumes, the sum of squared edges, and two numbers for the least sine: the squared sine at an edge is that of
    six volumes times its length by the product of the areas of its two faces. Over the product of all four areas (the
    last number) the least of them takes one division.
    """
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


@compiled(inner=True)
def _shape(p: FloatArray, a: int, b: int, c: int, d: int) -> tuple[float, float]:
    """Mean ratio, and least sine over REGULAR_SINE, both signed by the volume."""
    six, total, square, product = sizes(
        *(p[b, 0] - p[a, 0], p[b, 1] - p[a, 1], p[b, 2] - p[a, 2]),
        *(p[c, 0] - p[a, 0], p[c, 1] - p[a, 1], p[c, 2] - p[a, 2]),
        *(p[d, 0] - p[a, 0], p[d, 1] - p[a, 1], p[d, 2] - p[a, 2]),
    )
    if product <= 0.0 or total <= 0.0:
        return -1.0, -1.0
    ratio = 12.0 * np.cbrt(0.25 * six * six) / total
    if six < 0.0:
        ratio = -ratio
    return ratio, six * np.sqrt(square / product) / REGULAR_SINE


@compiled(grain=2048, writes="p out")
def qualities(first: int, last: int, p: FloatArray, t: IntArray, moved: BoolArray, out: FloatArray) -> None:
    """Lesser of mean ratio and least sine of each tetrahedron some point of which has moved; the others stay.

    ``p`` may be written to, as in kernels that move points: so these share what they call.
    """
    for i in range(first, last):
        if moved[t[i, 0]] or moved[t[i, 1]] or moved[t[i, 2]] or moved[t[i, 3]]:
            ratio, sine = _shape(p, t[i, 0], t[i, 1], t[i, 2], t[i, 3])
            out[i] = min(ratio, sine)


@compiled(inner=True)
def worst_around(mesh: Any, v: int, enough: float) -> float:
    """Worst quality of the elements around a point; any value not above ``enough`` as soon as it is certain.

    ``mesh`` is points, tetrahedra, and those around each point as row starts and columns.
    """
    p, t, start, around = mesh
    worst: float = np.inf
    for k in range(start[v], start[v + 1]):
        i = around[k]
        ratio, sine = _shape(p, t[i, 0], t[i, 1], t[i, 2], t[i, 3])
        worst = min(worst, ratio, sine)
        if worst <= enough:
            return worst
    return worst
