"""Tetrahedra, facets and values at nodes in; the same with faces along the surface where the values are zero, out.

Nodes near the surface are moved onto it along one of their edges, which spares the elements there being cut into poor
ones (isosurface stuffing: Labelle and Shewchuk 2007, doi 10.1145/1275808.1276448). Edges that still cross it are cut
in two there, the longest first, and with each edge all elements and facets around it; as every element takes its edges
in the same order, neighbours fit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.sparse import csr_array, vstack

from femprep.mesh.elements import ELEMENTS
from femprep.mesh.measures.tetrahedra import tetra_measures
from femprep.mesh.quadratic import edges_of
from femprep.model import BoolArray, FloatArray, IntArray

#: A node is moved onto the surface along an edge that crosses it within this share of its length.
_NEAR: Final = 0.3
#: A move that leaves an element around with a smaller mean ratio than this, and a smaller one than before, is not made.
_SOUND: Final = 0.2
_EDGES: Final = np.array(ELEMENTS["tetra"].edges)


@dataclass(frozen=True)
class LevelCut:
    """A mesh cut along a surface.

    Attributes
    ----------
    matrix : (k, n) sparse array
        Weights of the old nodes at each new one, of two or, where their edge's ends were moved, four; old ones first.
    value : (k,) array
        Values at the nodes, 0 on the surface.
    cells, facets : (m, 4), (f, 3) arrays
    cell, facet : (m,), (f,) arrays
        The old ones they are parts of.
    """

    matrix: csr_array
    value: FloatArray
    cells: IntArray
    cell: IntArray
    facets: IntArray
    facet: IntArray


def cut_along_level(
    points: FloatArray,
    cells: IntArray,
    facets: IntArray,
    value: FloatArray,
    cut: BoolArray,
    surfaces: BoolArray,
    still: BoolArray,
    crossing: Callable[[IntArray], FloatArray] | None = None,
) -> LevelCut:
    """Cut tetrahedra along the surface where values at their nodes are zero.

    Parameters
    ----------
    points : (n, 3) array
    cells, facets : (m, 4), (f, 3) arrays
        Tetrahedra, and boundary triangles that stay faces of them.
    value : (n,) array
        Positive on one side.
    cut : (m,) array
        Which elements the surface crosses; others are cut with their neighbours alone.
    surfaces : (n, s) array
        Which surfaces each node lies on; a node moves along edges of facets that lie on all of its own.
    still : (n,) array
        Nodes that may not move; the surface runs through those it would have come near.
    crossing : callable, optional
        How far from the first to the second of pairs of nodes ``(e, 2)`` the surface lies, ``(e,)``; where values are
        linear in between where not given.
    """
    count = len(points)
    table = edges_of({"tetra": cells}, count)
    edges = table.ends
    crossed, on_facet = (np.zeros(len(edges), dtype=np.bool_) for _ in range(2))
    crossed[table.of_cells["tetra"][cut].ravel()] = True
    on_facet[table.find(facets, np.roll(facets, -1, axis=1)).ravel()] = True
    crossed &= value[edges].prod(axis=1) < 0.0
    at = np.zeros(len(edges))
    if crossing is not None:
        at[crossed] = crossing(edges[crossed])
    else:
        first, second = value[edges[crossed]].T
        at[crossed] = first / (first - second)
    ends, share, value = _snapped(points, cells, edges[crossed], at[crossed], on_facet[crossed], value, surfaces, still)
    moves = _weights(ends, share, count)
    moved = moves @ points
    rows = np.flatnonzero(crossed & (value[edges].prod(axis=1) < 0.0))  # their ends did not move
    first, second = edges[rows].T
    length = np.linalg.norm(moved[second] - moved[first], axis=1)
    rank = np.empty(len(rows), dtype=np.int64)
    rank[np.lexsort((rows, -length))] = np.arange(len(rows))
    key = first * count + second  # ascending, as the edges are
    number = count + np.arange(len(rows))
    new_cells, cell = _split(cells, _EDGES, key, rank, number, count)
    new_facets, facet = _split(facets, np.array([(0, 1), (0, 2), (1, 2)]), key, rank, number, count)
    return LevelCut(
        csr_array(vstack([moves, _weights(edges[rows], at[rows], count) @ moves])),
        np.concatenate([value, np.zeros(len(rows))]),
        new_cells,
        cell,
        new_facets,
        facet,
    )


def _weights(ends: IntArray, share: FloatArray, count: int) -> csr_array:
    """Rows that tell points between two others."""
    row = np.arange(len(ends))
    data = np.concatenate([1.0 - share, share])
    return csr_array((data, (np.tile(row, 2), ends.T.ravel())), shape=(len(ends), count))


def _snapped(
    points: FloatArray,
    cells: IntArray,
    edges: IntArray,
    at: FloatArray,
    on_facet: BoolArray,
    value: FloatArray,
    surfaces: BoolArray,
    still: BoolArray,
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Ends and share of each node after the nodes near the surface were moved onto it, and the values there."""
    count = len(points)
    node, other = np.concatenate([edges, edges[:, ::-1]]).T
    share, facet = np.concatenate([at, 1.0 - at]), np.tile(on_facet, 2)
    near = share < _NEAR
    node, other, share, facet = node[near], other[near], share[near], facet[near]
    bound = surfaces[node].any(axis=1)
    along = ~bound | (facet & ~(surfaces[node] & ~surfaces[other]).any(axis=1))
    free = along & ~still[node]
    far = share * np.linalg.norm(points[other] - points[node], axis=1)
    # One way for each node: a move where there is one, and the shortest.
    order = np.lexsort((other, far, ~free, node))
    one = order[np.unique(node[order], return_index=True)[1]]
    ends = np.repeat(np.arange(count)[:, None], 2, axis=1)
    part, found = np.zeros(count), value.copy()
    found[node[one]] = 0.0
    moves = one[free[one]]
    ends[node[moves], 1] = other[moves]
    part[node[moves]] = share[moves]
    before = tetra_measures(points, cells)["mean_ratio"]
    while True:
        places = (1.0 - part)[:, None] * points[ends[:, 0]] + part[:, None] * points[ends[:, 1]]
        now = tetra_measures(places, cells)["mean_ratio"]
        bad = np.zeros(count, dtype=np.bool_)
        bad[cells[now < np.minimum(before, _SOUND)]] = True
        bad &= part > 0.0
        if not bad.any():
            return ends, part, found
        ends[bad, 1], part[bad], found[bad] = np.flatnonzero(bad), 0.0, value[bad]


