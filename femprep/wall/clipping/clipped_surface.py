"""An open piece of a surface whose rim lies in planes, and how its vertices slide along the smooth surface.

Working data of this folder: made by ``clip``, changed in place by ``improve`` and ``thickness``, joined in ``joining``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from femprep.model import BoolArray, FloatArray, IntArray, Plane, SphereMap
from femprep.model.products import product, unit_vectors
from femprep.wall.clipping.sampled import SampledMap

#: Least quality Q of a wall's triangles.
LEAST_QUALITY = 0.2
#: Newton steps of the way to a plane, how near it may end on the smooth surface (the rest is projected), and the least
#: sine of the angle between plane and surface, mm.
_STEPS, _NEAR, _STEEP = 10, 1e-4, 0.05


@dataclass
class ClippedSurface:
    """An open piece of a surface.

    Attributes
    ----------
    name : str
        Name of the surface.
    points, directions : (n, 3) array
        Vertices, mm, and where they lie on the template sphere.
    triangles : (m, 3) array
        Wound as on the surface: outward.
    template : (n,) array
        Vertex number on the surface, -1 for a vertex the cut made.
    on_plane : (n,) array
        Number of the plane a rim vertex lies in, -1 off the rim.
    smooth : SampledMap
        The surface between its vertices.
    planes : mapping of str to Plane
        The planes it is clipped by, by facet name.
    """

    name: str
    points: FloatArray
    directions: FloatArray
    triangles: IntArray
    template: IntArray
    on_plane: IntArray
    smooth: SampledMap
    planes: dict[str, Plane]

    def plane_of(self, number: int) -> Plane:
        """The plane rim vertices of that number lie in."""
        return list(self.planes.values())[number]

    def add(self, points: FloatArray, directions: FloatArray, number: int) -> None:
        """Add vertices ``(k, 3)`` that lie in the plane of that number, and are none of the template's."""
        self.points = np.concatenate([self.points, points])
        self.directions = np.concatenate([self.directions, directions])
        self.template = np.concatenate([self.template, np.full(len(points), -1)])
        self.on_plane = np.concatenate([self.on_plane, np.full(len(points), number)])

    def slide(self, which: IntArray, displacement: FloatArray) -> None:
        """Move vertices by vectors ``(k, 3)`` mm along the smooth surface; rim vertices stay in their plane."""
        directions = self.smooth.step(self.directions[which], displacement)
        points = self.smooth(directions)
        for number in range(len(self.planes)):
            rim = np.flatnonzero(self.on_plane[which] == number)
            if len(rim):
                found, points[rim], directions[rim] = reach(self.smooth, self.plane_of(number), directions[rim])
                lost = rim[~found]
                points[lost], directions[lost] = self.points[which[lost]], self.directions[which[lost]]
        self.points[which], self.directions[which] = points, directions


def reach(
    smooth: SampledMap, plane: Plane, directions: FloatArray, exact: SphereMap | None = None
) -> tuple[BoolArray, FloatArray, FloatArray]:
    """Slide points along a surface, the shortest way, to where it meets a plane.

    Parameters
    ----------
    smooth : SampledMap
        The surface; its tangents lead the way.
    plane : Plane
    directions : (n, 3) array
        Where the points start.
    exact : SphereMap, optional
        The surface itself, where the samples' accuracy is not enough.

    Returns
    -------
    found : (n,) array
        False where the surface runs along the plane instead.
    points, directions : (n, 3) array
        Where they arrive; the points lie in the plane.
    """
    at = smooth if exact is None else exact
    directions = directions.copy()
    points = at(directions)
    for _ in range(_STEPS):
        away = plane.signed_distance(points)
        active = np.flatnonzero(np.abs(away) >= _NEAR)
        if not len(active):
            break
        tangent = smooth.tangents(directions[active])
        normal = unit_vectors(np.cross(tangent[:, 0], tangent[:, 1]))
        # The steepest way to the plane along the surface is the part of the plane's normal that is tangent to it.
        steepest = plane.normal - product(normal, plane.normal)[:, None] * normal
        square = np.maximum((steepest**2).sum(axis=1), _STEEP**2)
        directions[active] = smooth.step(directions[active], -(away[active] / square)[:, None] * steepest)
        points[active] = at(directions[active])
    return np.abs(plane.signed_distance(points)) < _NEAR, plane.feet(points), directions
