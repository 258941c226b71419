"""A simplex in, its shape against an ideal one out, with slopes: the measure that swept elements are moved by.

The measure is the inverse mean ratio [1]_, with the determinant replaced by a positive function of it while elements
are inverted [2]_: the same sweeps untangle and smooth. Seen from one vertex, the determinant of a simplex is linear and
the sum of its squared edges is quadratic, so that gradient and curvature of the measure are known in closed form.

References
----------
.. [1] Knupp, Algebraic mesh quality metrics, SIAM J. Sci. Comput. 23(1), 2001. doi:10.1137/S1064827500371499
.. [2] Escobar et al., Simultaneous untangling and smoothing of tetrahedral meshes, Comput. Methods Appl. Mech. Eng.
   192, 2003. doi:10.1016/S0045-7825(03)00299-8
"""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.mesh.compiled import compiled

#: What an inverted simplex counts where determinants are not regularised.
INVERTED = 1e30
#: A vertex that takes a step on the measure: its longest move in one sweep and the shortest worth making, in edge
#: lengths, and by how much a step that leads up is shortened.
LEAP, LEAST, SHORTER = 0.5, 1e-6, 0.4
#: Edges of a simplex by their nodes, in the order of the weights; the upright one runs from node 0 to node 3.
_EDGES = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])
_UPRIGHT = 2


@compiled(inner=True, part=True)
def sides_and_normal(x: Any, i: int, j: int, k: int) -> Any:
    """Edges from node i to j and to k, and their cross product: twice the area, along the triangle's normal."""
    ax = x[j, 0] - x[i, 0]
    ay = x[j, 1] - x[i, 1]
    az = x[j, 2] - x[i, 2]
    bx = x[k, 0] - x[i, 0]
    by = x[k, 1] - x[i, 1]
    bz = x[k, 2] - x[i, 2]
    return (ax, ay, az), (bx, by, bz), (ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)


@compiled(part=True)
def determinant(x: Any, i: int, j: int, k: int, m: int) -> float:
    """Determinant of the edges from node i to j, k and m: six volumes."""
    _, _, (nx, ny, nz) = sides_and_normal(x, i, k, m)
    volume: float = (x[j, 0] - x[i, 0]) * nx + (x[j, 1] - x[i, 1]) * ny + (x[j, 2] - x[i, 2]) * nz
    return volume


@compiled(part=True)
def shape(x: Any, row: Any, weights: Any, scale: float, upright: float, delta: float) -> float:
    """Cubed inverse mean ratio of a simplex, at least 1: rational, and what is worst counts most."""
    size = 0.0
    for e in range(6):
        w = weights[e] * upright if e == _UPRIGHT else weights[e]
        if w == 0.0:
            continue
        p = row[_EDGES[e, 0]]
        q = row[_EDGES[e, 1]]
        dx = x[p, 0] - x[q, 0]
        dy = x[p, 1] - x[q, 1]
        dz = x[p, 2] - x[q, 2]
        size += w * (dx * dx + dy * dy + dz * dz)
    det = scale * np.sqrt(upright) * determinant(x, row[0], row[1], row[2], row[3])
    if delta > 0.0:
        det = 0.5 * (det + np.sqrt(det * det + 4.0 * delta * delta))
    elif det <= 0.0:
        return INVERTED
    return float(size * size * size / (27.0 * det * det))


@compiled(part=True)
def add_slopes(
    x: Any,
    row: Any,
    m: Any,
    weights: Any,
    scale: float,
    upright: float,
    delta: float,
    steep: bool,
    work: Any,
    gradient: Any,
    hessian: Any,
) -> float:
    """The same measure, squared where steep; its slopes are added to a gradient and to the upper half of a Hessian.

    ``m`` holds by how much each node follows the vertex that moves; ``work`` is three vectors.
    """
    gs = work[0]
    gd = work[1]
    gl = work[2]
    power = 2.0 if steep else 1.0
    size = 0.0
    bend = 0.0
    gs[:] = 0.0
    for e in range(6):
        w = weights[e] * upright if e == _UPRIGHT else weights[e]
        if w == 0.0:
            continue
        a = _EDGES[e, 0]
        b = _EDGES[e, 1]
        gap = m[a] - m[b]
        bend += 2.0 * w * gap * gap
        for k in range(3):
            d = x[row[a], k] - x[row[b], k]
            size += w * d * d
            gs[k] += 2.0 * w * gap * d
    factor = scale * np.sqrt(upright)
    # Normals of the faces opposite to the nodes 1, 2, 3; that of node 0 is minus their sum.
    for k in range(3):
        p = (k + 1) % 3
        q = (k + 2) % 3
        a1 = x[row[1], p] - x[row[0], p]
        a2 = x[row[1], q] - x[row[0], q]
        b1 = x[row[2], p] - x[row[0], p]
        b2 = x[row[2], q] - x[row[0], q]
        c1 = x[row[3], p] - x[row[0], p]
        c2 = x[row[3], q] - x[row[0], q]
        gd[k] = factor * (
            (m[1] - m[0]) * (b1 * c2 - b2 * c1)
            + (m[2] - m[0]) * (c1 * a2 - c2 * a1)
            + (m[3] - m[0]) * (a1 * b2 - a2 * b1)
        )
    det = factor * determinant(x, row[0], row[1], row[2], row[3])
    if delta > 0.0:
        root = np.sqrt(det * det + 4.0 * delta * delta)
        fixed = 0.5 * (det + root)
    elif det <= 0.0:
        return INVERTED
    else:
        root = det
        fixed = det
    f = size * size * size / (27.0 * fixed * fixed)
    if steep:
        f *= f
    for k in range(3):
        gl[k] = 3.0 * gs[k] / size - 2.0 * gd[k] / root
        gradient[k] += power * f * gl[k]
    bow = 2.0 * det / (root * root * root)
    for k in range(3):
        for j in range(k, 3):
            hessian[k, j] += (
                power * f * (power * gl[k] * gl[j] - 3.0 * gs[k] * gs[j] / (size * size) + bow * gd[k] * gd[j])
            )
        hessian[k, k] += power * f * 3.0 * bend / size
    return float(f)
