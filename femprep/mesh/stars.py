"""Elements in, those around each point (its star) out, and points that may move at the same time.

Points that share no element are independent of each other: they are coloured so that all of one colour may move at
once, on any number of threads and with the same result.
"""

from __future__ import annotations

import numpy as np

from femprep.mesh.compiled import compiled
from femprep.model import BoolArray, IntArray


@compiled(writes="")
def stars(cells: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Elements around each point: those of point v are ``around[start[v]:start[v + 1]]``, ascending."""
    corners = cells.shape[1]
    start = np.zeros(count + 1, dtype=np.int64)
    for i in range(len(cells)):
        for j in range(corners):
            start[cells[i, j] + 1] += 1
    for v in range(count):
        start[v + 1] += start[v]
    place = start[:-1].copy()
    around = np.empty(corners * len(cells), dtype=np.int64)
    for i in range(len(cells)):
        for j in range(corners):
            v = cells[i, j]
            around[place[v]] = i
            place[v] += 1
    return start, around


@compiled(writes="")
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
            for j in range(t.shape[1]):
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


def each_colour(colours: tuple[IntArray, IntArray]) -> list[IntArray]:
    """The points of each colour, from what :func:`coloured` returns."""
    order, first = colours
    return np.split(order, first[1:-1])


@compiled()
def mark_star(t: IntArray, start: IntArray, around: IntArray, v: int, fresh: BoolArray) -> None:
    """Note that a point moved: a search around any point of its star may now find more."""
    for k in range(start[v], start[v + 1]):
        for j in range(t.shape[1]):
            fresh[t[around[k], j]] = True
