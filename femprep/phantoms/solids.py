"""Solids with known surfaces: unit vectors in, exact points out; inside test, closed-form volume, distance."""

from __future__ import annotations

from dataclasses import dataclass
from math import comb, exp, inf, pi
from typing import Protocol

import numpy as np

from femprep.errors import OptionError
from femprep.model import BoolArray, FloatArray, readonly
from femprep.phantoms.bends import STRAIGHT, Bend
from femprep.phantoms.closest import closest_directions


class Solid(Protocol):
    """What every solid answers, in its own coordinates (mm): z is the long axis, the base towards +z."""

    def inside(self, points: FloatArray) -> BoolArray:
        """Whether points ``(n, 3)`` lie in the solid, its truncation included."""
        ...

    def surface(self, directions: FloatArray) -> FloatArray:
        """Points ``(n, 3)`` of the closed surface (flat caps included), one for each unit vector ``(n, 3)``."""
        ...

    def smooth_surface(self, directions: FloatArray) -> FloatArray:
        """Points ``(n, 3)`` of the surface before truncation."""
        ...

    def distance(self, points: FloatArray) -> FloatArray:
        """Signed distance ``(n,)`` from the surface before truncation, mm, positive outside."""
        ...

    def volume(self, low: float = -inf, high: float = inf) -> float:
        """Volume between two heights along the long axis (along its arc where that is bent), mm3."""
        ...


@dataclass(frozen=True)
class EllipsoidBody:
    """An ellipsoid, optionally cut at two heights of its long axis and bent.

    Attributes
    ----------
    semi_axes : tuple of 3 floats
        Along x, y and z, mm.
    low, high : float
        It is cut at these heights z of the straight body, mm.
    bend : Bend
        How it is bent after that.
    """

    semi_axes: tuple[float, float, float]
    low: float = -inf
    high: float = inf
    bend: Bend = STRAIGHT

    def __post_init__(self) -> None:
        axes = readonly(self.semi_axes, np.float64, (3,), "semi-axes")
        if not np.all(np.isfinite(axes)) or axes.min() <= 0.0:
            raise OptionError(f"semi-axes are {self.semi_axes} mm, expected three positive numbers")
        if not max(self.low, -axes[2]) < min(self.high, axes[2]):
            raise OptionError(
                f"nothing is left between heights {self.low} and {self.high} mm of semi-axis {axes[2]} mm"
            )
        self.bend.require_injective(axes)

    def inside(self, points: FloatArray) -> BoolArray:
        """Whether points lie in the solid."""
        q = self.bend.backward(np.atleast_2d(np.asarray(points, dtype=np.float64)))
        level = np.einsum("ij,ij->i", q / self._axes, q / self._axes)
        return np.asarray((level <= 1.0) & (q[:, 2] >= self.low) & (q[:, 2] <= self.high))

    def surface(self, directions: FloatArray) -> FloatArray:
        """Points of the closed surface: rays of the straight body, cut by its caps, then bent."""
        d = np.atleast_2d(np.asarray(directions, dtype=np.float64)) * self._axes
        bottom, top = max(self.low, -self.semi_axes[2]), min(self.high, self.semi_axes[2])
        # Rays start at the centre where that is inside, else half-way between the caps.
        start = 0.0 if bottom < 0.0 < top else 0.5 * (bottom + top)
        scaled = d / self._axes
        a = np.einsum("ij,ij->i", scaled, scaled)
        b = scaled[:, 2] * start / self.semi_axes[2]
        c = (start / self.semi_axes[2]) ** 2 - 1.0
        reach = (-b + np.sqrt(b * b - a * c)) / a
        with np.errstate(divide="ignore", invalid="ignore"):
            for height in (bottom, top):
                cap = (height - start) / d[:, 2]
                reach = np.where((cap > 0.0) & (cap < reach), cap, reach)
        q = reach[:, None] * d
        q[:, 2] += start
        return self.bend.forward(q)

    def smooth_surface(self, directions: FloatArray) -> FloatArray:
        """Points of the bent ellipsoid."""
        return self.bend.forward(np.atleast_2d(np.asarray(directions, dtype=np.float64)) * self._axes)

    def distance(self, points: FloatArray) -> FloatArray:
        """Signed distance from the bent ellipsoid."""
        points = np.atleast_2d(np.asarray(points, dtype=np.float64))
        q = self.bend.backward(points)
        inside = np.einsum("ij,ij->i", q / self._axes, q / self._axes) <= 1.0
        nearest = self.smooth_surface(closest_directions(self.smooth_surface, self._derivative, points))
        return np.asarray(np.where(inside, -1.0, 1.0) * np.linalg.norm(points - nearest, axis=1))

    def volume(self, low: float = -inf, high: float = inf) -> float:
        """Volume between two heights: pi a b (z - z^3 / (3 c^2)) between them; bending keeps it."""
        a, b, c = self.semi_axes
        bottom, top = max(low, self.low, -c), min(high, self.high, c)
        if top <= bottom:
            return 0.0
        return pi * a * b * ((top - bottom) - (top**3 - bottom**3) / (3.0 * c * c))

    @property
    def _axes(self) -> FloatArray:
        return np.asarray(self.semi_axes, dtype=np.float64)

    def _derivative(self, directions: FloatArray) -> FloatArray:
        return self.bend.jacobian(directions * self._axes) * self._axes