def _split(
    simplices: IntArray, sides: IntArray, key: IntArray, rank: IntArray, number: IntArray, count: int
) -> tuple[IntArray, IntArray]:
    """Simplices bisected at all their edges that are cut, in the order of their ranks, and what they are parts of."""
    owner = np.arange(len(simplices))
    done, done_owner = [], []
    last = len(key)
    while len(simplices):
        pairs = np.sort(simplices[:, sides], axis=2)
        own = pairs[..., 0] * count + pairs[..., 1]
        own[pairs[..., 1] >= count] = -1  # edges to new nodes cross nothing
        at = np.minimum(np.searchsorted(key, own), max(last - 1, 0))
        ranks = np.where(key[at] == own, rank[at], last) if last else np.full(own.shape, last)
        best = ranks.argmin(axis=1)
        row = np.arange(len(simplices))
        whole = ranks[row, best] == last
        done.append(simplices[whole])
        done_owner.append(owner[whole])
        simplices, owner, best, at = simplices[~whole], owner[~whole], best[~whole], at[~whole]
        row = np.arange(len(simplices))
        new = number[at[row, best]] if len(row) else row
        halves = []
        for side in (0, 1):
            half = simplices.copy()
            half[row, sides[best, side]] = new
            halves.append(half)
        simplices, owner = np.concatenate(halves), np.tile(owner, 2)
    order = np.argsort(np.concatenate(done_owner), kind="stable")
    return np.concatenate(done)[order], np.concatenate(done_owner)[order]
