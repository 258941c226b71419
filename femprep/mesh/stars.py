"""Elements in, those around each point (its star) out, and points that may move at the same time.

Points that share no element are independent of each other: they are coloured so that all of one colour may move at
once, on any number of threads and with the same result.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from femprep.mesh.compiled import compiled
from femprep.model import BoolArray, IntArray


def stars(cells: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Elements around each point: those of point v are ``around[start[v]:start[v + 1]]``, ascending."""
    ends = np.arange(0, cells.size + 1, cells.shape[1])
    table = sp.csr_array((np.ones(cells.size, dtype=np.bool_), cells.ravel(), ends), shape=(len(cells), count)).tocsc()
    return table.indptr.astype(np.int64), table.indices.astype(np.int64)


def coloured(t: IntArray, start: IntArray, around: IntArray, nodes: IntArray) -> tuple[IntArray, IntArray]:
    """Points in the order of their colours, and where each colour begins.

    Greedy, in the order given: each point takes the first colour that no point of its star has.
    """
    colour = np.full(len(start) - 1, -1, dtype=np.int64)
    taken = np.full(t.shape[1] * int(np.diff(start).max(initial=0)) + 1, -1, dtype=np.int64)
    _colour(t, start, around, nodes, colour, taken)
    own = colour[nodes]
    # In 16 bits: these are sorted in linear time.
    return nodes[np.argsort(own.astype(np.uint16), kind="stable")], np.append(0, np.cumsum(np.bincount(own)))


@compiled(writes="colour taken")
def _colour(t: IntArray, start: IntArray, around: IntArray, nodes: IntArray, colour: IntArray, taken: IntArray) -> None:
    """Colour points; ``taken`` has room for as many colours as a star has corners."""
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
        colour[v] = c


def each_colour(colours: tuple[IntArray, IntArray]) -> list[IntArray]:
    """The points of each colour, from what :func:`coloured` returns."""
    order, first = colours
    return np.split(order, first[1:-1])


@compiled(inner=True)
def mark_star(t: IntArray, start: IntArray, around: IntArray, v: int, fresh: BoolArray) -> None:
    """Note that a point moved: a search around any point of its star may now find more."""
    for k in range(start[v], start[v + 1]):
        for j in range(t.shape[1]):
            fresh[t[around[k], j]] = True
