"""Two matched surfaces in, the same with their vertices slid to better shaped elements between them: compiled loops.

Inner and outer vertex of the same number are joined by a straight line; elements lie between cells and layers. Every
vertex moves along its own surface, rim vertices along the curve in which it meets their plane, so that surfaces,
planes and connectivity stay as they are.

The measure is the inverse mean ratio at the corners of the elements [1]_, with the determinant replaced by a positive
function of it while elements are inverted [2]_: the same sweeps untangle and smooth.

References
----------
.. [1] Knupp, Algebraic mesh quality metrics, SIAM J. Sci. Comput. 23(1), 2001. doi:10.1137/S1064827500371499
.. [2] Escobar et al., Simultaneous untangling and smoothing of tetrahedral meshes, Comput. Methods Appl. Mech. Eng.
   192, 2003. doi:10.1016/S0045-7825(03)00299-8
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import prange

from femprep.compiled import compiled
from femprep.geometry.patches import settle

IntArray = npt.NDArray[np.int64]

#: Step of differences, and longest move in one sweep, in edge lengths.
_PROBE = 1e-3
_LEAP = 0.5
#: What an inverted corner counts where determinants are not regularised.
INVERTED = 1e30


@compiled()
def _shape(
    ax: float,
    ay: float,
    az: float,
    bx: float,
    by: float,
    bz: float,
    hx: float,
    hy: float,
    hz: float,
    triangle: bool,
    height: float,
    delta: float,
) -> float:
    """Cubed inverse mean ratio of the frame (a, b, h) against two ideal sides and an ideal height; at least 1.

    Cubed, (size / 3)^3 / det^2 is rational, and what is worst counts most.
    """
    det = (ax * (by * hz - bz * hy) + ay * (bz * hx - bx * hz) + az * (bx * hy - by * hx)) / height
    size = (hx * hx + hy * hy + hz * hz) / (height * height)
    sides = ax * ax + ay * ay + az * az + bx * bx + by * by + bz * bz
    if triangle:
        # Sides of the equilateral triangle made orthogonal.
        size += (sides - ax * bx - ay * by - az * bz) * (4.0 / 3.0)
        det *= 1.1547005383792515
    else:
        size += sides
    if delta > 0.0:
        det = 0.5 * (det + np.sqrt(det * det + 4.0 * delta * delta))
    elif det <= 0.0:
        return INVERTED
    return size * size * size / (27.0 * det * det)


@compiled()
def _cell(
    inner: Any, outer: Any, cells: Any, c: int, vertex: int, layers: float, height: float, delta: float, steep: bool
) -> float:
    """Sum over the corners of one cell that feel a vertex, at three depths of the wall; squared where steep."""
    corners = cells.shape[1]
    triangle = corners == 3
    total = 0.0
    for i in range(corners):
        v = cells[c, i]
        n = cells[c, i + 1 if i + 1 < corners else 0]
        m = cells[c, i - 1 if i > 0 else corners - 1]
        if v != vertex and n != vertex and m != vertex:
            continue
        dx = outer[v, 0] - inner[v, 0]
        dy = outer[v, 1] - inner[v, 1]
        dz = outer[v, 2] - inner[v, 2]
        ax = inner[n, 0] - inner[v, 0]
        ay = inner[n, 1] - inner[v, 1]
        az = inner[n, 2] - inner[v, 2]
        bx = inner[m, 0] - inner[v, 0]
        by = inner[m, 1] - inner[v, 1]
        bz = inner[m, 2] - inner[v, 2]
        # How the sides change over half the wall.
        px = 0.5 * (outer[n, 0] - inner[n, 0] - dx)
        py = 0.5 * (outer[n, 1] - inner[n, 1] - dy)
        pz = 0.5 * (outer[n, 2] - inner[n, 2] - dz)
        qx = 0.5 * (outer[m, 0] - inner[m, 0] - dx)
        qy = 0.5 * (outer[m, 1] - inner[m, 1] - dy)
        qz = 0.5 * (outer[m, 2] - inner[m, 2] - dz)
        for level in range(3):
            f = _shape(
                ax + level * px,
                ay + level * py,
                az + level * pz,
                bx + level * qx,
                by + level * qy,
                bz + level * qz,
                dx / layers,
                dy / layers,
                dz / layers,
                triangle,
                height,
                delta,
            )
            total += f * f if steep else f
    return total


@compiled()
def _around(
    inner: Any,
    outer: Any,
    vertex: int,
    cells: Any,
    starts: Any,
    incident: Any,
    layers: float,
    height: float,
    delta: float,
    steep: bool,
) -> float:
    """Sum over the cells around a vertex."""
    total = 0.0
    for k in range(starts[vertex], starts[vertex + 1]):
        total += _cell(inner, outer, cells, incident[k], vertex, layers, height, delta, steep)
    return total


@compiled()
def _move(
    moving: Any,
    normals: Any,
    near: Any,
    inner: Any,
    outer: Any,
    vertex: int,
    flat: int,
    planes: Any,
    surface: Any,
    cells: Any,
    starts: Any,
    incident: Any,
    layers: float,
    height: float,
    delta: float,
    steep: bool,
    edge: float,
) -> float:
    """One damped Newton step of one vertex along its surface; returns how far it moved."""
    points, frames, coefficients, reach, ring = surface
    n = normals[vertex].copy()
    old = moving[vertex].copy()
    one = np.empty(3)
    two = np.empty(3)
    if flat > 0:
        plane = planes[flat - 1]
        one[0] = n[1] * plane[2] - n[2] * plane[1]
        one[1] = n[2] * plane[0] - n[0] * plane[2]
        one[2] = n[0] * plane[1] - n[1] * plane[0]
    else:
        axis = 0
        if abs(n[1]) < abs(n[axis]):
            axis = 1
        if abs(n[2]) < abs(n[axis]):
            axis = 2
        one[axis] = 0.0
        one[(axis + 1) % 3] = n[(axis + 2) % 3]
        one[(axis + 2) % 3] = -n[(axis + 1) % 3]
    length = np.sqrt(one[0] ** 2 + one[1] ** 2 + one[2] ** 2)
    if length < 1e-9:
        return 0.0
    for k in range(3):
        one[k] /= length
    two[0] = n[1] * one[2] - n[2] * one[1]
    two[1] = n[2] * one[0] - n[0] * one[2]
    two[2] = n[0] * one[1] - n[1] * one[0]

    e = _PROBE * edge
    now = _around(inner, outer, vertex, cells, starts, incident, layers, height, delta, steep)
    values = np.empty(5)
    for s in range(5 if flat == 0 else 2):
        p = 0.0
        q = 0.0
        if s == 0:
            p = e
        elif s == 1:
            p = -e
        elif s == 2:
            q = e
        elif s == 3:
            q = -e
        else:
            p = e
            q = e
        for k in range(3):
            moving[vertex, k] = old[k] + p * one[k] + q * two[k]
        values[s] = _around(inner, outer, vertex, cells, starts, incident, layers, height, delta, steep)
    gp = (values[0] - values[1]) / (2.0 * e)
    hpp = (values[0] - 2.0 * now + values[1]) / (e * e)
    if flat > 0:
        curve = abs(hpp) + 1e-12
        p = -gp / curve
        q = 0.0
    else:
        gq = (values[2] - values[3]) / (2.0 * e)
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
    if not far > 1e-6 * edge:
        for k in range(3):
            moving[vertex, k] = old[k]
        return 0.0
    scale = min(1.0, _LEAP * edge / far)
    place = near[vertex]
    fresh = np.empty(3)
    for _ in range(5):
        for k in range(3):
            moving[vertex, k] = old[k] + scale * (p * one[k] + q * two[k])
        place = settle(moving[vertex], fresh, near[vertex], flat, planes, points, frames, coefficients, reach, ring)
        if _around(inner, outer, vertex, cells, starts, incident, layers, height, delta, steep) < now:
            near[vertex] = place
            for k in range(3):
                normals[vertex, k] = fresh[k]
            return float(scale * far)
        scale *= 0.4
    for k in range(3):
        moving[vertex, k] = old[k]
    return 0.0


@compiled(parallel=True)
def slide(
    inner: Any,
    outer: Any,
    inner_normal: Any,
    outer_normal: Any,
    inner_near: Any,
    outer_near: Any,
    flat: Any,
    planes: Any,
    inner_surface: Any,
    outer_surface: Any,
    cells: Any,
    starts: Any,
    incident: Any,
    order: Any,
    colours: Any,
    layers: float,
    height: float,
    delta: float,
    steep: bool,
    edge: float,
    moved: Any,
) -> None:
    """One sweep over all vertices, in place, colour by colour: vertices of one colour share no cell."""
    for c in range(len(colours) - 1):
        first = colours[c]
        for k in prange(colours[c + 1] - first):
            v = order[first + k]
            one = _move(
                inner,
                inner_normal,
                inner_near,
                inner,
                outer,
                v,
                flat[v],
                planes,
                inner_surface,
                cells,
                starts,
                incident,
                layers,
                height,
                delta,
                steep,
                edge,
            )
            two = _move(
                outer,
                outer_normal,
                outer_near,
                inner,
                outer,
                v,
                flat[v],
                planes,
                outer_surface,
                cells,
                starts,
                incident,
                layers,
                height,
                delta,
                steep,
                edge,
            )
            moved[v] = max(one, two)


@compiled(parallel=True)
def judge(inner: Any, outer: Any, cells: Any, layers: float, height: float, worst: Any) -> None:
    """Greatest inverse mean ratio of each cell's corners, into ``worst``; infinite where it is folded."""
    for c in prange(len(cells)):
        corners = cells.shape[1]
        most = 0.0
        for i in range(corners):
            v = cells[c, i]
            n = cells[c, (i + 1) % corners]
            m = cells[c, (i + corners - 1) % corners]
            for level in range(3):
                t = 0.5 * level
                a = inner[n] + t * (outer[n] - inner[n]) - inner[v] - t * (outer[v] - inner[v])
                b = inner[m] + t * (outer[m] - inner[m]) - inner[v] - t * (outer[v] - inner[v])
                h = (outer[v] - inner[v]) / layers
                f = _shape(a[0], a[1], a[2], b[0], b[1], b[2], h[0], h[1], h[2], corners == 3, height, 0.0)
                most = max(most, f)
        worst[c] = np.cbrt(most) if most < INVERTED else np.inf


@compiled()
def colour(starts: IntArray, neighbours: IntArray, out: IntArray) -> int:
    """Greedy colours of vertices, in their order; returns how many."""
    most = 0
    used = np.zeros(64, dtype=np.bool_)
    for v in range(len(starts) - 1):
        used[:] = False
        for k in range(starts[v], starts[v + 1]):
            j = neighbours[k]
            if j < v:
                used[out[j]] = True
        c = 0
        while used[c]:
            c += 1
        out[v] = c
        most = max(most, c + 1)
    return most
