"""Boundary nodes put onto their sheets, as far as no element suffers; what then holds them while elements improve."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.mesh.elements import ELEMENTS, boundary_faces, element_faces, near_others
from femprep.mesh.measures.volume_elements import element_measures
from femprep.mesh.numbering import none_of, twins
from femprep.mesh.patches import PatchSurface, plane_table
from femprep.model import FloatArray, IntArray, Plane, TagArray
from femprep.volume.optimise import LEAST, tet_quality
from femprep.volume.optimise.constraints import Constraints
from femprep.volume.refine.sheets import Membership, Sheets

#: A move is halved so often where it spoils an element, and then not made at all.
_HALVINGS: Final = 3
#: Relative Jacobian below which an element that is no tetrahedron is spoiled.
_SOUND: Final = 0.25


def moved_onto(
    points: FloatArray, nodes: IntArray, places: FloatArray, cells: Mapping[str, IntArray]
) -> tuple[FloatArray, int, float]:
    """Points with some nodes at their places, or on the way there where an element would become poor, or poorer.

    Parameters
    ----------
    points : (n, 3) array
        mm; no element is inverted.
    nodes : (k,) array
        Which may move.
    places : (k, 3) array
        Where to.
    cells : mapping of str to array
        Linear elements by type.

    Returns
    -------
    points : (n, 3) array
    held : int
        How many nodes got less than all the way.
    gap : float
        How far from its place the farthest of them stayed, mm.
    """
    target = points.copy()
    target[nodes] = places
    far = (target[nodes] != points[nodes]).any(axis=1)
    moves = np.zeros(len(points), dtype=np.bool_)
    moves[nodes[far]] = True
    near = {name: block[moves[block].any(axis=1)] for name, block in cells.items()}
    near = {name: block for name, block in near.items() if len(block)}
    least = {
        name: np.minimum(_quality(points, block, name), LEAST if name == "tetra" else _SOUND)
        for name, block in near.items()
    }
    share = np.ones(len(points))
    moved = target
    rounds = 0
    while True:
        bad = np.zeros(len(points), dtype=np.bool_)
        for name, block in near.items():
            bad[block[_quality(moved, block, name) < least[name]].ravel()] = True
        bad &= moves & (share > 0.0)
        if not bad.any():
            return moved, int((share < 1.0).sum()), float(np.linalg.norm(target - moved, axis=1).max(initial=0.0))
        rounds += 1
        share[bad] = 0.5 * share[bad]
        share[bad & (share < 0.5**_HALVINGS)] = 0.0
        some = np.flatnonzero(share < 1.0)
        moved = target.copy()
        moved[some] = points[some] + share[some, None] * (target[some] - points[some])


def constraints_of(count: int, cells: IntArray, on: Membership, sheets: Sheets) -> Constraints:
    """What holds the nodes of a mesh: its smooth sheets, planes and rims; all other boundary nodes stay."""
    freedom = np.zeros(count, dtype=np.int64)
    freedom[cells] = 3  # not those that no element has
    freedom[on.nodes] = 0
    plain = ~on.other
    on_smooth = plain & (on.smooth >= 0) & (on.flat == -1)
    on_plane = plain & (on.smooth == -1) & (on.flat >= 0)
    on_rim = plain & (on.smooth >= 0) & (on.flat >= 0)
    freedom[on.nodes[on_smooth | on_plane]] = 2
    freedom[on.nodes[on_rim]] = 1
    groups: list[SmoothGroup] = []
    for number, surface in sheets.surfaces.items():
        inner = on.nodes[on_smooth & (on.smooth == number)]
        if len(inner):
            groups.append(SmoothGroup(inner, surface))
        for flat, plane in sheets.planes.items():
            rim = on.nodes[on_rim & (on.smooth == number) & (on.flat == flat)]
            if len(rim):
                groups.append(SmoothGroup(rim, surface, plane))
    planes = {str(number): plane for number, plane in sheets.planes.items()}
    held = {str(number): on.nodes[(on.flat == number) & (on_plane | on_rim)] for number in sheets.planes}
    return Constraints(freedom, planes, held, tuple(groups))


@dataclass(frozen=True)
class SmoothGroup:
    """Points of a smooth surface, or of its rim in a plane.

    Attributes
    ----------
    nodes : (k,) array
        Their numbers.
    surface : PatchSurface
    plane : Plane, optional
        The rim's.
    """

    nodes: IntArray
    surface: PatchSurface
    plane: Plane | None = None

    def closest(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where points ``(q, 3)`` of the group belong, and the surface's unit normal or the rim's direction there."""
        if self.plane is None:
            places, normal, _ = self.surface.settle(points)
            return places, normal
        flat = np.ones(len(points), dtype=np.int64)
        places, normal, _ = self.surface.settle(points, None, flat, plane_table([self.plane]))
        along = np.cross(normal, self.plane.normal)
        size = np.linalg.norm(along, axis=1, keepdims=True)
        return places, np.divide(along, size, out=np.zeros_like(along), where=size > 0.0)


def untagged_faces(name: str, block: IntArray, region: TagArray, facets: Mapping[str, IntArray]) -> IntArray:
    """Boundary faces of tetrahedra, and faces between regions, that are no facets: all their nodes, ``(k, 3 or 6)``."""
    kind = "triangle6" if ELEMENTS[name].quadratic else "triangle"
    found = [boundary_faces({name: block})[kind].nodes]
    near = near_others(block[:, :4], region)
    if len(near):
        faces = element_faces({name: block[near]})[kind]
        own = region[near[faces.element]]
        one, two = twins(faces.nodes[:, :3])
        found.append(faces.nodes[one[own[one] != own[two]]])
    every = np.concatenate(found)
    tagged = np.concatenate([np.empty((0, 3), dtype=np.int64), *(nodes[:, :3] for nodes in facets.values())])
    return np.asarray(every[none_of(every[:, :3], tagged)])


def _quality(points: FloatArray, block: IntArray, name: str) -> FloatArray:
    return tet_quality(points, block) if name == "tetra" else element_measures(points, block, name)["relative_jacobian"]
