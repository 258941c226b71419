"""Tagged facets and the wall in, per point: where on the wall it belongs, and in which directions it may move."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from femprep.mesh.measures.triangles import normals
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.tangents import tangents
from femprep.mesh.topology import edge_table
from femprep.model import FACET_TAGS, BoolArray, FloatArray, IntArray, Plane, TagArray, Wall
from femprep.model.products import unit_vectors


class Group(Protocol):
    """Points that belong to one surface, or to one edge between two surfaces."""

    @property
    def nodes(self) -> IntArray:
        """Their numbers, ``(k,)``."""

    def closest(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where points ``(q, 3)`` of the group belong, and the surface's unit normal or the edge's direction there."""


@dataclass(frozen=True)
class FacetGroup:
    """A group of a surface of triangles.

    Attributes
    ----------
    nodes : (k,) array
        Their numbers.
    finder : ClosestFinder
        The surface; an edge is made of triangles without area.
    direction : (t, 3) array
        Unit normal of each triangle of the surface, unit vector along each segment of the edge.
    """

    nodes: IntArray
    finder: ClosestFinder
    direction: FloatArray

    def closest(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """As :meth:`Group.closest`."""
        found = self.finder(points)
        return found.points, self.direction[found.triangle]


@dataclass(frozen=True)
class Constraints:
    """What holds the points of a mesh to the wall.

    Attributes
    ----------
    freedom : (n,) array
        In how many directions a point may move: 3 inside, 2 on a surface or plane, 1 on the edge between two tags,
        0 where more of them meet.
    planes : mapping of str to Plane
        Planes of the wall.
    plane_points : mapping of str to array
        Numbers of the points that lie in each.
    groups : tuple of Group
        The boundary points by where they belong.
    """

    freedom: npt.NDArray[np.int64]
    planes: Mapping[str, Plane]
    plane_points: Mapping[str, IntArray]
    groups: tuple[Group, ...]

    def targets(self, points: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Where the boundary points belong, and where all points may go.

        Parameters
        ----------
        points : (n, 3) array
            Points as they are, mm.

        Returns
        -------
        nodes : (h,) array
            Numbers of all held points.
        places : (n, 3) array
            The closest point for each of those, of the surface, edge or plane it belongs to, mm; the others as given.
        basis : (n, 3, 3) array
            Unit directions each point may move in, as rows; the first ``freedom`` of them count.
        """
        places = points.copy()
        basis = np.tile(np.eye(3), (len(points), 1, 1))
        self.renew(points, np.ones(len(points), dtype=np.bool_), places, basis)
        none = np.empty(0, dtype=np.int64)  # nothing may be held
        held = np.unique(np.concatenate([none, *(group.nodes for group in self.groups), *self.plane_points.values()]))
        return held, places, basis

    def renew(self, points: FloatArray, moved: BoolArray, places: FloatArray, basis: FloatArray) -> None:
        """Write places and directions anew, in place, of the boundary points that moved.

        Parameters
        ----------
        points : (n, 3) array
            Points as they are, mm.
        moved : (n,) array
            Which points to look at.
        places : (n, 3) array
        basis : (n, 3, 3) array
            As from :meth:`targets`.
        """
        places[moved] = points[moved]
        for group in self.groups:
            nodes = group.nodes[moved[group.nodes]]
            if len(nodes) == 0:
                continue
            places[nodes], direction = group.closest(points[nodes])
            if self.freedom[nodes[0]] == 2:
                basis[nodes, :2] = tangents(direction)
            else:
                basis[nodes, 0] = direction
        self.flatten(places, moved)
        for name, plane in self.planes.items():
            nodes = self.plane_points[name]
            _flatten(basis, self.freedom, nodes[moved[nodes]], plane)

    def flatten(self, points: FloatArray, chosen: BoolArray | None = None) -> None:
        """Put the points of each plane onto it, in place.

        Parameters
        ----------
        points : (n, 3) array
        chosen : (n,) array, optional
            Which of them; all where not given.
        """
        for name, plane in self.planes.items():
            nodes = self.plane_points[name]
            flatten(points, nodes if chosen is None else nodes[chosen[nodes]], plane)


def flatten(points: FloatArray, nodes: IntArray, plane: Plane) -> None:
    """Put some points onto a plane, in place; twice, so that the rounding of the first step is gone."""
    for _ in range(2):
        points[nodes] = plane.feet(points[nodes])


def constrain(count: int, facets: IntArray, tag: TagArray, wall: Wall) -> Constraints:
    """Find what each boundary point is held to.

    Parameters
    ----------
    count : int
        Number of points.
    facets : (f, 3) array
        Boundary facets.
    tag : (f,) array
        Their tags.
    wall : Wall
        The wall they lie on.
    """
    tags = np.unique(tag)
    member = np.zeros((count, len(tags)), dtype=bool)
    for column, value in enumerate(tags):
        member[np.unique(facets[tag == value]), column] = True
    number = member.sum(axis=1)
    plane_points = {name: np.flatnonzero(member[:, tags == FACET_TAGS[name]].any(axis=1)) for name in wall.planes}
    freedom = np.array([3, 2, 1, 0])[np.minimum(number, 3)]
    groups: list[Group] = []
    sides = _edges_between_tags(wall)
    for key in np.unique(member[(number == 1) | (number == 2)], axis=0):
        nodes = np.flatnonzero((member == key).all(axis=1))
        names = tuple(int(t) for t in tags[key])
        if len(names) == 1:
            triangles = wall.triangles[wall.facet_tag == names[0]]
            groups.append(FacetGroup(nodes, ClosestFinder(wall.points, triangles), normals(wall.points, triangles)))
        elif names in sides:
            edges = sides[names]
            along = unit_vectors(wall.points[edges[:, 1]] - wall.points[edges[:, 0]])
            # An edge is a triangle without area: the closest point of one is that of the other.
            groups.append(FacetGroup(nodes, ClosestFinder(wall.points, edges[:, [0, 1, 1]]), along))
        else:  # two surfaces that do not meet on the wall
            freedom[nodes] = 0
    return Constraints(freedom, wall.planes, plane_points, tuple(groups))


def _flatten(basis: FloatArray, freedom: IntArray, nodes: IntArray, plane: Plane) -> None:
    """Take the plane's normal out of the directions of its points."""
    inner = nodes[freedom[nodes] == 2]
    basis[inner, :2] = tangents(plane.normal[None, :])
    rim = nodes[freedom[nodes] == 1]
    along = basis[rim, 0] - (basis[rim, 0] @ plane.normal)[:, None] * plane.normal
    basis[rim, 0] = unit_vectors(along)


def _edges_between_tags(wall: Wall) -> dict[tuple[int, int], IntArray]:
    """Edges of the wall at which two tags meet, by the pair of tags, smaller first."""
    table = edge_table(wall.triangles)
    tag = np.repeat(wall.facet_tag, wall.triangles.shape[1])
    # Three triangles meet at a rim where blood is filled in: base, cap and endocardium, the first two of one tag.
    least, most = (np.full(len(table.count), start, dtype=np.int64) for start in (np.iinfo(np.int32).max, -1))
    np.minimum.at(least, table.of_cell.ravel(), tag)
    np.maximum.at(most, table.of_cell.ravel(), tag)
    between = least != most
    pair, nodes = np.stack([least, most], axis=1)[between], table.nodes[between]
    keys, row = np.unique(pair, axis=0, return_inverse=True)
    return {(int(a), int(b)): nodes[row.ravel() == k] for k, (a, b) in enumerate(keys)}
