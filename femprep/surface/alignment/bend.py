"""Slices in, the waves along the stack out by which a heart may bend: what a slow change of shifts looks like."""

from __future__ import annotations

from typing import Final, NamedTuple, Self

import numpy as np

from femprep.model import FloatArray
from femprep.surface.alignment.planes import ImagePlane

#: Standard deviation of a wave 100 mm long, mm; of others it grows with the square of their length, as of a course
#: whose curvature is random. Shorter waves than this, mm, are left to the surfaces.
_WAVE: Final = 2.0
_SHORTEST: Final = 40.0


class HeartBend(NamedTuple):
    """Displacements in the planes of the slices that all surfaces share and that are smooth along the stack.

    Without them surfaces that are as smooth as the labels allow straighten a heart. With them the slow part of the
    shifts, which the stack cannot tell from a bend of the heart, is determined by views and priors alone.

    Attributes
    ----------
    axis : int
        Across the slices.
    start, length : float
        First slice and length of the stack along it, mm.
    precision : (2 n,) array
        Inverse prior variances of n waves in each direction.
    """

    axis: int
    start: float
    length: float
    precision: FloatArray

    @classmethod
    def of(cls, planes: list[ImagePlane]) -> Self:
        """The waves of a stack: cosines whose half-lengths fit into it."""
        slices = [plane for plane in planes if not plane.view]
        axis = int(np.abs(slices[0].frame[:, 2]).argmax())
        place = [float(plane.origin[axis]) for plane in slices]
        length = max(max(place) - min(place), 1.0)
        wave = 2.0 * length / np.arange(1, int(2.0 * length / _SHORTEST) + 1)
        return cls(axis, min(place), length, np.tile((_WAVE * (wave / 100.0) ** 2) ** -2.0, 2))

    def heights(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Change ``(k, 2 n)`` of the heights of points over surfaces with these normals, per unit of each wave."""
        waves = self._waves(points)
        return -np.concatenate([along[:, None] * waves for along in np.delete(normals, self.axis, axis=1).T], axis=1)

    def moved(self, points: FloatArray, sizes: FloatArray) -> FloatArray:
        """Points ``(k, 3)`` moved by waves of these sizes."""
        flat = self._waves(points) @ sizes.reshape(2, -1).T
        return points + np.insert(flat, self.axis, 0.0, axis=1)

    def _waves(self, points: FloatArray) -> FloatArray:
        along = np.clip((points[:, self.axis] - self.start) / self.length, 0.0, 1.0)
        return np.asarray(np.cos(np.pi * along[:, None] * np.arange(1, len(self.precision) // 2 + 1)))
