"""Linear finite elements for scalar problems: a VolumeMesh in; stiffness matrices, gradients and means out.

Tetrahedra are P1, wedges and hexahedra Q1 with full quadrature; quadratic elements are taken by their corner nodes and
their mid-side nodes get the mean of the two ends. A stiffness matrix without a mass term has rows that sum to zero, so
only the entries of one triangle are ever assembled, on a pattern that is sorted once and used for every problem.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from femprep.anatomy.laplace.pattern import Pattern
from femprep.anatomy.laplace.shapes import centre, quadrature, shape_functions
from femprep.errors import InputError
from femprep.mesh.blas import one_blas_thread
from femprep.mesh.elements import ELEMENTS
from femprep.model import FloatArray, IntArray, VolumeMesh
from femprep.model.blocks import chosen_rows, nodes_of, numbers_among

_CHUNK: Final = 20_000


@dataclass(frozen=True)
class _Block:
    """One element type: its corner nodes in compact numbering, and where its elements and pairs begin."""

    name: str
    cells: IntArray
    first: int
    slope: FloatArray  # (k, p, 3) gradients of the shape functions at the centre
    pairs: tuple[IntArray, IntArray]  # local node numbers of the node pairs


class LinearElements:
    """Scalar linear elements on a mesh, on the nodes its elements use.

    Parameters
    ----------
    mesh : VolumeMesh
        Any mixture of element types.

    Attributes
    ----------
    nodes : (n,) array
        Point numbers of the corner nodes, increasing; arrays "at nodes" are in this order.
    points : (n, 3) array
        Their positions, mm.
    volume : (n_cells,) array
        Element volumes, mm3.
    n_pieces : int
        Number of pieces of the mesh that share no node.
    piece : (n,) array
        Which of them each node belongs to.

    Raises
    ------
    InputError
        There are no elements, or an element is inverted or without volume.
    """

    @one_blas_thread()
    def __init__(self, mesh: VolumeMesh) -> None:
        if mesh.n_cells == 0:
            raise InputError("the mesh has no elements; coordinates and fibres need a volume mesh")
        self.mesh = mesh
        corner = {name: block[:, : ELEMENTS[name].corners] for name, block in mesh.cells.items() if len(block)}
        self.nodes = nodes_of(corner)
        self._compact = numbers_among(self.nodes, len(mesh.points))
        self.points: FloatArray = mesh.points[self.nodes]
        self.n = len(self.nodes)

        blocks, volumes, first = [], [], 0
        for name, block in corner.items():
            cells = self._compact[block]
            value = shape_functions(name, centre(name))[1]
            slope = np.empty((len(cells), cells.shape[1], 3))
            volume = np.empty(len(cells))
            for part, gradient, weight in self._geometry(name, cells, first, *quadrature(name)):
                volume[part] = weight.sum(axis=1)
                slope[part] = gradient[:, 0] if gradient.shape[1] == 1 else 0.0
            if cells.shape[1] != 4:
                for part, gradient, _ in self._geometry(name, cells, first, centre(name), np.ones(1), value):
                    slope[part] = gradient[:, 0]
            i, j = np.triu_indices(cells.shape[1], 1)
            blocks.append(_Block(name, cells, first, slope, (i.astype(np.int64), j.astype(np.int64))))
            volumes.append(volume)
            first += len(cells)
        self._blocks = blocks
        self.n_cells = first
        self.volume: FloatArray = np.concatenate(volumes)
        self._pattern = Pattern([(block.cells, *block.pairs) for block in blocks], self.n)
        shape = (self.n, self.n)
        ones = np.ones(len(self._pattern.indices), dtype=np.int8)
        graph = sp.csr_array((ones, self._pattern.indices, self._pattern.indptr), shape=shape)
        self.n_pieces, self.piece = connected_components(graph, directed=False)

    def _geometry(
        self,
        name: str,
        cells: IntArray,
        first: int,
        points: FloatArray,
        weights: FloatArray,
        reference: FloatArray | None = None,
    ) -> Iterator[tuple[slice, FloatArray, FloatArray]]:
        """Chunk by chunk: gradients ``(c, q, p, 3)`` of the shape functions and weights times Jacobian ``(c, q)``."""
        slope = shape_functions(name, points)[1] if reference is None else reference
        for start in range(0, len(cells), _CHUNK):
            part = slice(start, min(start + _CHUNK, len(cells)))
            x = self.points[cells[part]]
            jacobian = np.einsum("qpj,cpi->cqij", slope, x, optimize=True)  # dx_i / dr_j
            rows = [jacobian[..., i] for i in range(3)]  # dx/dr, dx/ds, dx/dt
            cross = np.stack([np.cross(rows[i - 2], rows[i - 1]) for i in range(3)], axis=-2)
            det = np.einsum("cqi,cqi->cq", cross[..., 0, :], rows[0])
            if not (det > 0).all():
                bad = int(np.flatnonzero(~(det > 0).all(axis=1))[0])
                raise InputError(
                    f"element {first + start + bad} ({name}) has Jacobian {det[bad].min():.3g} mm3, expected a "
                    "positive one; mend the mesh (femprep check lists inverted elements)"
                )
            inverse = cross / det[..., None, None]  # row j is grad r_j
            yield part, np.matmul(slope[None], inverse), det * weights

    def stiffness(
        self, direction: FloatArray | None = None, weight: FloatArray | None = None, cross: float = 0.0
    ) -> sp.csr_array:
        """Matrix of the integral of grad u . D grad v, with D given per element.

        Parameters
        ----------
        direction : (n_cells, 3) array, optional
            Unit vectors T: D = w (T T' + cross (I - T T')). Without it D = w I.
        weight : (n_cells,) array, optional
            The weight w; 1 where not given.
        cross : float
            Diffusion across the direction, relative to that along it.
        """
        data = self._pattern.zeros()
        for number, block in enumerate(self._blocks):
            i, j = block.pairs
            for part, gradient, volume in self._chunks(block):
                where = slice(block.first + part.start, block.first + part.stop)
                if weight is not None:
                    volume = volume * weight[where, None]
                term = np.zeros((len(volume), len(i)))
                for q in range(gradient.shape[1]):
                    g = gradient[:, q]
                    along: Any = 0.0
                    if direction is not None:
                        a = np.einsum("cpi,ci->cp", g, direction[where])
                        along = a[:, i] * a[:, j] * (1 - cross)
                    if direction is None or cross:
                        scale = 1.0 if direction is None else cross
                        along = along + scale * np.einsum("cki,cki->ck", g[:, i], g[:, j])
                    term += volume[:, q, None] * along
                self._pattern.add(data, number, part, term)
        return self._pattern.matrix(data)

    def load(self, vector: FloatArray) -> FloatArray:
        """Right-hand side ``(n,)``: the integral of T . grad v, for vectors T ``(n_cells, 3)``."""
        out = np.zeros(self.n)
        for block in self._blocks:
            value = np.empty(block.cells.shape)
            for part, gradient, volume in self._chunks(block):
                where = slice(block.first + part.start, block.first + part.stop)
                value[part] = np.einsum("cqpi,ci,cq->cp", gradient, vector[where], volume, optimize=True)
            out += np.bincount(block.cells.ravel(), weights=value.ravel(), minlength=self.n)
        return out

    def _chunks(self, block: _Block) -> Iterator[tuple[slice, FloatArray, FloatArray]]:
        if block.cells.shape[1] != 4:
            yield from self._geometry(block.name, block.cells, block.first, *quadrature(block.name))
            return
        for start in range(0, len(block.cells), _CHUNK):
            part = slice(start, min(start + _CHUNK, len(block.cells)))
            volume = self.volume[block.first + part.start : block.first + part.stop, None]
            yield part, block.slope[part, None], volume

    def gradient(self, values: FloatArray) -> FloatArray:
        """Gradient at element centres ``(n_cells, 3)`` of values at nodes ``(n,)``, 1/mm."""
        out = np.empty((self.n_cells, 3))
        for block in self._blocks:
            for start in range(0, len(block.cells), _CHUNK):
                part = slice(start, min(start + _CHUNK, len(block.cells)))
                where = slice(block.first + part.start, block.first + part.stop)
                out[where] = np.einsum("cpi,cp->ci", block.slope[part], values[block.cells[part]])
        return out

    def corners(self, values: FloatArray) -> list[FloatArray]:
        """Values at nodes, gathered at each element's corners: ``(k, p, ...)``, one block a type."""
        return [values[block.cells] for block in self._blocks]

    @property
    def block_names(self) -> list[str]:
        """Element types, in the order of the blocks."""
        return [block.name for block in self._blocks]

    def to_nodes(self, cell_values: FloatArray) -> FloatArray:
        """Volume-weighted mean over the elements at each node, ``(n, ...)``."""
        flat = np.asarray(cell_values, dtype=float).reshape(self.n_cells, -1)
        out = np.zeros((self.n, flat.shape[1]))
        total = np.zeros(self.n)
        for block in self._blocks:
            part = slice(block.first, block.first + len(block.cells))
            volume = self.volume[part]
            node = block.cells.ravel()
            repeat = block.cells.shape[1]
            total += np.bincount(node, weights=np.repeat(volume, repeat), minlength=self.n)
            for k in range(flat.shape[1]):
                weight = np.repeat(volume * flat[part, k], repeat)
                out[:, k] += np.bincount(node, weights=weight, minlength=self.n)
        out /= total[:, None]
        return out.reshape((self.n, *np.shape(cell_values)[1:]))

    def to_cells(self, values: FloatArray) -> FloatArray:
        """Mean over each element's corners, which is the value at its centre, ``(n_cells, ...)``."""
        out = np.empty((self.n_cells, *values.shape[1:]))
        for rows, nodes in self.parts():
            out[rows] = values[nodes].mean(axis=1)
        return out

    def parts(self) -> Iterator[tuple[slice, IntArray]]:
        """Go through all elements, some at a time: which they are, and their corner nodes ``(c, p)``."""
        for block in self._blocks:
            for start in range(0, len(block.cells), _CHUNK):
                nodes = block.cells[start : start + _CHUNK]
                yield slice(block.first + start, block.first + start + len(nodes)), nodes

    def to_points(self, values: FloatArray) -> FloatArray:
        """Values at all points of the mesh: mid-side nodes get the mean of their ends, unused points 0."""
        out = np.zeros((len(self.mesh.points), *values.shape[1:]))
        out[self.nodes] = values
        for name, block in self.mesh.cells.items():
            kind = ELEMENTS[name]
            if kind.quadratic:
                for k, (i, j) in enumerate(kind.edges):
                    out[block[:, kind.corners + k]] = (out[block[:, i]] + out[block[:, j]]) / 2
        return out

    def facet_nodes(self, *tags: int) -> IntArray:
        """Nodes (compact numbers) of all facets with one of the tags; empty where there are none."""
        chosen = chosen_rows(self.mesh.facets, np.isin(self.mesh.facet_tag, tags))
        compact = np.unique(self._compact[nodes_of(chosen)])
        return compact[compact >= 0]  # mid-side nodes have no compact number
