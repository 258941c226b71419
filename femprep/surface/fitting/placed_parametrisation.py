"""A template placed on a smooth surface in, a map from the sphere onto that surface out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from femprep.mesh.patches import PatchSurface
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FloatArray, IntArray
from femprep.model.products import product, unit_vectors


@dataclass(frozen=True, eq=False)
class PlacedShape:
    """A smooth surface as a map from the unit sphere: linear within a placed template's triangles, then projected.

    Calling it with unit vectors ``(n, 3)`` gives points ``(n, 3)`` mm LPS. It can be pickled.

    Attributes
    ----------
    surface : PatchSurface
        The smooth surface, in coordinates of its own.
    directions : (V, 3) array
        The template's vertices, unit vectors.
    cells : (T, 3) array
        Its triangles.
    places : (V, 3) array
        Where its vertices lie on the surface, in the surface's coordinates, mm.
    axes : (3, 3) array
        Orthogonal columns: the axes of those coordinates in the world.
    centre : (3,) array
        Their origin, mm LPS.
    """

    surface: PatchSurface
    directions: FloatArray
    cells: IntArray
    places: FloatArray
    axes: FloatArray
    centre: FloatArray

    def __call__(self, directions: npt.ArrayLike) -> FloatArray:
        """Points of the surface, ``(n, 3)`` mm LPS, for unit vectors ``(n, 3)``."""
        found = self._finder(unit_vectors(np.asarray(directions, dtype=np.float64).reshape(-1, 3)))
        return self.to_world(self.surface.project(found.at(self.places))[0] + found.at(self._off))

    @cached_property
    def _off(self) -> FloatArray:
        """From the projection of each vertex to the vertex: nothing but where the surface bends sharply."""
        return np.asarray(self.places - self.surface.project(self.places)[0])

    @cached_property
    def _finder(self) -> ClosestFinder:
        return ClosestFinder(self.directions, self.cells)

    def to_world(self, places: npt.ArrayLike) -> FloatArray:
        """World points ``(n, 3)`` mm LPS of places in the surface's coordinates."""
        return np.asarray(self.centre + product(places, self.axes.T))

    def to_local(self, points: npt.ArrayLike) -> FloatArray:
        """Places in the surface's coordinates of world points ``(n, 3)`` mm LPS."""
        return product(np.asarray(points, dtype=np.float64) - self.centre, self.axes)

    def height(self, points: npt.ArrayLike) -> FloatArray:
        """How far inside the surface world points ``(n, 3)`` near it lie, ``(n,)`` mm."""
        local = self.to_local(points)
        feet, normals = self.surface.project(local)
        return np.asarray(np.einsum("ij,ij->i", feet - local, normals), dtype=np.float64)
