"""Values at directions in, a smooth function on the sphere out: Wahba's spline with control points (2.7)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import factorial, frexp
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.mesh.compiled import compiled
from femprep.model import FloatArray, Immutable, readonly
from femprep.model.functions import LOG_TWO, LOGARITHM


@compiled(part=True)
def _logarithm(x: float) -> float:
    """As :func:`femprep.model.functions.logarithm`: the C library's own has other last bits on other processors."""
    share, two = frexp(x)
    if share < 0.7071067811865476:
        share *= 2.0
        two -= 1
    f = share - 1.0
    s = f / (2.0 + f)
    half = 0.5 * f * f
    z = s * s
    total = LOGARITHM[6]
    for k in range(5, -1, -1):
        total = total * z + LOGARITHM[k]
    return two * LOG_TWO[0] - ((half - (s * (half + z * total) + two * LOG_TWO[1])) - f)


@compiled(part=True)
def _kernel(z: float, degree: int) -> float:
    """q_k(z), the integral of t^k (t^2 - 4 W t + 4 W)^(-1/2) over t in (0, 1), with W = (1 - z) / 2.

    Integration by parts gives k q_k = 1 + (4 k - 2) W q_(k-1) - 4 (k - 1) W q_(k-2), from q_0 = ln(1 + W^(-1/2)) and
    q_1 = 1 - 2 W^(1/2) + 2 W q_0. W q_0 goes to zero with W, which leaves q_k(1) = 1 / k.
    """
    w = min(max(0.5 * (1.0 - z), 0.0), 1.0)
    if w < 1e-32:
        return 1.0 / degree
    root = np.sqrt(w)
    before = _logarithm((1.0 + root) / root)
    value = 1.0 - 2.0 * root + 2.0 * w * before
    for k in range(2, degree + 1):
        before, value = value, (1.0 + (4 * k - 2) * w * value - (4 * k - 4) * w * before) / k
    return value


@compiled(grain=64, writes="out")
def _rows(first: int, last: int, directions: Any, knots: Any, degree: int, scale: float, mean: float, out: Any) -> None:
    """Basis functions at directions: a column of ones, then psi about each knot."""
    for i in range(first, last):
        out[i, 0] = 1.0
        for k in range(knots.shape[0]):
            z = directions[i, 0] * knots[k, 0] + directions[i, 1] * knots[k, 1] + directions[i, 2] * knots[k, 2]
            out[i, k + 1] = scale * (_kernel(z, degree) - mean)


@compiled(grain=64, writes="out")
def _values(
    first: int,
    last: int,
    directions: Any,
    knots: Any,
    degree: int,
    scale: float,
    mean: float,
    coefficients: Any,
    out: Any,
) -> None:
    """The spline at directions, without its basis in memory."""
    for i in range(first, last):
        total = 0.0
        for k in range(knots.shape[0]):
            z = directions[i, 0] * knots[k, 0] + directions[i, 1] * knots[k, 1] + directions[i, 2] * knots[k, 2]
            total += coefficients[k + 1] * (_kernel(z, degree) - mean)
        out[i] = coefficients[0] + scale * total


@dataclass(frozen=True, eq=False)
class Basis(Immutable):
    """A constant and one bump psi about each control point: what Eq. 8 combines.

    Attributes
    ----------
    knots : (K, 3) array
        Control points, unit vectors.
    order : int
        Wahba's order m. psi(z) = (q_(2m-2)(z) / (2m-2)! - 1 / (2m-1)!) / (2 pi).

    References
    ----------
    G. Wahba, "Spline interpolation and smoothing on the sphere", 1981, doi 10.1137/0902002.
    """

    knots: FloatArray
    order: int = 4

    def __post_init__(self) -> None:
        object.__setattr__(self, "knots", readonly(self.knots, np.float64, (None, 3), "control points"))

    @property
    def size(self) -> int:
        """Number of coefficients, K + 1."""
        return len(self.knots) + 1

    @property
    def _constants(self) -> tuple[int, float, float]:
        """Degree 2m-2, and scale and mean of psi = scale (q - mean)."""
        degree = 2 * self.order - 2
        return degree, 1.0 / (2.0 * np.pi * factorial(degree)), 1.0 / (degree + 1)

    def rows(self, directions: FloatArray) -> FloatArray:
        """Values of all basis functions ``(n, K + 1)`` at unit vectors ``(n, 3)``: rows of G, Eq. 11."""
        directions = np.ascontiguousarray(directions, dtype=np.float64)
        out = np.empty((len(directions), self.size))
        _rows(len(directions), directions, self.knots, *self._constants, out)
        return out

    def values(self, directions: FloatArray, coefficients: FloatArray) -> FloatArray:
        """Combination of the basis functions ``(n,)`` at unit vectors ``(n, 3)``, Eq. 8."""
        directions = np.ascontiguousarray(directions, dtype=np.float64)
        out = np.empty(len(directions))
        _values(len(directions), directions, self.knots, *self._constants, np.ascontiguousarray(coefficients), out)
        return out

    @cached_property
    def penalty(self) -> FloatArray:
        """Matrix S ``(K + 1, K + 1)`` of the spline's bending energy alpha' S alpha: psi between control points."""
        matrix = self.rows(self.knots)
        return np.vstack([np.zeros((1, self.size)), np.column_stack([np.zeros(len(self.knots)), matrix[:, 1:]])])


@dataclass(frozen=True, eq=False)
class Spline(Immutable):
    """A function on the unit sphere, Eq. 8.

    Attributes
    ----------
    basis : Basis
        Control points and order.
    coefficients : (K + 1,) array
        alpha, the constant first.
    """

    basis: Basis
    coefficients: FloatArray

    def __post_init__(self) -> None:
        coefficients = readonly(self.coefficients, np.float64, (self.basis.size,), "spline coefficients")
        object.__setattr__(self, "coefficients", coefficients)

    def __call__(self, directions: npt.ArrayLike) -> FloatArray:
        """Values ``(n,)`` at unit vectors ``(n, 3)``."""
        return self.basis.values(np.asarray(directions, dtype=np.float64).reshape(-1, 3), self.coefficients)
