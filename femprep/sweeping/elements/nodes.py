"""Nodes of a layered mesh in, moved for well-shaped elements out: inside the wall freely, on surfaces along them.

One node after the other takes a damped Newton step on the measure of :mod:`femprep.mesh.energies.simplex` summed over
the simplices around it, squared once none is inverted, so that the worst counts most. Nodes are few and in a fixed
order: the result does not depend on threads.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.mesh.energies.pull import add_pulls, pulled
from femprep.mesh.energies.simplex import LEAP, LEAST, SHORTER, add_slopes, determinant, shape
from femprep.mesh.patches import settle
from femprep.mesh.tangents import free_directions

#: Shortenings of a step that leads up.
_TRIES = 6
#: Where a Hessian is not positive, this share of its trace is added to its diagonal, then four times that, and so on.
_SHIFT = 0.02


@compiled()
def least_determinant(points: Any, simplices: Any) -> float:
    """Least determinant of simplices ``(s, 4)``."""
    least = np.inf
    for s in range(len(simplices)):
        row = simplices[s]
        least = min(least, determinant(points, row[0], row[1], row[2], row[3]))
    return least


@compiled(part=True)
def _newton(gradient: Any, hessian: Any, basis: Any, free: int, step: Any) -> float:
    """Newton's step in the free directions, the Hessian shifted until it is positive; returns its length."""
    g = np.zeros(3)
    h = np.zeros((3, 3))
    trace = 0.0
    for a in range(free):
        for k in range(3):
            g[a] += basis[a, k] * gradient[k]
            for j in range(3):
                for b in range(free):
                    h[a, b] += basis[a, k] * hessian[k, j] * basis[b, j]
        trace += abs(h[a, a])
    lower = np.zeros((3, 3))
    shift = 0.0
    for _ in range(20):
        sound = True
        for a in range(free):
            for b in range(a + 1):
                value = h[a, b] + (shift if a == b else 0.0)
                for c in range(b):
                    value -= lower[a, c] * lower[b, c]
                if a > b:
                    lower[a, b] = value / lower[b, b]
                elif value > 1e-9 * trace:
                    lower[a, a] = np.sqrt(value)
                else:
                    sound = False
                    lower[a, a] = 1.0
        if sound:
            break
        shift = max(4.0 * shift, _SHIFT * trace + 1e-300)
    y = np.zeros(3)
    for a in range(free):
        value = -g[a]
        for c in range(a):
            value -= lower[a, c] * y[c]
        y[a] = value / lower[a, a]
    for back in range(free):
        a = free - 1 - back
        value = y[a]
        for c in range(a + 1, free):
            value -= lower[c, a] * y[c]
        y[a] = value / lower[a, a]
    for k in range(3):
        step[k] = 0.0
        for a in range(free):
            step[k] += y[a] * basis[a, k]
    return float(np.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2))


@compiled(writes="points normals near")
def move_nodes(
    points: Any,
    moving: Any,
    star: Any,
    simplices: Any,
    measure: Any,
    side: Any,
    flat: Any,
    normals: Any,
    near: Any,
    planes: Any,
    surfaces: Any,
    pulls: Any,
    delta: float,
    edge: float,
) -> float:
    """One sweep over the nodes ``moving``, in place; returns the longest move, mm.

    ``star`` is the simplices around each node as row starts and columns, ``measure`` their weights, scale and
    uprightness; ``side`` tells whether a node lies on the inner (1) or outer (2) surface or between (0), ``flat`` its
    plane, counted from 1; ``normals`` and ``near`` are those of the surface there; ``pulls`` is what a surface's
    triangles must not pass by.
    """
    starts, around = star
    weights, scale, upright = measure
    inner, outer = surfaces
    basis = np.empty((3, 3))
    work = np.empty((3, 3))
    hessian = np.empty((3, 3))
    gradient = np.empty(3)
    step = np.empty(3)
    old = np.empty(3)
    fresh = np.empty(3)
    share = np.empty(4)
    # While elements are inverted, those that are must not outweigh all others, or these are tangled in turn.
    steep = delta == 0.0
    longest = 0.0
    for i in range(len(moving)):
        v = moving[i]
        plane = planes[max(flat[i] - 1, 0)]
        free = free_directions(normals[i], side[i] > 0, plane, flat[i] > 0, basis)
        if free == 0:
            continue
        gradient[:] = 0.0
        hessian[:] = 0.0
        now = 0.0
        for s in range(starts[v], starts[v + 1]):
            row = simplices[around[s]]
            for a in range(4):
                share[a] = 1.0 if row[a] == v else 0.0
            now += add_slopes(
                points, row, share, weights, scale, upright[around[s]], delta, steep, work, gradient, hessian
            )
        for k in range(3):
            for j in range(k):
                hessian[k, j] = hessian[j, k]
        now += add_pulls(points, v, pulls, gradient, hessian)
        far = _newton(gradient, hessian, basis, free, step)
        if not far > LEAST * edge:
            continue
        factor = min(1.0, LEAP * edge / far)
        for k in range(3):
            old[k] = points[v, k]
        better = False
        for _ in range(_TRIES):
            for k in range(3):
                points[v, k] = old[k] + factor * step[k]
            place = near[i]
            if side[i] == 1:
                place = settle(points[v], fresh, place, flat[i], planes, *inner)
            elif side[i] == 2:
                place = settle(points[v], fresh, place, flat[i], planes, *outer)
            value = pulled(points, v, pulls)
            for s in range(starts[v], starts[v + 1]):
                f = shape(points, simplices[around[s]], weights, scale, upright[around[s]], delta)
                value += f * f if steep else f
            if value < now:
                better = True
                if side[i] > 0:
                    near[i] = place
                    for k in range(3):
                        normals[i, k] = fresh[k]
                longest = max(longest, factor * far)
                break
            factor *= SHORTER
        if not better:
            for k in range(3):
                points[v, k] = old[k]
    return longest
