"""Maps that bend a body and keep its volume: straight coordinates in, bent ones out, and back.

A body symmetric about the plane x = 0 keeps its volume when its axis s is bent into a circular arc of radius R in the
x-s plane: the map has the Jacobian determinant (R + x) / R, whose x-part averages out (Pappus' theorem). A shear along
x by any function of z has determinant one. So the closed-form volume of an ellipsoid, also between planes z = const,
stays that of the bent body.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femprep.errors import OptionError
from femprep.model import FloatArray


@dataclass(frozen=True)
class Bend:
    """Bend one axis of a body into an arc about the axis ``x = -radius``, then shear it along x by a function of z.

    Attributes
    ----------
    along : int
        Which axis becomes the arc: 2 bends the long axis (a banana), 1 bends across it (a crescent in short-axis
        slices).
    radius : float
        Radius of the arc, mm; infinite leaves the body straight.
    shear : tuple of float
        Coefficients of z^2, z^4, z^6... (mm^-1, mm^-3, mm^-5...) of the shift along x. With ``along=1`` only.
    """

    along: int = 2
    radius: float = np.inf
    shear: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if self.along not in (1, 2):
            raise OptionError(f"along is {self.along}, expected 1 or 2")
        if not self.radius > 0.0:
            raise OptionError(f"bend radius is {self.radius} mm, expected a positive number")
        if self.shear and self.along != 1:
            raise OptionError("a shear needs along=1: with the long axis bent, planes z = const are not kept")

    def require_injective(self, semi_axes: FloatArray) -> None:
        """Refuse a body whose inner side would fold over or whose ends would meet."""
        if not semi_axes[0] < self.radius:
            raise OptionError(
                f"bend radius {self.radius} mm is not larger than the semi-axis {semi_axes[0]} mm across it"
            )
        if not semi_axes[self.along] < np.pi * self.radius:
            raise OptionError(f"semi-axis {semi_axes[self.along]} mm is too long for a bend radius of {self.radius} mm")

    def forward(self, q: FloatArray) -> FloatArray:
        """Bent points ``(n, 3)`` of straight ones ``(n, 3)``."""
        out = np.array(q, dtype=np.float64)
        if np.isfinite(self.radius):
            angle = q[:, self.along] / self.radius
            # (R + x) cos(t) - R, without losing digits where R is large.
            out[:, 0] = q[:, 0] * np.cos(angle) - 2.0 * self.radius * np.sin(0.5 * angle) ** 2
            out[:, self.along] = (self.radius + q[:, 0]) * np.sin(angle)
        out[:, 0] += self._shift(q[:, 2])
        return out

    def backward(self, points: FloatArray) -> FloatArray:
        """Straight points ``(n, 3)`` of bent ones ``(n, 3)``."""
        out = np.array(points, dtype=np.float64)
        if self.along == 1:
            out[:, 0] -= self._shift(out[:, 2])
        if np.isfinite(self.radius):
            x, s = out[:, 0] + self.radius, out[:, self.along].copy()
            # hypot(R + x, s) - R, without losing digits where R is large.
            out[:, 0] = (out[:, 0] * (x + self.radius) + s * s) / (np.hypot(x, s) + self.radius)
            out[:, self.along] = self.radius * np.arctan2(s, x)
        return out

    def jacobian(self, q: FloatArray) -> FloatArray:
        """Derivative ``(n, 3, 3)`` of :meth:`forward` at straight points; ``[..., i, j]`` is d out_i / d q_j."""
        out = np.zeros((len(q), 3, 3))
        out[:, [0, 1, 2], [0, 1, 2]] = 1.0
        a = self.along
        if np.isfinite(self.radius):
            angle = q[:, a] / self.radius
            stretch = 1.0 + q[:, 0] / self.radius
            out[:, 0, 0], out[:, 0, a] = np.cos(angle), -stretch * np.sin(angle)
            out[:, a, 0], out[:, a, a] = np.sin(angle), stretch * np.cos(angle)
        for power, c in enumerate(self.shear, start=1):
            out[:, 0, 2] += c * 2 * power * q[:, 2] ** (2 * power - 1)
        return out

    def _shift(self, z: FloatArray) -> FloatArray:
        shift = np.zeros_like(z)
        for power, c in enumerate(self.shear, start=1):
            shift += c * z ** (2 * power)
        return shift


#: Leaves a body as it is.
STRAIGHT = Bend()