@dataclass(frozen=True)
class LobedBody:
    """A sphere with one rounded lobe: radius R (1 + A exp(k (cos t - 1))) at the angle t from the lobe's axis.

    An atrium with its appendage. Star-shaped; its volume is closed form, the integral of radius^3 / 3 over the sphere.

    Attributes
    ----------
    radius : float
        Of the sphere, mm.
    height : float
        Of the lobe, as a fraction A of the radius.
    sharpness : float
        k: the lobe's half-width is about 1 / sqrt(k) rad.
    axis : tuple of 3 floats
        Direction of the lobe.
    """

    radius: float
    height: float
    sharpness: float
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        if not (self.radius > 0.0 and self.height > -1.0 and self.sharpness > 0.0):
            raise OptionError(
                f"radius {self.radius}, height {self.height}, sharpness {self.sharpness}: expected radius and "
                "sharpness above 0 and height above -1"
            )
        if not np.linalg.norm(self.axis) > 0.0:
            raise OptionError(f"axis {self.axis} has no direction")

    def inside(self, points: FloatArray) -> BoolArray:
        """Whether points lie in the solid."""
        points = np.atleast_2d(np.asarray(points, dtype=np.float64))
        distance = np.linalg.norm(points, axis=1)
        return np.asarray(distance <= self._radius(points / np.maximum(distance, 1e-300)[:, None]))

    def surface(self, directions: FloatArray) -> FloatArray:
        """Points of the surface."""
        d = np.atleast_2d(np.asarray(directions, dtype=np.float64))
        return np.asarray(self._radius(d)[:, None] * d)

    smooth_surface = surface

    def distance(self, points: FloatArray) -> FloatArray:
        """Signed distance from the surface."""
        points = np.atleast_2d(np.asarray(points, dtype=np.float64))
        nearest = self.surface(closest_directions(self.surface, self._derivative, points))
        return np.asarray(np.where(self.inside(points), -1.0, 1.0) * np.linalg.norm(points - nearest, axis=1))

    def volume(self, low: float = -inf, high: float = inf) -> float:
        """Whole volume: R^3/3 times the sum over n of binom(3, n) A^n 2 pi (1 - exp(-2 n k)) / (n k)."""
        if low > -inf or high < inf:
            raise OptionError("the volume of a lobed body between two heights has no closed form")
        total = 4.0 * pi
        for n in (1, 2, 3):
            k = n * self.sharpness
            total += comb(3, n) * self.height**n * 2.0 * pi * (1.0 - exp(-2.0 * k)) / k
        return self.radius**3 / 3.0 * total

    @property
    def _axis(self) -> FloatArray:
        axis = np.asarray(self.axis, dtype=np.float64)
        return np.asarray(axis / np.linalg.norm(axis))

    def _radius(self, directions: FloatArray) -> FloatArray:
        lobe = self.height * np.exp(self.sharpness * (directions @ self._axis - 1.0))
        return np.asarray(self.radius * (1.0 + lobe))

    def _derivative(self, directions: FloatArray) -> FloatArray:
        lobe = self.radius * self.height * np.exp(self.sharpness * (directions @ self._axis - 1.0))
        slope = (self.sharpness * lobe)[:, None] * self._axis
        return np.asarray(
            self._radius(directions)[:, None, None] * np.eye(3) + directions[:, :, None] * slope[:, None, :]
        )
