"""Tagged facets and the wall in, per point: where on the wall it belongs, and in which directions it may move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from femprep.geometry.closest import ClosestFinder
from femprep.geometry.topology import edge_table
from femprep.geometry.triangles import normals
from femprep.model import FACET_TAGS, Plane, Wall

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
TagArray = npt.NDArray[np.int32]


@dataclass(frozen=True)
class Constraints:
    """What holds the points of a mesh to the wall.

    Attributes
    ----------
    freedom : (n,) array
        In how many directions a point may move: 3 inside, 2 on a surface or plane, 1 on the edge between two tags,
        0 where more of them meet.
    basis : (n, 3, 3) array
        The directions, as rows; the first ``freedom`` of them count.
    planes : mapping of str to Plane
        Planes of the wall.
    plane_points : mapping of str to array
        Numbers of the points that lie in each.
    groups : tuple of (array, ClosestFinder)
        Numbers of the points of each surface or edge, and that surface or edge.
    """

    freedom: npt.NDArray[np.int64]
    basis: FloatArray
    planes: Mapping[str, Plane]
    plane_points: Mapping[str, IntArray]
    groups: tuple[tuple[IntArray, ClosestFinder], ...]

    def targets(self, points: FloatArray) -> tuple[IntArray, FloatArray]:
        """Numbers of all held points, and the closest point for each of the surface, edge or plane it belongs to."""
        places = points.copy()
        for nodes, finder in self.groups:
            places[nodes] = finder(points[nodes]).points
        self.flatten(places)
        held = np.unique(np.concatenate([*(nodes for nodes, _ in self.groups), *self.plane_points.values()]))
        return held, places[held]

    def flatten(self, points: FloatArray) -> None:
        """Project the points of each plane onto it, in place; twice, so that the rounding of the first step is gone."""
        for name, plane in self.planes.items():
            nodes = self.plane_points[name]
            for _ in range(2):
                points[nodes] -= plane.signed_distance(points[nodes])[:, None] * plane.normal


def constrain(points: FloatArray, facets: IntArray, tag: TagArray, wall: Wall) -> Constraints:
    """Find what each boundary point is held to.

    Parameters
    ----------
    points : (n, 3) array
        mm.
    facets : (f, 3) array
        Boundary facets.
    tag : (f,) array
        Their tags.
    wall : Wall
        The wall they lie on.
    """
    tags = np.unique(tag)
    member = np.zeros((len(points), len(tags)), dtype=bool)
    for column, value in enumerate(tags):
        member[np.unique(facets[tag == value]), column] = True
    number = member.sum(axis=1)
    plane_points = {name: np.flatnonzero(member[:, tags == FACET_TAGS[name]].any(axis=1)) for name in wall.planes}
    groups: list[tuple[IntArray, ClosestFinder]] = []
    freedom = np.full(len(points), 3, dtype=np.int64)
    freedom[number == 1], freedom[number == 2], freedom[number > 2] = 2, 1, 0
    basis = np.tile(np.eye(3), (len(points), 1, 1))
    sides = _edges_between_tags(wall)
    for key in np.unique(member[(number == 1) | (number == 2)], axis=0):
        nodes = np.flatnonzero((member == key).all(axis=1))
        names = tuple(int(t) for t in tags[key])
        if len(names) == 1:
            triangles = wall.triangles[wall.facet_tag == names[0]]
            finder = ClosestFinder(wall.points, triangles)
            there = finder(points[nodes]).triangle
            basis[nodes, :2] = _tangents(normals(wall.points, triangles)[there])
        elif names in sides:
            edges = sides[names]
            # An edge is a triangle without area: the closest point of one is that of the other.
            finder = ClosestFinder(wall.points, edges[:, [0, 1, 1]])
            along = wall.points[edges[:, 1]] - wall.points[edges[:, 0]]
            basis[nodes, 0] = (along / np.linalg.norm(along, axis=1, keepdims=True))[finder(points[nodes]).triangle]
        else:  # two surfaces that do not meet on the wall
            freedom[nodes] = 0
            continue
        groups.append((nodes, finder))
    for name, plane in wall.planes.items():
        _flatten(basis, freedom, plane_points[name], plane)
    return Constraints(freedom, basis, wall.planes, plane_points, tuple(groups))


def _flatten(basis: FloatArray, freedom: IntArray, nodes: IntArray, plane: Plane) -> None:
    """Take the plane's normal out of the directions of its points."""
    inner = nodes[freedom[nodes] == 2]
    basis[inner, :2] = _tangents(plane.normal[None, :])
    rim = nodes[freedom[nodes] == 1]
    along = basis[rim, 0] - (basis[rim, 0] @ plane.normal)[:, None] * plane.normal
    basis[rim, 0] = along / np.linalg.norm(along, axis=1, keepdims=True)


def _tangents(normal: FloatArray) -> FloatArray:
    """Two unit vectors at right angles to each normal and to each other, ``(m, 2, 3)``."""
    least = np.eye(3)[np.argmin(np.abs(normal), axis=1)]
    first = np.cross(normal, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=1)


def _edges_between_tags(wall: Wall) -> dict[tuple[int, int], IntArray]:
    """Edges of the wall at which two tags meet, by the pair of tags, smaller first."""
    table = edge_table(wall.triangles)
    pair = np.sort(wall.facet_tag[table.cells], axis=1)
    between = pair[:, 0] != pair[:, 1]
    keys, row = np.unique(pair[between], axis=0, return_inverse=True)
    nodes = table.nodes[between]
    return {(int(a), int(b)): nodes[row.ravel() == k] for k, (a, b) in enumerate(keys)}
