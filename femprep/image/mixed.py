"""Positions of several things along a line in; the smooth course of each, and the jumps they share, out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.mesh.blas import one_blas_thread
from femprep.model import FloatArray, IntArray

#: Degrees of freedom of Student's distribution of jumps and errors: few of either may be far larger than the others.
_FREEDOM: Final = 4.0
#: Times the weights of large jumps and errors are found anew.
_ROUNDS: Final = 5
#: Bounds of the logarithms of the variances (mm2; of a course, mm2 over length scale cubed).
_JUMPS: Final = (-9.0, 7.0)
_ERRORS: Final = (-9.0, 5.0)
_COURSES: Final = (0.0, 16.0)
_CHANGES: Final = (0.0, 4.0)
#: Length in which courses are measured, mm.
_LENGTH: Final = 100.0


@dataclass(frozen=True, eq=False)
class Jumps:
    """What is shared by all positions at one place and is not smooth along the line.

    Attributes
    ----------
    place : (n,) array
        Numbers of the places, increasing.
    size : (n, 2) array
        Best linear unbiased prediction of the jump there, mm.
    deviation : (n,) array
        Its standard deviation in each direction, mm.
    spread : float
        Standard deviation of jumps, mm.
    error : float
        Standard deviation of a single position, mm.
    evidence : float
        Twice the logarithm of the ratio of (restricted) likelihoods with jumps and without.
    """

    place: IntArray
    size: FloatArray
    deviation: FloatArray
    spread: float
    error: float
    evidence: float


@one_blas_thread()
def find_jumps(
    places: Sequence[IntArray],
    positions: Sequence[FloatArray],
    changes: Sequence[FloatArray],
    step: float,
    noise: float,
) -> Jumps:
    """Separate the jumps that several courses share from their smooth parts.

    A linear mixed model: position = course + jump + change + error. Each course is a straight line plus an integrated
    random walk of its own variance, which is a cubic smoothing spline, so that bent things stay bent; jumps are common
    to all courses at a place; errors are a position's own. Where a thing changes its form from one place to the next
    its position changes too, though it did not jump: that has a standard deviation in proportion to the change of form,
    and what change all things at a place have at least is common to them, as where the end of a stack cuts through all.
    The variances are those of the greatest restricted likelihood [1]_, with Student's distribution in place of the
    normal one for jumps and errors [2]_.

    Parameters
    ----------
    places : sequence of (n_j,) arrays
        Where each course was seen: whole numbers, increasing.
    positions : sequence of (n_j, 2) arrays
        Its positions there, mm.
    changes : sequence of (n_j,) arrays
        How much its form differs there from that next to it, mm.
    step : float
        Distance of neighbouring places, mm.
    noise : float
        Least standard deviation of an error, mm.

    Returns
    -------
    Jumps

    References
    ----------
    .. [1] G. Wahba, A comparison of GCV and GML for choosing the smoothing parameter in the generalized spline
       smoothing problem, Ann. Statist. 13(4), 1985. doi:10.1214/aos/1176349743
    .. [2] K. L. Lange, R. J. A. Little, J. M. G. Taylor, Robust statistical modeling using the t distribution, J. Am.
       Stat. Assoc. 84, 1989. doi:10.1080/01621459.1989.10478852
    """
    model = _Model.of(places, positions, changes, step, noise)
    courses = [np.full(len(places), level) for level in (4.0, 8.0)]
    starts = [np.concatenate([[jump, -1.0, 1.0], course]) for jump in (1.0, -3.0) for course in courses]
    parameters, best = model.maximise(starts, True)
    starts = [np.concatenate([[_JUMPS[0], error, 1.0], course]) for error in (-2.0, 1.0) for course in courses]
    _, without = model.maximise(starts, False)
    for _ in range(_ROUNDS):
        model, jumps = model.reweighted(parameters)
        parameters, _ = model.maximise([parameters], True)
    _, jumps = model.reweighted(parameters)
    spread, error = model.deviations(parameters)
    return Jumps(model.places, jumps[0], jumps[1], spread, error, max(0.0, without - best))


@dataclass(frozen=True, eq=False)
class _Model:
    """Observations and design of the mixed model, and the weights of jumps and errors."""

    places: IntArray
    values: FloatArray
    fixed: FloatArray
    shared: FloatArray
    bends: tuple[FloatArray, ...]
    change: FloatArray
    noise: float
    jump_weight: FloatArray
    error_weight: FloatArray

    @classmethod
    def of(
        cls,
        places: Sequence[IntArray],
        positions: Sequence[FloatArray],
        changes: Sequence[FloatArray],
        step: float,
        noise: float,
    ) -> _Model:
        place = np.concatenate(places)
        course = np.concatenate([np.full(len(p), number) for number, p in enumerate(places)])
        unique = np.unique(place)
        along = (place - unique[0]) * (step / _LENGTH)
        low, high = np.minimum.outer(along, along), np.maximum.outer(along, along)
        # Covariance of a twice integrated random walk: the kernel of cubic splines.
        kernel = low * low * (3.0 * high - low) / 6.0
        own = [course == number for number in range(len(places))]
        shared = (place[:, None] == unique[None, :]).astype(float)
        change = np.concatenate(changes) ** 2
        common = np.where(shared > 0.0, change[:, None], np.inf).min(axis=0)
        return cls(
            places=unique.astype(np.int64),
            values=np.concatenate(positions),
            fixed=np.stack([part * power for part in own for power in (np.ones(len(along)), along)], axis=1),
            shared=shared,
            bends=tuple(kernel * np.outer(part, part) for part in own),
            change=(shared * common) @ shared.T + np.diag(change - shared @ common),
            noise=noise * noise,
            jump_weight=np.ones(len(unique)),
            error_weight=np.ones(len(place)),
        )

    def _parts(self, parameters: FloatArray) -> list[FloatArray]:
        """Shares of the covariance of all positions, each of which grows as the exponential of its parameter."""
        jump, error, change, *course = np.exp(parameters)
        return [
            jump * (self.shared / self.jump_weight) @ self.shared.T,
            np.diag(error / self.error_weight),
            change * self.change,
            *(variance * bend for variance, bend in zip(course, self.bends)),
        ]

    def _inverse(self, parts: list[FloatArray]) -> tuple[FloatArray, float]:
        """Inverse covariance, freed of the straight lines, and the logarithm of its determinants."""
        covariance = np.sum(parts, axis=0) + np.diag(self.noise / self.error_weight)
        inverse = np.linalg.inv(covariance)
        lines = inverse @ self.fixed
        inner = self.fixed.T @ lines
        logarithm = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(inner)[1]
        return inverse - lines @ np.linalg.solve(inner, lines.T), float(logarithm)

    def _criterion(self, parameters: FloatArray) -> tuple[float, FloatArray]:
        """Minus twice the restricted log-likelihood of both directions, and its gradient."""
        parts = self._parts(parameters)
        inverse, logarithm = self._inverse(parts)
        pulled = inverse @ self.values
        value = 2.0 * logarithm + float((self.values * pulled).sum())
        gradient = [2.0 * float((inverse * part).sum()) - float((pulled * (part @ pulled)).sum()) for part in parts]
        return value, np.array(gradient)

    def maximise(self, starts: Sequence[FloatArray], jumps: bool) -> tuple[FloatArray, float]:
        """Parameters of the greatest restricted likelihood, and minus twice its logarithm."""
        from scipy.optimize import minimize

        low, high = zip(_JUMPS if jumps else (_JUMPS[0], _JUMPS[0]), _ERRORS, _CHANGES, *(_COURSES for _ in self.bends))
        found = [minimize(self._criterion, s, jac=True, method="L-BFGS-B", bounds=[*zip(low, high)]) for s in starts]
        best = min(found, key=lambda result: float(result.fun))
        return np.clip(best.x, low, high), float(best.fun)

    def reweighted(self, parameters: FloatArray) -> tuple[_Model, tuple[FloatArray, FloatArray]]:
        """The model with the weights that Student's distribution gives, and jumps with their deviation."""
        parts = self._parts(parameters)
        inverse, _ = self._inverse(parts)
        pulled = inverse @ self.values
        jump, error = float(np.exp(parameters[0])), float(np.exp(parameters[1]) + self.noise)
        gain = jump / self.jump_weight
        size = gain[:, None] * (self.shared.T @ pulled)
        variance = gain - gain**2 * np.einsum("ik,ij,jk->k", self.shared, inverse, self.shared)
        own = error / self.error_weight
        rest = own[:, None] * pulled
        doubt = own - own**2 * np.diag(inverse)
        model = _Model(
            **{
                **self.__dict__,
                "jump_weight": _student((size**2).sum(axis=1) + 2.0 * variance, jump),
                "error_weight": _student((rest**2).sum(axis=1) + 2.0 * doubt, error),
            }
        )
        return model, (size, np.sqrt(np.maximum(variance, 0.0)))

    def deviations(self, parameters: FloatArray) -> tuple[float, float]:
        """Standard deviations of jumps and of errors, mm."""
        return float(np.exp(0.5 * parameters[0])), float(np.sqrt(np.exp(parameters[1]) + self.noise))


def _student(squared: npt.NDArray[np.float64], variance: float) -> FloatArray:
    """Weights of two-dimensional values of an expected squared length: small where it is far above the variance."""
    return np.asarray((_FREEDOM + 2.0) / (_FREEDOM + squared / variance), dtype=np.float64)
