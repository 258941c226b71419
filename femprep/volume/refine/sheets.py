"""The tagged facets of a mesh in, the sheets they make up out: smooth surfaces, planes, and facets that are neither.

Endocardia and epicardia are smooth. Where the wall that the mesh fills is known, so are its surfaces; of a mesh alone
the smooth surface through the nodes of its own facets is taken. Connected facets of another tag that lie in a plane
are a sheet of that plane, with all that lie in the same one; others stay as they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.mesh.elements import FACET_CORNERS
from femprep.mesh.patches import PatchSurface, plane_table
from femprep.mesh.topology import pieces
from femprep.model import BoolArray, FloatArray, IntArray, Plane, TagArray, VolumeMesh, Wall, tag_name
from femprep.volume.optimise.constraints import flatten

#: Sheets whose names begin with these are smooth.
_SMOOTH: Final = ("endo", "epi")
#: Facets that lie so near a plane, by their extent, are flat: as near as numbers of single precision tell.
_FLAT: Final = 2e-6
#: Fewer triangles than this tell no smooth surface.
_LEAST_TRIANGLES: Final = 12


@dataclass(frozen=True)
class Sheets:
    """The sheets of a mesh's facets.

    Attributes
    ----------
    of_facet : (f,) array
        Number of the sheet each facet belongs to.
    surfaces : dict of int to PatchSurface
        The smooth ones.
    planes : dict of int to Plane
        The flat ones.
    count : int
        Number of sheets.
    tags : (s,) array
        A tag of each.
    """

    of_facet: IntArray
    surfaces: dict[int, PatchSurface]
    planes: dict[int, Plane]
    count: int
    tags: TagArray

    @property
    def kept(self) -> list[str]:
        """Names of the tags whose facets are neither smooth nor flat."""
        rest = [s for s in range(self.count) if s not in self.surfaces and s not in self.planes]
        return sorted({tag_name(int(self.tags[s])) for s in rest})


def find_sheets(mesh: VolumeMesh, wall: Wall | None = None) -> Sheets:
    """Find the sheets of a mesh; the smooth ones are those of the wall it fills where that is given."""
    of_facet = np.zeros(mesh.n_facets, dtype=np.int64)
    surfaces: dict[int, PatchSurface] = {}
    planes: dict[int, Plane] = {}
    tags: list[int] = []
    for tag in np.unique(mesh.facet_tag).tolist():
        own = mesh.facet_tag == tag
        triangles, facet = _triangles(mesh, own)
        if tag_name(tag).startswith(_SMOOTH):
            points = mesh.points
            if wall is not None and (wall.facet_tag == tag).any():
                points, triangles = wall.points, wall.triangles[wall.facet_tag == tag]
            of_facet[own] = len(tags)
            if len(triangles) >= _LEAST_TRIANGLES:
                used, cells = np.unique(triangles, return_inverse=True)
                surfaces[len(tags)] = PatchSurface(points[used], cells.reshape(-1, 3))
            tags.append(tag)
            continue
        label = pieces(triangles)
        for piece in range(int(label.max()) + 1):
            rows = label == piece
            plane = _plane(mesh, tag, mesh.points[np.unique(triangles[rows])])
            same = None if plane is None else _same(planes, plane)
            if same is None:
                same = len(tags)
                tags.append(tag)
                if plane is not None:
                    planes[same] = plane
            of_facet[facet[rows]] = same
    return Sheets(of_facet, surfaces, planes, len(tags), np.array(tags, dtype=np.int32))


@dataclass(frozen=True)
class Membership:
    """Which sheets the boundary nodes of a mesh belong to.

    Attributes
    ----------
    nodes : (b,) array
        Numbers of all nodes of tagged facets.
    smooth, flat : (b,) arrays
        The one smooth sheet of each node, the one plane: -1 for none, -2 for several.
    other : (b,) array
        Whether it belongs to facets that are neither.
    second : (b,) array
        A second plane where it belongs to two, else -1.
    """

    nodes: IntArray
    smooth: IntArray
    flat: IntArray
    other: BoolArray
    second: IntArray


def membership(facets: Mapping[str, IntArray], of_facet: IntArray, sheets: Sheets) -> Membership:
    """Find the sheets of each boundary node; facets without a sheet (-1) hold their nodes."""
    corner = [(nodes, nodes.shape[1]) for nodes in facets.values()]
    every = np.concatenate([nodes.ravel() for nodes, _ in corner]) if corner else np.empty(0, dtype=np.int64)
    first, owner = 0, []
    for nodes, width in corner:
        owner.append(np.repeat(of_facet[first : first + len(nodes)], width))
        first += len(nodes)
    sheet = np.concatenate(owner) if owner else np.empty(0, dtype=np.int64)
    used = np.zeros(int(every.max(initial=-1)) + 1, dtype=np.bool_)
    used[every] = True
    nodes = np.flatnonzero(used)
    number = np.cumsum(used) - 1
    member = np.zeros((len(nodes), sheets.count + 1), dtype=np.bool_)
    member[number[every], sheet] = True  # -1 is the last column
    smooth = _only(member, sorted(sheets.surfaces))
    flat = _only(member, sorted(sheets.planes))
    rest = [s for s in range(sheets.count + 1) if s not in sheets.surfaces and s not in sheets.planes]
    columns = sorted(sheets.planes)
    second = np.full(len(nodes), -1)
    if len(columns) > 1:
        in_planes = member[:, columns]
        two = in_planes.sum(axis=1) == 2
        second[two] = np.array(columns)[len(columns) - 1 - np.argmax(in_planes[two][:, ::-1], axis=1)]
    return Membership(nodes, smooth, flat, np.asarray(member[:, rest].any(axis=1)), second)


def placed(points: FloatArray, on: Membership, sheets: Sheets, rows: BoolArray) -> FloatArray:
    """Places ``(b, 3)`` of boundary nodes: on their smooth sheet, in their plane, on both; others as they are.

    Parameters
    ----------
    points : (b, 3) array
        Where they are, mm.
    on : Membership
    sheets : Sheets
    rows : (b,) array
        Which of them to place.
    """
    places = points.copy()
    for number, surface in sheets.surfaces.items():
        own = np.flatnonzero(rows & (on.smooth == number) & (on.flat != -2))
        if len(own):
            columns = sorted(sheets.planes)
            table = plane_table(sheets.planes[column] for column in columns)
            kind = np.where(on.flat[own] >= 0, np.searchsorted(columns, on.flat[own]) + 1, 0)
            places[own] = surface.settle(points[own], None, kind, table)[0]
    for number, plane in sheets.planes.items():
        flatten(places, np.flatnonzero(rows & ((on.flat == number) | (on.second == number))), plane)
    both = np.flatnonzero(rows & (on.second >= 0))
    if len(both):  # once more onto the first, for planes that are not at right angles
        for _ in range(20):
            for number, plane in sheets.planes.items():
                flatten(places, both[(on.flat[both] == number) | (on.second[both] == number)], plane)
    return places


def _only(member: BoolArray, columns: list[int]) -> IntArray:
    """The one column of those given that each row has: -1 for none, -2 for several."""
    if not columns:
        return np.full(len(member), -1)
    chosen = member[:, columns]
    count = chosen.sum(axis=1)
    return np.where(count == 1, np.array(columns)[np.argmax(chosen, axis=1)], np.where(count == 0, -1, -2))


def _triangles(mesh: VolumeMesh, own: BoolArray) -> tuple[IntArray, IntArray]:
    """Some facets as triangles over all their nodes, and the facet each is of."""
    parts, owner, first = [], [], 0
    for kind, block in mesh.facets.items():
        rows = np.flatnonzero(own[first : first + len(block)])
        nodes = block[rows]
        corners = FACET_CORNERS[kind]
        if block.shape[1] == corners:
            split = [(0, 1, 2)] if corners == 3 else [(0, 1, 2), (0, 2, 3)]
        elif corners == 3:
            split = [(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]
        else:
            split = [(0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 6), (4, 6, 7)]
        for columns in split:
            parts.append(nodes[:, columns])
            owner.append(first + rows)
        first += len(block)
    return np.concatenate(parts), np.concatenate(owner)


def _plane(mesh: VolumeMesh, tag: int, points: FloatArray) -> Plane | None:
    """The plane of some points: the mesh's own of that name, or the one that fits them; None where there is none."""
    limit = _FLAT * float(np.ptp(points, axis=0).max())
    own = mesh.planes.get(tag_name(tag))
    if own is not None and float(np.abs(own.signed_distance(points)).max()) <= limit:
        return own
    for other in mesh.planes.values():  # a cap lies in the plane of the base
        if float(np.abs(other.signed_distance(points)).max()) <= limit:
            return other
    middle = points.mean(axis=0)
    _, size, axes = np.linalg.svd(points - middle, full_matrices=False)
    if len(points) < 3 or size[1] <= limit:
        return None
    found = Plane(middle, axes[2])
    return found if float(np.abs(found.signed_distance(points)).max()) <= limit else None


def _same(planes: dict[int, Plane], plane: Plane) -> int | None:
    for number, other in planes.items():
        if other is plane or (
            abs(float(other.normal @ plane.normal)) > 1.0 - 1e-12
            and abs(float(other.signed_distance(plane.point[None])[0])) < 1e-9
        ):
            return number
    return None
