"""Points moved for the sake of the worst element around them: to a given place, or to the best one in reach."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.mesh.stars import each_colour, mark_star
from femprep.model import BoolArray, FloatArray, IntArray
from femprep.volume.optimise.quality import worst_around
from femprep.volume.optimise.relax import FIRST_STEP, SURFACE_STEP

#: How often a search halves its step.
_HALVINGS: Final = 5
#: Points one thread takes at a time, at least.
_GRAIN: Final = 32


def try_places(mesh: Any, colours: Any, places: FloatArray, sound: float, fresh: BoolArray) -> None:
    """Put coloured points at their rows of ``places`` where the worst element around stays sound or gets no worse."""
    for nodes in each_colour(colours):
        _try_places(len(nodes), mesh, nodes, places, sound, fresh)


@compiled(grain=_GRAIN)
def _try_places(
    first: int, last: int, mesh: Any, nodes: IntArray, places: FloatArray, sound: float, fresh: BoolArray
) -> None:
    p, t, start, around = mesh
    for n in range(first, last):
        v = nodes[n]
        x, y, z = p[v, 0], p[v, 1], p[v, 2]
        p[v, 0], p[v, 1], p[v, 2] = places[v, 0], places[v, 1], places[v, 2]
        after = worst_around(mesh, v, -np.inf)
        if after < sound:
            p[v, 0], p[v, 1], p[v, 2] = x, y, z
            if worst_around(mesh, v, -np.inf) <= after:
                p[v, 0], p[v, 1], p[v, 2] = places[v, 0], places[v, 1], places[v, 2]
        if p[v, 0] != x or p[v, 1] != y or p[v, 2] != z:
            mark_star(t, start, around, v, fresh)


@compiled(inner=True)
def _climb(mesh: Any, v: int, freedom: int, basis: FloatArray) -> bool:
    """Move one point to where the worst element around it is best: compass search along its free directions."""
    p, t, start, around = mesh
    best = worst_around(mesh, v, -np.inf)
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
    size = (FIRST_STEP if freedom == 3 else SURFACE_STEP) * length / count
    moved = False
    if freedom == 3:  # first the middle of the neighbours
        x, y, z = p[v, 0], p[v, 1], p[v, 2]
        p[v, 0], p[v, 1], p[v, 2] = x + mx / count, y + my / count, z + mz / count
        value = worst_around(mesh, v, best)
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
                    value = worst_around(mesh, v, best)
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


def search(mesh: Any, colours: Any, freedom: IntArray, basis: FloatArray, fresh: BoolArray) -> None:
    """Move each point that is fresh to where the worst element around it is best, colour by colour.

    A point is fresh while something in its star has moved since it was searched last: else it would find nothing.
    """
    for nodes in each_colour(colours):
        _search(len(nodes), mesh, nodes, freedom, basis, fresh)


@compiled(grain=_GRAIN)
def _search(
    first: int, last: int, mesh: Any, nodes: IntArray, freedom: IntArray, basis: FloatArray, fresh: BoolArray
) -> None:
    _, t, start, around = mesh
    for n in range(first, last):
        v = nodes[n]
        if freedom[v] > 0 and fresh[v]:
            fresh[v] = False
            if _climb(mesh, v, freedom[v], basis[v]):
                mark_star(t, start, around, v, fresh)
