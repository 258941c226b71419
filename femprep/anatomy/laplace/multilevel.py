"""A problem on a mesh, solved on the coarser one it is a refinement of, in; its solution there by few steps out.

Conjugate gradients begin at the coarser mesh's solution, and are preconditioned by the diagonals of all levels, the
coarsest's matrix whole (Bramble, Pasciak & Xu 1990): the number of steps then depends little on the number of
elements. It ends where the error, in the energy norm as far as the preconditioner tells it, is a ten-thousandth of
the difference between the two levels. To begin at the coarser solution and take a few steps scaled by the diagonal
alone (Bornemann & Deuflhard 1996, doi 10.1007/s002110050234) is not enough here: the line at the apex on which the
apicobasal field is held is as wide as an edge, so that its levels differ everywhere, and smoothly.

References
----------
Bramble, Pasciak, Xu, Parallel multilevel preconditioners, Math. Comp. 55, 1990.
doi:10.1090/S0025-5718-1990-1023042-6
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from femprep.anatomy.laplace.conjugate import conjugate_gradients
from femprep.anatomy.laplace.dirichlet import reduced, solve
from femprep.anatomy.laplace.fem import LinearElements
from femprep.mesh.blas import one_blas_thread
from femprep.model import BoolArray, FloatArray, IntArray

logger = logging.getLogger(__name__)

#: Of the difference between two levels, what is left as error.
TOLERANCE: Final = 1e-4
#: Unknowns of a coarsest level up to which its matrix is factorised; beyond it, its diagonal serves.
_DIRECT: Final = 15_000


@dataclass(frozen=True, eq=False)
class LevelSolution:
    """A problem that was solved on one level, with what helps to solve it on a finer one.

    Attributes
    ----------
    values : (n,) array
        The solution at all nodes.
    free : (n,) array
        Which nodes have no prescribed value.
    correct : callable
        An approximate inverse of the matrix, on values at the free nodes.
    """

    values: FloatArray
    free: BoolArray
    correct: Callable[[FloatArray], FloatArray]


@one_blas_thread()
def solve_coarsest(
    space: LinearElements, matrix: sp.csr_array, fixed: tuple[IntArray, FloatArray], rhs: FloatArray | None = None
) -> LevelSolution:
    """Solve a problem as :func:`~femprep.anatomy.laplace.dirichlet.solve` does."""
    values = solve(space, matrix, fixed, rhs)
    _, free, inner, _ = reduced(space, matrix, fixed, rhs)
    if 0 < inner.shape[0] <= _DIRECT:
        inverse = splu(
            sp.csc_matrix(inner), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
        return LevelSolution(values, free, inverse.solve)
    diagonal = _diagonal(inner)
    return LevelSolution(values, free, lambda residual: residual / diagonal)


@one_blas_thread()
def solve_nested(
    space: LinearElements,
    matrix: sp.csr_array,
    fixed: tuple[IntArray, FloatArray],
    rhs: FloatArray | None,
    down: sp.csr_array,
    coarser: LevelSolution,
) -> LevelSolution:
    """Solve a problem that was solved on the coarser mesh.

    Parameters
    ----------
    space, matrix, fixed, rhs
        As for :func:`~femprep.anatomy.laplace.dirichlet.solve`.
    down : sparse (n, coarser n)
        Values at the nodes from those at the coarser mesh's nodes.
    coarser : LevelSolution

    Raises
    ------
    InputError, StageError
        As there.
    """
    out, free, inner, right = reduced(space, matrix, fixed, rhs)
    diagonal = _diagonal(inner)
    own = sp.csr_array(down[free][:, coarser.free])
    back = own.T

    def correct(residual: FloatArray) -> FloatArray:
        return np.asarray(residual / diagonal + own @ coarser.correct(back @ residual))

    if free.any():
        start = (down @ coarser.values)[free]
        out[free], steps = conjugate_gradients(inner, right, start, correct, TOLERANCE)
        logger.debug("conjugate gradients on nested meshes: %d unknowns, %d iterations", len(start), steps)
    return LevelSolution(out, free, correct)


def _diagonal(matrix: sp.csr_array) -> FloatArray:
    diagonal = matrix.diagonal()
    return np.where(diagonal > 0, diagonal, 1.0)
