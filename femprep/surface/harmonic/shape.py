"""A field and a stopping function in, a smooth closed surface out: the map from the sphere, both ways (2.5, 2.7)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from femprep.model import FloatArray
from femprep.model.products import unit_vectors
from femprep.surface.harmonic.field import Field
from femprep.surface.harmonic.spline import Spline


@dataclass(frozen=True, eq=False)
class HarmonicShape:
    """The fitted surface as a map from the unit sphere: flow from u = 0 to the stopping value of each direction.

    Calling it with unit vectors ``(n, 3)`` gives points ``(n, 3)`` mm. It can be pickled.

    Attributes
    ----------
    field : Field
        The harmonic field.
    stopping : Spline
        The stopping function b.
    lowest, highest : float
        b is kept within these: far below the boundary's values a surface would leave the object, far above it would
        run into a singularity.
    steps : int
        Runge-Kutta steps of a flow line.
    """

    field: Field
    stopping: Spline
    lowest: float
    highest: float
    steps: int

    def levels(self, directions: npt.ArrayLike) -> FloatArray:
        """Value of u ``(n,)`` at which the flow from each direction stops."""
        return np.clip(self.stopping(self._unit(directions)), self.lowest, self.highest)

    def __call__(self, directions: npt.ArrayLike) -> FloatArray:
        """Points of the surface, ``(n, 3)`` mm LPS, for unit vectors ``(n, 3)``."""
        return self.at(directions, self.levels(directions))

    def at(self, directions: npt.ArrayLike, levels: npt.ArrayLike) -> FloatArray:
        """Points ``(n, 3)`` mm at given levels of u on the flow lines of directions ``(n, 3)``."""
        # One Newton step along the line takes the rest of the error across the level away.
        return self.field.flow(self.field.on_sphere(directions), 0.0, levels, self.steps, settle=1)

    def directions_of(self, points: npt.ArrayLike) -> FloatArray:
        """Unit vectors ``(n, 3)`` of the flow lines through points ``(n, 3)`` mm inside the sphere: the inverse map."""
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        return self.field.directions(self.field.flow(points, self.field.potential(points), 0.0, self.steps))

    def height(self, points: npt.ArrayLike) -> FloatArray:
        """How far inside the surface points ``(n, 3)`` lie along their flow line: (u - b) / |grad u| ``(n,)``, mm."""
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        over = self.field.potential(points) - self.levels(self.directions_of(points))
        return np.asarray(over / np.linalg.norm(self.field.gradient(points), axis=1), dtype=np.float64)

    @staticmethod
    def _unit(directions: npt.ArrayLike) -> FloatArray:
        return unit_vectors(np.asarray(directions, dtype=np.float64).reshape(-1, 3))
