"""Charges inside a sphere in, a harmonic field out: zero on the sphere, its values and gradients (A.4 to A.6)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.model import FloatArray, Immutable, readonly
from femprep.model.products import unit_vectors
from femprep.surface.harmonic import kernels

#: Runge-Kutta steps that are tried first, and at most; points of each kind that their
#: error is estimated from.
_FEWEST, _MOST, _SAMPLE = 6, 320, 64


@dataclass(frozen=True, eq=False)
class Field(Immutable):
    """A harmonic function inside a sphere: charges and their images, zero on the sphere (Eq. 3).

    Attributes
    ----------
    centre : (3,) array
        Centre of the sphere, mm.
    radius : float
        Its radius R, mm.
    sources : (M, 3) array
        Singularities s, inside the sphere, mm.
    strength : (M,) array
        Their strengths c_m, mm, so that u has no dimension.

    References
    ----------
    O. Skrinjar, A. Bistoquet, "Generation of myocardial wall surface meshes from segmented MRI", 2009,
    doi 10.1155/2009/313517.
    """

    centre: FloatArray
    radius: float
    sources: FloatArray
    strength: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", readonly(self.centre, np.float64, (3,), "centre of the sphere"))
        object.__setattr__(self, "radius", float(self.radius))
        object.__setattr__(self, "sources", readonly(self.sources, np.float64, (None, 3), "singularities"))
        strength = np.broadcast_to(np.asarray(self.strength, dtype=float), (len(self.sources),))
        object.__setattr__(self, "strength", readonly(strength, np.float64, (None,), "strengths"))
        if not (np.isfinite(self.radius) and self.radius > 0.0):
            raise InputError(f"radius of the sphere is {self.radius} mm, expected a positive length")
        far = np.linalg.norm(self.sources - self.centre, axis=1).max(initial=0.0)
        if len(self.sources) == 0 or not far < self.radius:
            raise InputError(
                f"{len(self.sources)} singularities reach {far:g} mm from the centre of a sphere of radius "
                f"{self.radius:g} mm; at least one is needed and all have to lie inside"
            )

    @cached_property
    def _charges(self) -> tuple[FloatArray, ...]:
        """x, y, z, 1 - |s|^2 and weight of each charge, in radii."""
        s = (self.sources - self.centre) / self.radius
        x, y, z = (np.ascontiguousarray(s[:, k]) for k in range(3))
        gap = 1.0 - (x * x + y * y + z * z)
        return x, y, z, gap, np.ascontiguousarray(self.strength / self.radius)

    def _unit(self, points: npt.ArrayLike) -> FloatArray:
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        return np.ascontiguousarray((points - self.centre) / self.radius)

    def potential(self, points: npt.ArrayLike) -> FloatArray:
        """Values u ``(n,)`` at points ``(n, 3)`` mm, Eq. A.5."""
        unit = self._unit(points)
        out = np.empty(len(unit))
        kernels.potential(kernels.blocks(unit), unit, *self._charges, out)
        return out

    def gradient(self, points: npt.ArrayLike) -> FloatArray:
        """Gradients of u ``(n, 3)``, 1/mm, at points ``(n, 3)`` mm, Eq. A.6."""
        unit = self._unit(points)
        out = np.empty_like(unit)
        kernels.gradient(kernels.blocks(unit), unit, *self._charges, out)
        return out / self.radius

    def directions(self, points: npt.ArrayLike) -> FloatArray:
        """Unit vectors ``(n, 3)`` from the centre to points ``(n, 3)`` mm."""
        return unit_vectors(self._unit(points))

    def flow(
        self, points: npt.ArrayLike, start: npt.ArrayLike, stop: npt.ArrayLike, steps: int, settle: int = 0
    ) -> FloatArray:
        """Carry points along the gradient from one level of u to another (Eq. 7).

        The flow is taken as dr/du = grad u / |grad u|^2: its parameter is u itself, so that every point ends at its
        own level after the same number of classical fourth-order Runge-Kutta steps.

        Parameters
        ----------
        points : (n, 3) array
            Start points, mm.
        start, stop : float or (n,) array
            Value of u each point starts from and ends at.
        steps : int
            Number of Runge-Kutta steps.
        settle : int
            Newton steps along the gradient afterwards, which remove the error across the level.

        Returns
        -------
        (n, 3) array
            End points, mm.
        """
        unit = self._unit(points)
        first, last = (np.ascontiguousarray(np.broadcast_to(v, (len(unit),)), dtype=np.float64) for v in (start, stop))
        out = np.empty_like(unit)
        kernels.flow(kernels.blocks(unit), unit, first, last, int(steps), *self._charges, out)
        if settle:
            kernels.settle(kernels.blocks(out), out, last, int(settle), *self._charges)
        return self.centre + self.radius * out

    def enough_steps(self, points: npt.ArrayLike, start: npt.ArrayLike, tolerance: float) -> int:
        """Fewest Runge-Kutta steps to the sphere that lead points within a tolerance of where endlessly many would.

        A sample of the points is carried in few steps and in twice as many, and so on: the error of the classical
        method falls by 2^4 each time, so that the difference of the two is 15/16 of it. The sample holds the points
        where the gradient is weakest, as in hollows of the object, whose lines bend most, and others spread evenly.

        Parameters
        ----------
        points, start
            As for :meth:`flow`.
        tolerance : float
            Greatest error, mm. A quarter of it is asked of the sample, for the points that are not in it.

        Returns
        -------
        int
            Even, 6 to 320.
        """
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        spread = np.linspace(0, len(points) - 1, min(len(points), _SAMPLE)).round().astype(np.int64)
        weakest = np.argsort(np.linalg.norm(self.gradient(points), axis=1), kind="stable")[:_SAMPLE]
        chosen = np.union1d(spread, weakest)
        first = np.broadcast_to(np.asarray(start, dtype=np.float64), len(points))[chosen]
        steps = _FEWEST
        coarse = self.flow(points[chosen], first, 0.0, steps)
        while True:
            fine = self.flow(points[chosen], first, 0.0, 2 * steps)
            error = 16.0 / 15.0 * float(np.linalg.norm(fine - coarse, axis=1).max())
            needed = steps * float(np.sqrt(np.sqrt(error / (0.25 * tolerance))))
            if needed <= 2.0 * steps or 2 * steps >= _MOST:
                return int(np.clip(2 * np.ceil(0.5 * needed), _FEWEST, _MOST))
            steps, coarse = 2 * steps, fine

    def on_sphere(self, directions: npt.ArrayLike) -> FloatArray:
        """Points ``(n, 3)`` mm of the sphere in directions ``(n, 3)``, which need not have unit length."""
        directions = np.asarray(directions, dtype=np.float64).reshape(-1, 3)
        length = np.linalg.norm(directions, axis=1, keepdims=True)
        if not np.all(length > 0.0):
            raise InputError("a direction has length zero; give unit vectors")
        return self.centre + self.radius * directions / length


def fit_strength(field: Field, points: npt.ArrayLike) -> Field:
    """Give all charges the one strength that makes u closest to 1 at points, in the least squares sense (Eq. 6).

    Parameters
    ----------
    field : Field
        The sphere and the singularities; its strengths are not used.
    points : (N, 3) array
        Boundary points of the object, mm.

    Raises
    ------
    InputError
        There are no points, or one lies outside the sphere.
    """
    d = replace(field, strength=np.ones(1)).potential(points)
    if len(d) == 0 or not np.all(np.isfinite(d)) or d.min() <= 0.0:
        raise InputError(
            f"{int(np.count_nonzero(~(d > 0.0)))} of {len(d)} boundary points lie outside the sphere of radius "
            f"{field.radius:g} mm; a larger sphere is needed"
        )
    # Eq. 6: c = sum d / sum d^2.
    return replace(field, strength=np.full(1, d.sum() / (d * d).sum()))
