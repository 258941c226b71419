"""Vertices on a smooth surface in, the same slid along it to even triangles out: compiled loops.

The measure of a triangle is its inverse mean ratio [1]_, squared, and how far its area is from the mean; where it is
folded its area is replaced by a positive function of it [2]_, so that the same sweeps unfold and smooth.

References
----------
.. [1] Knupp, Algebraic mesh quality metrics, SIAM J. Sci. Comput. 23(1), 2001. doi:10.1137/S1064827500371499
.. [2] Escobar et al., Simultaneous untangling and smoothing of tetrahedral meshes, Comput. Methods Appl. Mech. Eng.
   192, 2003. doi:10.1016/S0045-7825(03)00299-8
"""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.compiled import compiled
from femprep.geometry.patches import settle

#: Step of differences, and longest move in one sweep, in edge lengths.
_PROBE = 1e-3
_LEAP = 0.5
#: What a folded triangle counts where areas are not regularised.
_FOLDED = 1e30


@compiled()
def _triangle(points: Any, normals: Any, i: int, j: int, k: int, area: float, size: float, delta: float) -> float:
    """Measure of one triangle: 1 where it is equilateral and of the area asked for."""
    ax = points[j, 0] - points[i, 0]
    ay = points[j, 1] - points[i, 1]
    az = points[j, 2] - points[i, 2]
    bx = points[k, 0] - points[i, 0]
    by = points[k, 1] - points[i, 1]
    bz = points[k, 2] - points[i, 2]
    nx = normals[i, 0] + normals[j, 0] + normals[k, 0]
    ny = normals[i, 1] + normals[j, 1] + normals[k, 1]
    nz = normals[i, 2] + normals[j, 2] + normals[k, 2]
    length = np.sqrt(nx * nx + ny * ny + nz * nz) + 1e-300
    det = (nx * (ay * bz - az * by) + ny * (az * bx - ax * bz) + nz * (ax * by - ay * bx)) / (length * 2.0 * area)
    if delta > 0.0:
        det = 0.5 * (det + np.sqrt(det * det + 4.0 * delta * delta))
    elif det <= 0.0:
        return _FOLDED
    # |a|^2 + |b|^2 + |a - b|^2 over 4 sqrt(3) areas.
    sides = 2.0 * (ax * ax + ay * ay + az * az + bx * bx + by * by + bz * bz - ax * bx - ay * by - az * bz)
    skew = sides / (6.928203230275509 * area * det)
    # Areas add up to the surface's: only a square keeps single triangles from growing large.
    return float(skew * skew + size * ((det * det + 2.0 / det) / 3.0 - 1.0))


@compiled()
def _around(
    points: Any, normals: Any, cells: Any, starts: Any, incident: Any, v: int, area: float, size: float, delta: float
) -> float:
    """Sum over the triangles around a vertex."""
    total = 0.0
    for n in range(starts[v], starts[v + 1]):
        c = incident[n]
        total += _triangle(points, normals, cells[c, 0], cells[c, 1], cells[c, 2], area, size, delta)
    return total


@compiled()
def _move(
    points: Any,
    normals: Any,
    near: Any,
    v: int,
    surface: Any,
    cells: Any,
    starts: Any,
    incident: Any,
    planes: Any,
    area: float,
    size: float,
    delta: float,
    edge: float,
) -> float:
    """One damped Newton step of one vertex along the surface; returns how far it moved."""
    vertices, frames, coefficients, reach, ring = surface
    n = normals[v].copy()
    old = points[v].copy()
    axis = 0
    if abs(n[1]) < abs(n[axis]):
        axis = 1
    if abs(n[2]) < abs(n[axis]):
        axis = 2
    one = np.empty(3)
    one[axis] = 0.0
    one[(axis + 1) % 3] = n[(axis + 2) % 3]
    one[(axis + 2) % 3] = -n[(axis + 1) % 3]
    one /= np.sqrt(one[0] ** 2 + one[1] ** 2 + one[2] ** 2)
    two = np.empty(3)
    two[0] = n[1] * one[2] - n[2] * one[1]
    two[1] = n[2] * one[0] - n[0] * one[2]
    two[2] = n[0] * one[1] - n[1] * one[0]

    e = _PROBE * edge
    now = _around(points, normals, cells, starts, incident, v, area, size, delta)
    values = np.empty(5)
    for s in range(5):
        p = e if s == 0 or s == 4 else -e if s == 1 else 0.0
        q = e if s == 2 or s == 4 else -e if s == 3 else 0.0
        for k in range(3):
            points[v, k] = old[k] + p * one[k] + q * two[k]
        values[s] = _around(points, normals, cells, starts, incident, v, area, size, delta)
    gp = (values[0] - values[1]) / (2.0 * e)
    gq = (values[2] - values[3]) / (2.0 * e)
    hpp = (values[0] - 2.0 * now + values[1]) / (e * e)
    hqq = (values[2] - 2.0 * now + values[3]) / (e * e)
    hpq = (values[4] - values[0] - values[2] + now) / (e * e)
    # Shift the smaller eigenvalue up to a share of the larger one.
    mean = 0.5 * (hpp + hqq)
    half = np.sqrt(0.25 * (hpp - hqq) ** 2 + hpq * hpq)
    most = max(abs(mean + half), abs(mean - half)) + 1e-12
    shift = max(0.0, 0.02 * most - (mean - half))
    hpp += shift
    hqq += shift
    det = hpp * hqq - hpq * hpq
    p = -(gp * hqq - gq * hpq) / det
    q = -(gq * hpp - gp * hpq) / det
    far = np.sqrt(p * p + q * q)
    scale = min(1.0, _LEAP * edge / max(far, 1e-300))
    fresh = np.empty(3)
    if far > 1e-6 * edge:
        for _ in range(5):
            for k in range(3):
                points[v, k] = old[k] + scale * (p * one[k] + q * two[k])
            place = settle(points[v], fresh, near[v], 0, planes, vertices, frames, coefficients, reach, ring)
            for k in range(3):
                normals[v, k] = fresh[k]
            if _around(points, normals, cells, starts, incident, v, area, size, delta) < now:
                near[v] = place
                return float(scale * far)
            scale *= 0.4
    for k in range(3):
        points[v, k] = old[k]
        normals[v, k] = n[k]
    return 0.0


@compiled()
def sweep(
    points: Any,
    normals: Any,
    near: Any,
    surface: Any,
    cells: Any,
    starts: Any,
    incident: Any,
    planes: Any,
    area: float,
    size: float,
    delta: float,
    edge: float,
    moved: Any,
) -> None:
    """One sweep over all vertices, in place, in the order of their numbers."""
    for v in range(len(points)):
        moved[v] = _move(points, normals, near, v, surface, cells, starts, incident, planes, area, size, delta, edge)
