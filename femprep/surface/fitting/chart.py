"""A smooth closed surface in, a map of it to the sphere with little distortion out, both ways."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.mesh.measures.triangles import areas, vertex_sums
from femprep.mesh.polygons import decimated_to
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FloatArray, IntArray
from femprep.model.products import nearest_orthogonal, product, unit_vectors, weighted
from femprep.surface.fitting.parametrisation import sphere_map
from femprep.surface.fitting.slide import Goal

#: Vertices of the coarse mesh from which the map to the sphere is made.
_COARSE: Final = 1000


@dataclass(frozen=True, eq=False)
class Chart:
    """A coarse mesh of a surface with the place of each vertex on the sphere: a map both ways, rough but not folded.

    Attributes
    ----------
    points : (n, 3) array
        mm.
    cells : (m, 3) array
        Triangles.
    sphere : (n, 3) array
        Unit vectors.
    """

    points: FloatArray
    cells: IntArray
    sphere: FloatArray

    @classmethod
    def of(cls, goal: Goal, directions: FloatArray, start: FloatArray | None = None) -> Chart:
        """The chart with little distortion of angles and areas, turned so that ``start``, mm, lies at ``directions``.

        By default each of its vertices should lie in its direction as seen from the surface's middle.
        """
        points, cells = decimated_to(goal.surface.points, goal.surface.triangles, _COARSE)
        density = goal.density[goal.surface.nearest(points)]
        sphere = sphere_map(points, cells, density)
        weight = areas(points, cells) * density[cells].mean(axis=1)
        return cls(points, cells, product(sphere, turn(sphere, _wanted(points, directions, start), weight, cells).T))

    def points_at(self, directions: FloatArray) -> FloatArray:
        """Points ``(q, 3)`` of the mesh for unit vectors ``(q, 3)``."""
        return _carry(directions, self.sphere, self.points, self.cells)

    def directions_at(self, points: FloatArray) -> FloatArray:
        """Places ``(q, 3)`` on the sphere, about unit vectors, for points ``(q, 3)`` near the mesh."""
        return _carry(points, self.points, self.sphere, self.cells)


def sphere_turned(points: FloatArray, cells: IntArray, directions: FloatArray) -> FloatArray:
    """Places ``(n, 3)`` of a closed mesh on the sphere, turned so that each lies in its direction from the middle."""
    sphere = sphere_map(points, cells)
    return product(sphere, turn(sphere, _wanted(points, directions, None), areas(points, cells), cells).T)


def _wanted(points: FloatArray, directions: FloatArray, start: FloatArray | None) -> FloatArray:
    """Unit vectors at which points of the surface should lie on the sphere, roughly."""
    if start is None:
        return unit_vectors(points - points.mean(axis=0))
    from scipy.spatial import cKDTree

    return np.asarray(directions[cKDTree(start).query(points)[1]])


def turn(sphere: FloatArray, wanted: FloatArray, weight: FloatArray, cells: IntArray) -> FloatArray:
    """The rotation ``(3, 3)`` after which vectors agree best with those wanted."""
    share = vertex_sums(weight, cells, len(sphere))
    alike = weighted(wanted, share[:, None] * sphere)
    found = nearest_orthogonal(alike)
    if found is not None and np.linalg.det(found) > 0.0:
        return found
    left, _, right = np.linalg.svd(alike)
    flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return np.asarray(left @ flip @ right)


def _carry(queries: FloatArray, one: FloatArray, other: FloatArray, cells: IntArray) -> FloatArray:
    """Points near a mesh carried to the same mesh with its vertices elsewhere: linear within its triangles."""
    return ClosestFinder(one, cells)(queries).at(other)
