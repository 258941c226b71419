"""Vertices of two matched surfaces in, moved along the surfaces for well-shaped elements between them: compiled loops.

Inner and outer vertex of the same number are joined by a straight line; elements lie between cells and layers. Every
vertex moves along its own surface, rim vertices along the curve in which it meets their plane, so that surfaces,
planes and connectivity stay as they are.

The measure is that of :mod:`femprep.mesh.energies.simplex`, summed over the elements' simplices.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.mesh.energies.pull import add_pulls, pulled
from femprep.mesh.energies.simplex import LEAP, LEAST, SHORTER, add_slopes, shape
from femprep.mesh.patches import settle
from femprep.mesh.tangents import free_directions


@compiled(part=True)
def _prism(lines: Any, cells: Any, c: int, layer: int, out: Any) -> None:
    """Corners of the element over a cell in a layer."""
    inner, outer, depth = lines
    n = cells.shape[1]
    for i in range(n):
        v = cells[c, i]
        low = depth[layer, v]
        high = depth[layer + 1, v]
        for k in range(3):
            across = outer[v, k] - inner[v, k]
            out[i, k] = inner[v, k] + low * across
            out[i + n, k] = inner[v, k] + high * across


@compiled(part=True)
def _around(lines: Any, vertex: int, measure: Any) -> float:
    """Sum over the simplices around a vertex that feel it; squared where steep."""
    mesh, judged, layers, delta, steep = measure
    cells, starts, incident = mesh
    nodes, kinds, weights, scale, upright = judged
    n = cells.shape[1]
    x = np.empty((8, 3))
    total = 0.0
    for s in range(starts[vertex], starts[vertex + 1]):
        c = incident[s]
        for layer in layers:
            _prism(lines, cells, c, layer, x)
            table = nodes[kinds[c, layer % 2]]
            for r in range(len(table)):
                row = table[r]
                if (
                    cells[c, row[0] % n] == vertex
                    or cells[c, row[1] % n] == vertex
                    or cells[c, row[2] % n] == vertex
                    or cells[c, row[3] % n] == vertex
                ):
                    f = shape(x, row, weights, scale, upright[c], delta)
                    total += f * f if steep else f
    return total


@compiled(part=True)
def _slopes(lines: Any, vertex: int, inside: bool, measure: Any, gradient: Any, hessian: Any) -> float:
    """The same sum, its gradient and its second derivatives where the inner or the outer vertex moves."""
    depth = lines[2]
    mesh, judged, layers, delta, steep = measure
    cells, starts, incident = mesh
    nodes, kinds, weights, scale, upright = judged
    n = cells.shape[1]
    x = np.empty((8, 3))
    share = np.empty(8)
    m = np.empty(4)
    work = np.empty((3, 3))
    total = 0.0
    gradient[:] = 0.0
    hessian[:] = 0.0
    for s in range(starts[vertex], starts[vertex + 1]):
        c = incident[s]
        for layer in layers:
            _prism(lines, cells, c, layer, x)
            for i in range(n):
                mine = 1.0 if cells[c, i] == vertex else 0.0
                low = depth[layer, vertex]
                high = depth[layer + 1, vertex]
                share[i] = mine * (1.0 - low if inside else low)
                share[i + n] = mine * (1.0 - high if inside else high)
            table = nodes[kinds[c, layer % 2]]
            for r in range(len(table)):
                row = table[r]
                felt = False
                for a in range(4):
                    m[a] = share[row[a]]
                    if cells[c, row[a] % n] == vertex:
                        felt = True
                if not felt:
                    continue
                total += add_slopes(x, row, m, weights, scale, upright[c], delta, steep, work, gradient, hessian)
    for k in range(3):
        for j in range(k):
            hessian[k, j] = hessian[j, k]
    return total


@compiled(part=True)
def _move(
    lines: Any, feet: Any, vertex: int, inside: bool, held: Any, surface: Any, pulls: Any, measure: Any, edge: float
) -> float:
    """One damped Newton step of one vertex along its surface; returns how far it moved."""
    normals, near = feet
    flat, planes = held
    moving = lines[0] if inside else lines[1]
    old = moving[vertex].copy()
    basis = np.zeros((3, 3))
    if free_directions(normals[vertex], True, planes[max(flat - 1, 0)], flat > 0, basis) == 0:
        return 0.0
    one = basis[0]
    two = basis[1]
    gradient = np.empty(3)
    hessian = np.empty((3, 3))
    now = _slopes(lines, vertex, inside, measure, gradient, hessian)
    now += add_pulls(moving, vertex, pulls, gradient, hessian)
    gp = 0.0
    gq = 0.0
    hpp = 0.0
    hpq = 0.0
    hqq = 0.0
    for k in range(3):
        gp += gradient[k] * one[k]
        gq += gradient[k] * two[k]
        for j in range(3):
            hpp += one[k] * hessian[k, j] * one[j]
            hpq += one[k] * hessian[k, j] * two[j]
            hqq += two[k] * hessian[k, j] * two[j]
    if flat > 0:
        p = -gp / (abs(hpp) + 1e-12)
        q = 0.0
    else:
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
    if not far > LEAST * edge:
        return 0.0
    scale = min(1.0, LEAP * edge / far)
    fresh = np.empty(3)
    for _ in range(5):
        for k in range(3):
            moving[vertex, k] = old[k] + scale * (p * one[k] + q * two[k])
        place = settle(moving[vertex], fresh, near[vertex], flat, planes, *surface)
        value = _around(lines, vertex, measure)
        if value + pulled(moving, vertex, pulls) < now:
            near[vertex] = place
            for k in range(3):
                normals[vertex, k] = fresh[k]
            return float(scale * far)
        scale *= SHORTER
    for k in range(3):
        moving[vertex, k] = old[k]
    return 0.0


@compiled(grain=16, writes="lines normals near moved")
def slide(
    first: int,
    last: int,
    lines: Any,
    normals: Any,
    near: Any,
    flat: Any,
    planes: Any,
    inner_surface: Any,
    outer_surface: Any,
    mesh: Any,
    judged: Any,
    inner_pulls: Any,
    outer_pulls: Any,
    layers: Any,
    order: Any,
    delta: float,
    steep: bool,
    edge: float,
    moved: Any,
) -> None:
    """Move the vertices in ``order``, in place; they share no cell.

    ``lines`` are the inner and the outer points and the depths of the layers; ``normals`` and ``near`` are pairs, of
    the inner and of the outer surface; ``mesh`` is the cells, and those around each vertex as row starts and columns;
    ``judged`` is what Simplices holds, ``layers`` which of them are looked at. Moves are written to ``moved``.
    """
    for k in range(first, last):
        v = order[k]
        measure = (mesh, judged, layers, delta, steep)
        held = (flat[v], planes)
        surfaces = (inner_surface, outer_surface)
        pulls = (inner_pulls, outer_pulls)
        far = 0.0
        # One call for both sides: all that it calls becomes a part of this kernel, once for each call.
        for side in range(2):
            feet = (normals[side], near[side])
            inside = side == 0
            far = max(far, _move(lines, feet, v, inside, held, surfaces[side], pulls[side], measure, edge))
        moved[v] = far
