"""A sparse symmetric positive definite matrix and a right-hand side in, the solution by conjugate gradients out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
import scipy.sparse as sp

from femprep.errors import StageError
from femprep.model import FloatArray

#: The iteration stops where the residual has fallen by this factor.
TOLERANCE: Final = 1e-10
_STEPS: Final = 20_000


def conjugate_gradients(
    matrix: sp.csr_array,
    right: FloatArray,
    start: FloatArray | None = None,
    precondition: Callable[[FloatArray], FloatArray] | None = None,
    tolerance: float = TOLERANCE,
) -> tuple[FloatArray, int]:
    """Solve A x = b, A symmetric positive definite; the solution and the number of steps.

    From x = 0 where no start is given. It ends where the residual, measured by the preconditioner where there is one,
    is the tolerance times what it was at the start.

    Its inner products are sums in one thread, not BLAS calls: on short vectors threads of BLAS cost more than they
    give, and on a busy machine many times more; and the sums are the same on every machine.

    Raises
    ------
    StageError
        The residual has not fallen by the tolerance in 20,000 steps.
    """
    x = np.zeros_like(right) if start is None else start.copy()
    residual = right.copy() if start is None else right - matrix @ start
    better = residual if precondition is None else precondition(residual)
    direction = better.copy()
    square = float(np.einsum("i,i->", residual, better))
    goal = tolerance**2 * square
    for step in range(_STEPS):
        if square <= goal:
            return x, step
        image = matrix @ direction
        length = square / float(np.einsum("i,i->", direction, image))
        x += length * direction
        residual -= length * image
        better = residual if precondition is None else precondition(residual)
        following = float(np.einsum("i,i->", residual, better))
        direction *= following / square
        direction += better
        square = following
    raise StageError(
        f"conjugate gradients did not converge in {_STEPS} steps on {len(right)} unknowns; the mesh probably has "
        "very flat elements (femprep check lists them)"
    )
