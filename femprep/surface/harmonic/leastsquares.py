"""Basis, directions and values in, coefficients out: smoothed least squares, a block of rows at a time."""

from __future__ import annotations

import logging
from typing import Any, NamedTuple

import numpy as np

from femprep.errors import InputError
from femprep.mesh.banded import SPARE, factorise, substitute
from femprep.mesh.compiled import compiled
from femprep.model import FloatArray
from femprep.surface.harmonic.spline import Basis, Spline

_log = logging.getLogger(__name__)

#: Rows of G in memory at a time.
BLOCK = 2048
#: Up to this many elements all of G is kept (64 MB), so that it is computed once.
KEPT = 8_000_000
#: Least square root of a pivot, the diagonal being 1.
_LEAST_PIVOT = np.sqrt(1e-15)


@compiled(grain=8)
def _add_gram(first: int, last: int, rows: Any, gram: Any) -> None:
    """Add the products of all pairs of columns of ``rows`` to the upper half of ``gram``, four rows at a time."""
    length, size = rows.shape
    for i in range(first, last):
        own = gram[i, i:]
        k = 0
        while k + 4 <= length:
            one, two, three, four = rows[k, i:], rows[k + 1, i:], rows[k + 2, i:], rows[k + 3, i:]
            a, b, c, d = one[0], two[0], three[0], four[0]
            for j in range(size - i):
                own[j] += a * one[j] + b * two[j] + c * three[j] + d * four[j]
            k += 4
        while k < length:
            one = rows[k, i:]
            a = one[0]
            for j in range(size - i):
                own[j] += a * one[j]
            k += 1


def _factor(matrix: FloatArray) -> FloatArray | None:
    """Upper Cholesky factor, row i from its diagonal on; None where a pivot is lost in rounding.

    Not LAPACK's, whose rounding depends on the processor and on the number of threads.
    """
    size = len(matrix)
    rows = np.zeros((size, size + SPARE))
    for i, row in enumerate(matrix):
        rows[i, : size - i] = row[i:]
    return rows if factorise(rows) and rows[:, 0].min() > _LEAST_PIVOT else None


class SplineSolution(NamedTuple):
    """How a spline was solved for.

    Attributes
    ----------
    smoothing : float
        Used: at least what was asked for.
    underdetermined : bool
        Whether there are fewer values than unknowns.
    rms : float
        Residual.
    """

    smoothing: float
    underdetermined: bool
    rms: float


def fit_spline(
    basis: Basis,
    directions: FloatArray,
    values: FloatArray,
    smoothing: float = 0.0,
) -> tuple[Spline, SplineSolution]:
    """Fit a spline on the sphere to values at directions (Eqs. 9 to 11).

    G'G is gathered from blocks of rows, scaled to a unit diagonal and factorised; its ill-conditioning is made good
    by refining the solution with residuals taken from G itself. Where N x K is large, blocks are computed when needed.

    Parameters
    ----------
    basis : Basis
        Control points and order.
    directions : (N, 3) array
        Unit vectors.
    values : (N,) array
        Values to approximate.
    smoothing : float
        Weight of the bending energy alpha' S alpha, relative: it is multiplied by trace(G'G) / trace(S).

    Returns
    -------
    spline : Spline
        The fitted function.
    solved : SplineSolution
        How.

    Raises
    ------
    InputError
        There are no values, or they are not finite.
    """
    count, size = len(values), basis.size
    if count == 0 or not (np.all(np.isfinite(values)) and np.all(np.isfinite(directions))):
        raise InputError(f"a spline cannot be fitted to {count} values, some of them not finite")
    blocks = [slice(first, min(first + BLOCK, count)) for first in range(0, count, BLOCK)]

    kept = basis.rows(directions) if count * size <= KEPT else None

    def rows_of(block: slice) -> FloatArray:
        return basis.rows(directions[block]) if kept is None else kept[block]

    gram = np.zeros((size, size))
    for block in blocks:
        _add_gram(size, rows_of(block), gram)
    penalty = basis.penalty
    underdetermined = count < size
    if underdetermined:
        _log.warning("%d control points for %d boundary points: the stopping function is smoothed", size - 1, count)
    # Without the constant, which has no bending energy: the weight then does not depend on psi's scale.
    trace = float(np.trace(gram)) - float(gram[0, 0])
    scale = 1.0 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
    used = max(smoothing, 1e-9) if underdetermined else smoothing
    while True:
        weightless = used * trace / float(np.trace(penalty))
        factor = _factor((np.triu(gram) + weightless * np.triu(penalty)) * scale[:, None] * scale[None, :])
        if factor is not None:
            break
        used = max(10.0 * used, 1e-14)
        _log.info("normal equations of %d control points are singular; smoothing raised to %g", size - 1, used)

    coefficients = np.zeros(size)
    # Two refinements: the error falls by the condition number of G'G times the rounding unit each time.
    for _ in range(3):
        slope = -weightless * (penalty * coefficients).sum(axis=1)
        for block in blocks:
            rows = rows_of(block)
            residual = values[block] - (rows * coefficients).sum(axis=1)
            slope += (rows * residual[:, None]).sum(axis=0)
        step = slope * scale
        substitute(factor, step[None])
        coefficients = coefficients + step * scale
    spline = Spline(basis, coefficients)
    misfit = np.concatenate([(rows_of(block) * coefficients).sum(axis=1) - values[block] for block in blocks])
    rms = float(np.sqrt(np.mean(misfit * misfit)))
    return spline, SplineSolution(float(used), underdetermined, rms)
