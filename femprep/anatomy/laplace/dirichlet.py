"""A stiffness matrix and prescribed values in, the solution at the nodes out."""

from __future__ import annotations

import logging
from collections.abc import Mapping

import numpy as np
import scipy.sparse as sp

from femprep.anatomy.laplace.conjugate import conjugate_gradients
from femprep.anatomy.laplace.fem import LinearElements
from femprep.errors import InputError
from femprep.model import BoolArray, FloatArray, IntArray, tag_name

logger = logging.getLogger(__name__)


def solve(
    space: LinearElements,
    matrix: sp.csr_array,
    fixed: Mapping[int, float] | tuple[IntArray, FloatArray],
    rhs: FloatArray | None = None,
) -> FloatArray:
    """Solve K u = f with u prescribed at some nodes, by conjugate gradients scaled with the diagonal.

    Parameters
    ----------
    space : LinearElements
        The elements.
    matrix : sparse (n, n)
        Symmetric positive semidefinite, from :meth:`LinearElements.stiffness`.
    fixed : pair of arrays, or mapping of facet tag to value
        Nodes (compact numbers) and their values; or the values on the facets of each tag.
    rhs : (n,) array, optional
        Right-hand side; zero where not given.

    Raises
    ------
    InputError
        A piece of the mesh has no node with a prescribed value.
    StageError
        The iteration does not converge.
    """
    out, free, inner, right = reduced(space, matrix, fixed, rhs)
    if not free.any():
        return out
    diagonal = inner.diagonal()
    scale = 1.0 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    inner.data *= scale[inner.indices] * np.repeat(scale, np.diff(inner.indptr))
    u, steps = conjugate_gradients(inner, right * scale)
    logger.debug("conjugate gradients: %d unknowns, %d iterations", len(u), steps)
    out[free] = u * scale
    return out


def reduced(
    space: LinearElements,
    matrix: sp.csr_array,
    fixed: Mapping[int, float] | tuple[IntArray, FloatArray],
    rhs: FloatArray | None = None,
) -> tuple[FloatArray, BoolArray, sp.csr_array, FloatArray]:
    """The prescribed values at all nodes (0 elsewhere), which nodes are free, and matrix and right-hand side of those.

    Raises
    ------
    InputError
        A piece of the mesh has no node with a prescribed value.
    """
    nodes, values = _fixed(space, fixed)
    without = np.setdiff1d(np.arange(space.n_pieces), space.piece[nodes])
    if len(without):
        node = int(np.flatnonzero(space.piece == without[0])[0])
        raise InputError(
            f"{len(without)} of {space.n_pieces} separate pieces of the mesh touch no boundary that a value is "
            f"prescribed on, the first near {np.round(space.points[node], 2).tolist()} mm; remove them "
            "or tag their facets"
        )
    out = np.zeros(space.n)
    out[nodes] = values
    free = np.ones(space.n, dtype=bool)
    free[nodes] = False
    right = (np.zeros(space.n) if rhs is None else rhs) - matrix @ out
    return out, free, matrix[free][:, free], right[free]


def _fixed(
    space: LinearElements, fixed: Mapping[int, float] | tuple[IntArray, FloatArray]
) -> tuple[IntArray, FloatArray]:
    if not isinstance(fixed, Mapping):
        return fixed[0], np.asarray(fixed[1], dtype=float)
    value = np.full(space.n, np.nan)
    for tag, number in fixed.items():
        nodes = space.facet_nodes(tag)
        if not len(nodes):
            raise InputError(f"the mesh has no facets tagged {tag_name(tag)!r}")
        value[nodes] = number
    nodes = np.flatnonzero(np.isfinite(value))
    return nodes, value[nodes]
