"""Two nested meshes in, sparse matrices between values at their nodes out, exact for linear fields.

A node of the fine mesh was made at a known place of an element of the coarse one, and then moved: onto a smooth
surface, or for better elements. Its value is that of the shape functions at that place, and their slope times the move.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Final

import numpy as np
import scipy.sparse as sp

from femprep.mesh.elements import ELEMENTS, QUADRATIC
from femprep.mesh.measures.sample_points import family, reference_nodes, shape_gradients, shape_values
from femprep.model import FloatArray, IntArray, TagArray, VolumeMesh
from femprep.volume.refine.templates import cut_of

#: Weights of shape functions at the nodes of a child are multiples of one over this.
_GRAIN: Final = 4096.0


@cache
def child_places(name: str) -> FloatArray:
    """Reference coordinates of the nodes of each child of an element type, ``(ways, 8, nodes, 3)``."""
    cut = cut_of(name)
    corner = cut.lattice[cut.children]
    if not ELEMENTS[name].quadratic:
        return corner
    pairs = np.array(ELEMENTS[name].edges)
    return np.concatenate([corner, 0.5 * (corner[:, :, pairs[:, 0]] + corner[:, :, pairs[:, 1]])], axis=2)


def prolongation(
    coarse: VolumeMesh, points: FloatArray, cells: Mapping[str, IntArray], ways: Mapping[str, TagArray]
) -> sp.csr_array:
    """Matrix ``(fine points, coarse points)`` of points ``(n, 3)`` and elements that a mesh was cut into."""
    taken = np.zeros(len(points), dtype=np.bool_)
    parts = []
    for name, block in coarse.cells.items():
        quadratic = ELEMENTS[name].quadratic
        children = cells[QUADRATIC[family(name)] if quadratic else family(name)]
        places = child_places(name)
        for way in range(len(places)):
            rows = np.flatnonzero(ways[name] == way)
            for child in range(8):
                for node in range(places.shape[2]):
                    number = children[8 * rows + child, node]
                    fresh = np.flatnonzero(~taken[number])
                    if not len(fresh):
                        continue
                    number, kept = np.unique(number[fresh], return_index=True)
                    taken[number] = True
                    element = block[rows[fresh[kept]]]
                    parts.append(_rows(name, places[way, child, node], element, number, coarse.points, points))
    return _matrix(parts, len(points), len(coarse.points))


def restriction(coarse: VolumeMesh, fine: VolumeMesh) -> sp.csr_array:
    """Matrix ``(coarse points, fine points)``: nodes of the coarse mesh are nodes of the fine one, which may move."""
    taken = np.ones(len(coarse.points), dtype=np.bool_)
    used = np.concatenate([block.ravel() for block in coarse.cells.values()])
    taken[used] = False
    parts = []
    for name, block in fine.cells.items():
        for node, place in enumerate(reference_nodes(name)):
            number = block[:, node]
            fresh = np.flatnonzero(number < len(coarse.points))
            fresh = fresh[~taken[number[fresh]]]
            if not len(fresh):
                continue
            number, kept = np.unique(number[fresh], return_index=True)
            taken[number] = True
            parts.append(_rows(name, place, block[fresh[kept]], number, fine.points, coarse.points))
    # Mid-side nodes of a coarse quadratic mesh are corners of the fine one, so that all nodes in use were found.
    return _matrix(parts, len(coarse.points), len(fine.points))


def _rows(
    name: str, place: FloatArray, element: IntArray, number: IntArray, source: FloatArray, target: FloatArray
) -> tuple[IntArray, IntArray, FloatArray]:
    """Rows ``number`` of a matrix: values at points near one place of elements, each ``(k, nodes)``."""
    value = np.round(shape_values(name, place) * _GRAIN) / _GRAIN
    slope = shape_gradients(name, place)
    x = source[element]
    step = target[number] - np.einsum("n,knj->kj", value, x)
    weights = np.tile(value, (len(number), 1))
    moved = np.flatnonzero(np.abs(step).max(axis=1) > 1e-14 * np.abs(source).max(initial=1.0))
    if len(moved):
        jacobian = np.einsum("ni,knj->kij", slope, x[moved])  # dx_j / dr_i
        local = np.linalg.solve(np.swapaxes(jacobian, 1, 2), step[moved][:, :, None])[:, :, 0]
        weights[moved] += local @ slope.T
    return np.repeat(number, element.shape[1]), element.ravel(), weights.ravel()


def _matrix(parts: list[tuple[IntArray, IntArray, FloatArray]], rows: int, columns: int) -> sp.csr_array:
    row, column, value = (np.concatenate(found) for found in zip(*parts))
    some = value != 0.0
    matrix = sp.coo_array((value[some], (row[some], column[some])), shape=(rows, columns)).tocsr()
    matrix.sum_duplicates()
    return matrix
