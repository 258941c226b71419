"""Tetrahedra in a wall in, ten-node tetrahedra out whose boundary lies on the smooth surfaces the wall was made of.

The wall's triangles are flat, the surfaces they were fitted to are not. Each endo- or epicardial sheet becomes a
smooth surface through its vertices; corners on the sheet move onto it, by little, and the middles of its edges lie on
it. Rims stay in their planes, planes flat, creases where two sheets meet straight.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np

from femprep.mesh.patches import PatchSurface
from femprep.mesh.quadratic import add_middles, number_edges
from femprep.model import FACET_TAGS, FloatArray, IntArray, Notice, VolumeMesh, Wall, noted, tag_name
from femprep.volume.optimise import LEAST, tet_quality

#: Sheets whose names begin with these are smooth.
_SMOOTH: Final = ("endo", "epi")


def quadratic_tetrahedra(mesh: VolumeMesh, wall: Wall) -> VolumeMesh:
    """Make the tetrahedra of a wall quadratic.

    Parameters
    ----------
    mesh : VolumeMesh
        One block ``"tetra"`` with tagged triangles, whatever their tags.
    wall : Wall
        What it fills.

    Returns
    -------
    VolumeMesh
        One block ``"tetra10"``. ``info["quadratic"]`` tells how far corners moved and how many edges are curved and
        how many were made straight because an element would be inverted.

    Raises
    ------
    StageError
        An element is inverted also when straight.
    """
    sheets = _Sheets(mesh, wall)
    points = np.array(mesh.points)
    moved = _without_spoiling(points, sheets.onto(points, sheets.member), mesh.cells["tetra"])
    linear = replace(mesh, points=moved)
    edges = number_edges(linear)
    middle = 0.5 * (moved[edges.ends[:, 0]] + moved[edges.ends[:, 1]])
    member = np.zeros((len(edges.ends), len(sheets.tags)), dtype=bool)
    for column, nodes in enumerate(sheets.facets):
        member[edges.find(nodes, np.roll(nodes, -1, axis=1)), column] = True
    curved = sheets.onto(middle, member)
    result, straight = add_middles(linear, edges, curved)
    bent = np.linalg.norm(curved - middle, axis=1) > 0.0
    record: dict[str, Any] = {
        "corners_moved_mm": float(np.linalg.norm(moved - mesh.points, axis=1).max()),
        "curved_edges": int(bent.sum()) - len(straight),
        "straightened_edges": len(straight),
    }
    info = {**mesh.info, "quadratic": record}
    if len(straight):
        words = (
            f"{{amount}} of {int(bent.sum())} curved ones of quadratic elements were made straight, so that no element "
            "is inverted or poor"
        )
        info = noted(info, Notice.of("repaired", words, amount=len(straight), unit="edges"))
    return replace(result, info=info)


class _Sheets:
    """The tags of a mesh, their facets, and the smooth surfaces of those that have one."""

    def __init__(self, mesh: VolumeMesh, wall: Wall) -> None:
        self.tags = [int(t) for t in np.unique(mesh.facet_tag)]
        self.facets = [mesh.facets["triangle"][mesh.facet_tag == tag] for tag in self.tags]
        self.member = np.zeros((len(mesh.points), len(self.tags)), dtype=bool)
        for column, nodes in enumerate(self.facets):
            self.member[nodes.ravel(), column] = True
        planes = list(wall.planes)
        self._planes = np.array([[*wall.planes[name].normal, wall.planes[name].offset] for name in planes])
        numbers = {FACET_TAGS[name]: number for number, name in enumerate(planes, 1)}
        # A cap lies in one of these planes too.
        for name, plane in mesh.planes.items():
            same = [other for other in planes if wall.planes[other] is plane]
            if same:
                numbers.setdefault(FACET_TAGS[name], numbers[FACET_TAGS[same[0]]])
        #: Number of the plane each tag lies in, from 1; 0 for others.
        self._plane = np.array([numbers.get(tag, 0) for tag in self.tags])
        self._surface = {}
        for column, tag in enumerate(self.tags):
            triangles = wall.triangles[wall.facet_tag == tag]
            if self._plane[column] == 0 and tag_name(tag).startswith(_SMOOTH) and len(triangles):
                used, cells = np.unique(triangles, return_inverse=True)
                self._surface[column] = PatchSurface(wall.points[used], cells.reshape(-1, 3))

    def onto(self, points: FloatArray, member: Any) -> FloatArray:
        """Points moved onto the smooth sheet they belong to, and into the plane they belong to as well.

        Those of no sheet, of two sheets, or of two planes stay where they are.
        """
        places = np.array(points)
        flat = member & (self._plane > 0)
        smooth = member & (self._plane == 0)
        plane = np.where(flat.any(axis=1), (flat * self._plane).max(axis=1), 0)
        one = (~flat | (self._plane == plane[:, None])).all(axis=1)
        for column, surface in self._surface.items():
            rows = np.flatnonzero(smooth[:, column] & (smooth.sum(axis=1) == 1) & one)
            if len(rows):
                places[rows] = surface.settle(points[rows], None, plane[rows], self._planes.reshape(-1, 4))[0]
        return places


def _without_spoiling(points: FloatArray, places: FloatArray, cells: IntArray) -> FloatArray:
    """Points at their places, but for those of elements that would become poor there, or poorer."""
    before = tet_quality(points, cells)
    stay = np.zeros(len(points), dtype=bool)
    while True:
        moved = np.where(stay[:, None], points, places)
        spoiled = tet_quality(moved, cells) < np.minimum(before, LEAST)
        nodes = np.unique(cells[spoiled])
        if stay[nodes].all():
            return moved
        stay[nodes] = True
