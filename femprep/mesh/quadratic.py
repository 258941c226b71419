"""A mesh of linear elements and the middles of its edges in, the mesh of quadratic elements out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from femprep.errors import InputError, StageError
from femprep.mesh.elements import ELEMENTS, QUADRATIC
from femprep.mesh.measures.volume_elements import element_measures
from femprep.model import FloatArray, IntArray, VolumeMesh

_FACETS = {"triangle": "triangle6", "quad": "quad8"}
#: Rounds of straightening: an element that was sound may not be with a neighbour's edge straight.
_ROUNDS = 8
#: Mean ratio, at its worst place, below which a curved element is no better than a straight one of twelve degrees.
POOR: Final = 0.35


@dataclass(frozen=True)
class Edges:
    """The edges of a mesh, each once.

    Attributes
    ----------
    ends : (e, 2) array
        Their ends, smaller number first, in lexicographic order.
    of_cells : mapping of str to (m, k) array
        Number of each edge of each element, in the element type's order, by type.
    total : int
        Number of points of the mesh.
    """

    ends: IntArray
    of_cells: Mapping[str, IntArray]
    total: int

    def find(self, one: IntArray, two: IntArray) -> IntArray:
        """Numbers of the edges between given points; they have to exist."""
        key = self.ends[:, 0] * self.total + self.ends[:, 1]
        wanted = np.minimum(one, two) * self.total + np.maximum(one, two)
        return np.asarray(np.searchsorted(key, wanted), dtype=np.int64)


def number_edges(mesh: VolumeMesh) -> Edges:
    """Number the edges of a mesh of linear elements.

    Raises
    ------
    InputError
        The elements are quadratic already.
    """
    for name in mesh.cells:
        if name not in QUADRATIC:
            raise InputError(f"elements of type {name!r} are quadratic already; give a mesh of linear elements")
    return edges_of(mesh.cells, len(mesh.points))


def edges_of(cells: Mapping[str, IntArray], total: int) -> Edges:
    """Number the edges of linear elements by type, of so many points."""
    pairs = {}
    for name, block in cells.items():
        nodes = np.sort(block[:, np.array(ELEMENTS[name].edges)], axis=2)
        pairs[name] = nodes[..., 0] * total + nodes[..., 1]
    key, place = np.unique(np.concatenate([p.ravel() for p in pairs.values()]), return_inverse=True)
    parts = np.split(place.ravel(), np.cumsum([p.size for p in pairs.values()])[:-1])
    of_cells = {name: part.reshape(pairs[name].shape) for name, part in zip(pairs, parts)}
    return Edges(np.stack([key // total, key % total], axis=1), of_cells, total)


def add_middles(
    mesh: VolumeMesh,
    edges: Edges,
    curved: FloatArray,
    *,
    together: IntArray | None = None,
    point_data: Mapping[str, Any] | None = None,
) -> tuple[VolumeMesh, IntArray]:
    """Give a mesh mid-side nodes, on curved edges where its elements stay valid.

    Where an element's Jacobian is not positive at a corner, the centre or a quadrature point, its edges are made
    straight, until there is none such; so are they where its mean ratio falls below ``POOR`` somewhere and is better
    straight.

    Parameters
    ----------
    mesh : VolumeMesh
        Linear elements of any types.
    edges : Edges
        Its edges.
    curved : (e, 3) array
        Where the middle of each edge should lie, mm.
    together : (e,) array, optional
        Edges with equal numbers are made straight together.
    point_data : mapping of str to (e, ...) array, optional
        Values at the middles; other point data take the mean of both ends.

    Returns
    -------
    mesh : VolumeMesh
        Mid-side nodes follow the corners, in the order of the edges.
    straightened : (s,) array
        Numbers of the edges that were to be curved and were made straight.

    Raises
    ------
    StageError
        An element stays inverted also when straight.
    """
    total, ends = edges.total, edges.ends
    full = {
        QUADRATIC[name]: np.concatenate([block, total + edges.of_cells[name]], axis=1)
        for name, block in mesh.cells.items()
    }
    group = np.arange(len(ends)) if together is None else together
    straight = 0.5 * (mesh.points[ends[:, 0]] + mesh.points[ends[:, 1]])
    given_up = np.zeros(int(group.max(initial=-1)) + 1, dtype=bool)
    points = np.concatenate([mesh.points, curved])
    for _ in range(_ROUNDS):
        bad, before = 0, given_up.copy()
        for name, of_cells in edges.of_cells.items():
            kind = QUADRATIC[name]
            measures = element_measures(points, full[kind], kind)
            inverted = ~(measures["relative_jacobian"] > 0.0)
            bad += int(inverted.sum())
            poor = np.flatnonzero(~inverted & (measures["mean_ratio"] < POOR))
            unbent = element_measures(np.concatenate([mesh.points, straight]), full[kind][poor], kind)
            worse = poor[unbent["mean_ratio"] > measures["mean_ratio"][poor] + 1e-9]
            given_up[group[of_cells[inverted].ravel()]] = True
            given_up[group[of_cells[worse].ravel()]] = True
        if bad == 0 and np.array_equal(given_up, before):
            break
        points[total:] = np.where(given_up[group][:, None], straight, curved)
    if bad:
        raise StageError(f"{bad} quadratic elements stay inverted after their edges were made straight")
    facets = {}
    for name, nodes in mesh.facets.items():
        middles = total + edges.find(nodes, np.roll(nodes, -1, axis=1))
        facets[_FACETS[name]] = np.concatenate([nodes, middles], axis=1)
    added = dict(point_data or {})
    values = {}
    for name, value in mesh.point_data.items():
        middle = added.get(name, 0.5 * (value[ends[:, 0]] + value[ends[:, 1]]))
        values[name] = np.concatenate([value, np.asarray(middle, dtype=value.dtype)])
    curve = np.linalg.norm(curved - straight, axis=1) > 1e-12 * np.linalg.norm(
        mesh.points[ends[:, 1]] - mesh.points[ends[:, 0]], axis=1
    )
    result = replace(mesh, points=points, cells=full, facets=facets, point_data=values)
    return result, np.flatnonzero(given_up[group] & curve)
