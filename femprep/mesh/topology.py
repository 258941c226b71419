"""Cells of a surface to its topology: edges, closed or not, winding, pieces, Euler characteristic, fold angles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from femprep.errors import InputError
from femprep.mesh.measures.triangles import area_vectors
from femprep.model import FloatArray, IntArray


@dataclass(frozen=True)
class EdgeTable:
    """The edges of a surface of triangles or quadrilaterals.

    Attributes
    ----------
    nodes : (e, 2) array
        The two vertices of each edge, the smaller number first; rows are sorted.
    count : (e,) array
        Number of cells at the edge: 2 inside a surface, 1 on its border, more where sheets meet.
    forward : (e,) array
        Number of those cells that run along it from the smaller to the larger number: ``count / 2`` where the
        winding agrees.
    cells : (e, 2) array
        The first two cells at the edge, -1 where there is no second.
    of_cell : (m, p) array
        Number of the edge from corner i to corner i + 1 of each cell.
    """

    nodes: IntArray
    count: IntArray
    forward: IntArray
    cells: IntArray
    of_cell: IntArray


def edge_table(cells: npt.ArrayLike) -> EdgeTable:
    """List the edges of cells ``(m, p)``, with the cells at each."""
    cells = np.asarray(cells, dtype=np.int64)
    m, p = cells.shape
    start, stop = cells.ravel(), np.roll(cells, -1, axis=1).ravel()
    low, high = np.minimum(start, stop), np.maximum(start, stop)
    size = int(high.max()) + 1 if m else 1
    keys = low * size + high
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    begins = np.ones(len(keys), dtype=bool)
    begins[1:] = keys[1:] != keys[:-1]
    first = np.flatnonzero(begins)
    count = np.diff(first, append=len(keys))
    number = np.empty(len(keys), dtype=np.int64)
    number[order] = np.cumsum(begins) - 1
    key, owner = keys[first], order // p
    second = np.where(count > 1, owner[np.minimum(first + 1, max(m * p - 1, 0))], -1)
    return EdgeTable(
        nodes=np.stack([key // size, key % size], axis=1),
        count=count,
        forward=np.bincount(number, weights=start < stop, minlength=len(key)).astype(np.int64),
        cells=np.stack([owner[first], second], axis=1),
        of_cell=number.reshape(m, p),
    )


def quarters(table: EdgeTable, triangles: IntArray, first: int) -> IntArray:
    """Triangles ``(m, 3)`` cut in four at the middles of their sides, numbered from ``first``, ``(4 m, 3)``."""
    a, b, c = triangles.T
    p, q, r = first + table.of_cell.T
    return np.concatenate([np.stack(part, axis=1) for part in ((a, p, r), (p, b, q), (r, q, c), (p, q, r))])


def is_closed(cells: npt.ArrayLike) -> bool:
    """Whether exactly two cells meet at every edge: no border and no branching."""
    table = edge_table(cells)
    return len(table.count) > 0 and bool(np.all(table.count == 2))


def is_consistently_wound(cells: npt.ArrayLike) -> bool:
    """Whether the cells at every edge run along it in opposite senses (border edges count as consistent)."""
    table = edge_table(cells)
    return bool(np.all((table.count == 1) | ((table.count == 2) & (table.forward == 1))))


def border_edges(cells: npt.ArrayLike) -> IntArray:
    """Edges with one cell only, ``(e, 2)``, directed as in that cell."""
    cells = np.asarray(cells, dtype=np.int64)
    table = edge_table(cells)
    directed = np.stack([cells, np.roll(cells, -1, axis=1)], axis=2)
    return np.asarray(directed[table.count[table.of_cell] == 1])


def border_loops(cells: npt.ArrayLike) -> list[IntArray]:
    """Rims of a surface that touches itself in no vertex: the nodes of each in the order its cells run along it."""
    return loops_of(border_edges(cells))


def loops_of(edges: IntArray) -> list[IntArray]:
    """Directed edges ``(e, 2)``, at most one from each node, as closed loops of nodes in their order.

    Raises
    ------
    InputError
        More than one leaves a node, or they do not close: cells that are not wound alike have such rims.
    """
    following = {int(a): int(b) for a, b in edges}
    if set(following) != set(following.values()) or len(following) < len(edges):
        raise InputError("a rim touches itself at a node, or the cells along it are not wound alike")
    loops = []
    while following:
        start, vertex = next(iter(following.items()))
        del following[start]
        loop = [start]
        while vertex != start:
            loop.append(vertex)
            vertex = following.pop(vertex)
        loops.append(np.array(loop))
    return loops


def adjacency(cells: IntArray, count: int) -> Any:
    """Sparse matrix ``(count, count)`` of ones between the two ends of each side of cells ``(m, p)``."""
    one, two = cells.ravel(), np.roll(cells, -1, axis=1).ravel()
    ends = np.concatenate([one, two]), np.concatenate([two, one])
    matrix = coo_array((np.ones(2 * len(one)), ends), shape=(count, count)).tocsr()
    matrix.data[:] = 1.0
    return matrix


def components(one: IntArray, other: IntArray, size: int) -> IntArray:
    """Number from 0 of the piece each node of a graph belongs to, ``(size,)``; its links have two ends each."""
    graph = coo_array((np.ones(len(one), dtype=np.int8), (one, other)), shape=(size, size))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def pieces(cells: npt.ArrayLike, table: EdgeTable | None = None) -> IntArray:
    """Number from 0 of the connected piece each cell belongs to; cells that share an edge belong together, ``(m,)``.

    This and what follows takes the table of the cells' edges too, where it is known.
    """
    cells = np.asarray(cells, dtype=np.int64)
    table = edge_table(cells) if table is None else table
    m, p = cells.shape
    label = components(np.repeat(np.arange(m), p), m + table.of_cell.ravel(), m + len(table.count))
    _, number = np.unique(label[:m], return_inverse=True)
    return np.asarray(number.ravel(), dtype=np.int64)


def pinched_vertices(cells: npt.ArrayLike, table: EdgeTable | None = None) -> IntArray:
    """Vertices at which several fans of cells meet in that point alone: closed at its edges, yet not a 2-manifold."""
    cells = np.asarray(cells, dtype=np.int64)
    table = edge_table(cells) if table is None else table
    m, p = cells.shape
    if m == 0:
        return np.empty(0, dtype=np.int64)
    # A node per corner; corners at the same vertex of cells that share an edge there are one fan.
    corner = np.arange(m * p).reshape(m, p)
    sides = np.stack([corner, np.roll(corner, -1, axis=1)], axis=2).reshape(-1, 2)
    vertex = cells.ravel()[sides]
    edge = np.repeat(table.of_cell.ravel(), 2)
    hub = m * p + 2 * edge + (vertex == table.nodes[np.repeat(table.of_cell.ravel(), 2).reshape(-1, 2), 1]).ravel()
    size = m * p + 2 * len(table.count)
    label = components(sides.ravel(), hub, size)
    fans = np.unique(cells.ravel() * size + label[: m * p])
    number, count = np.unique(fans // size, return_counts=True)
    return np.asarray(number[count > 1], dtype=np.int64)


def is_manifold(cells: npt.ArrayLike) -> bool:
    """Whether the surface is a closed 2-manifold: two cells at every edge, one fan of cells at every vertex."""
    return is_closed(cells) and len(pinched_vertices(cells)) == 0


def euler_characteristic(cells: npt.ArrayLike, table: EdgeTable | None = None) -> int:
    """Vertices - edges + cells, of the vertices in use; 2 for a sphere, 0 for a torus, sums over pieces."""
    cells = np.asarray(cells, dtype=np.int64)
    table = edge_table(cells) if table is None else table
    return len(np.unique(cells)) - len(table.count) + len(cells)


def volume(points: npt.ArrayLike, triangles: npt.ArrayLike) -> float:
    """Enclosed volume of a closed surface, mm3 (divergence theorem); negative where it is wound inward."""
    points = np.asarray(points, dtype=np.float64)
    cells = np.asarray(triangles, dtype=np.int64)
    if len(cells) == 0:
        return 0.0
    middle = points[cells].mean(axis=(0, 1))
    a, b, c = (points[cells[:, i]] - middle for i in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)


def neighbour_mean(values: FloatArray, edges: IntArray) -> FloatArray:
    """Mean over the neighbours of each vertex of values ``(n, k)``, 0 where there are none; each edge once."""
    total: FloatArray = np.zeros_like(values)
    np.add.at(total, edges[:, 0], values[edges[:, 1]])
    np.add.at(total, edges[:, 1], values[edges[:, 0]])
    return total / np.maximum(np.bincount(edges.ravel(), minlength=len(values)), 1)[:, None]


def closed_by_fans(points: FloatArray, triangles: IntArray) -> tuple[FloatArray, IntArray]:
    """Close each rim of a surface by triangles to a new vertex in its middle: exact where the rim lies in a plane."""
    loops = border_loops(triangles)
    middles = [points[loop].mean(axis=0, keepdims=True) for loop in loops]
    fans = [
        np.stack([np.roll(loop, -1), loop, np.full(len(loop), len(points) + k)], axis=1) for k, loop in enumerate(loops)
    ]
    return np.concatenate([points, *middles]), np.concatenate([triangles, *fans])


def enclosed_volume(points: FloatArray, triangles: IntArray) -> float:
    """Volume enclosed by triangles whose open rims are flat, mm3, positive where they are wound outward.

    Each rim is closed by a fan from its middle; for a rim that lies in a plane that is exact.

    Parameters
    ----------
    points : (n, 3) array
    triangles : (m, 3) array
    """
    return volume(*closed_by_fans(points, triangles))


def fold_angles(points: npt.ArrayLike, triangles: npt.ArrayLike) -> tuple[IntArray, FloatArray]:
    """Angle between the normals of the two triangles at each inner edge.

    Parameters
    ----------
    points : (n, 3) array
        Vertices.
    triangles : (m, 3) array
        Consistently wound triangles.

    Returns
    -------
    pairs : (k, 2) array
        The two triangles at each edge that has two.
    angle : (k,) array
        Degrees: 0 where flat, 180 where the triangles are folded onto each other.

    Raises
    ------
    InputError
        The winding is not consistent, so that normals cannot be compared.
    """
    if not is_consistently_wound(triangles):
        raise InputError("triangles are not consistently wound; fold angles need a surface with one orientation")
    table = edge_table(triangles)
    pairs = table.cells[table.count == 2]
    vectors = area_vectors(points, triangles)
    first, second = vectors[pairs[:, 0]], vectors[pairs[:, 1]]
    sine = np.linalg.norm(np.cross(first, second), axis=1)
    return pairs, np.degrees(np.arctan2(sine, np.einsum("ij,ij->i", first, second)))
