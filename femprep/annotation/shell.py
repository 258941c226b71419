"""Elements in, their boundary out: every facet with its centre, area vector, piece and neighbours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from femprep.errors import InputError
from femprep.mesh.elements import FACET_CORNERS, boundary_faces
from femprep.mesh.numbering import set_numbers
from femprep.mesh.topology import border_loops, components, enclosed_volume, volume
from femprep.model import BoolArray, FloatArray, IntArray, VolumeMesh
from femprep.model.blocks import block_rows
from femprep.model.facets import centres_and_areas, split_facets


@dataclass(frozen=True, eq=False)
class Shell:
    """The boundary of a volume mesh.

    Attributes
    ----------
    points : (n, 3) array
        Those of the mesh.
    facets : mapping of str to (f, q) array
        All boundary facets by type, wound out of the tissue.
    element : (n_facets,) array
        The element each belongs to.
    centre, vector : (n_facets, 3) arrays
        Centre of the corners and area vector.
    pairs : (k, 2) array
        Facets that share an edge.
    triangles, facet_of : (m, 3) and (m,) arrays
        The same surface as triangles, and the facet of each.
    """

    points: FloatArray
    facets: Mapping[str, IntArray]
    element: IntArray
    centre: FloatArray
    vector: FloatArray
    pairs: IntArray
    triangles: IntArray
    facet_of: IntArray

    @property
    def area(self) -> FloatArray:
        """Area of each facet, mm2."""
        return np.asarray(np.linalg.norm(self.vector, axis=1))

    @property
    def normal(self) -> FloatArray:
        """Unit normal of each facet, out of the tissue."""
        return np.asarray(self.vector / np.maximum(self.area, 1e-300)[:, None])

    @property
    def edge(self) -> float:
        """Typical length of an edge: that of the equilateral triangle of median area, mm."""
        return float(np.sqrt(4.0 / np.sqrt(3.0) * np.median(self.area)))

    def __len__(self) -> int:
        return len(self.element)

    def pieces(self, chosen: BoolArray | None = None, across: BoolArray | None = None) -> IntArray:
        """Number from 0 of the connected piece of each facet, the largest area first; -1 for those not chosen.

        ``across`` tells which of :attr:`pairs` connect; all of them where not given.
        """
        keep = np.ones(len(self.pairs), dtype=bool) if across is None else across
        chosen = np.ones(len(self), dtype=bool) if chosen is None else chosen
        pairs = self.pairs[keep & chosen[self.pairs].all(axis=1)]
        label = components(pairs[:, 0], pairs[:, 1], len(self))
        size = np.bincount(label[chosen], weights=self.area[chosen], minlength=int(label.max(initial=0)) + 1)
        rank = np.empty(len(size), dtype=np.int64)
        rank[np.argsort(-size, kind="stable")] = np.arange(len(size))
        return np.where(chosen, rank[label], -1)

    def along(self, seeds: IntArray, limit: float, chosen: BoolArray | None = None) -> FloatArray:
        """Way along the surface from the nearest of some facets, from centre to centre, mm; infinite beyond a limit.

        It leads over ``chosen`` facets alone, where these are given, from each to all that share a corner with it: a
        tenth longer than straight at most, where over edges alone it is half as much again.
        """
        out = np.full(len(self), np.inf)
        if not len(seeds):
            return out
        near = cKDTree(self.centre[np.unique(seeds)]).query(self.centre, distance_upper_bound=limit)[0] < np.inf
        rows = np.flatnonzero(near if chosen is None else near & chosen)
        number = np.full(len(self), -1)
        number[rows] = np.arange(len(rows))
        own = number[self.facet_of]
        node = self.triangles[own >= 0]
        shape = (len(rows), int(node.max(initial=0)) + 1)
        has = coo_array((np.ones(node.size), (np.repeat(own[own >= 0], 3), node.ravel())), shape=shape).tocsr()
        beside = (has @ has.T).tocoo()
        a, b = rows[beside.row], rows[beside.col]
        length = np.linalg.norm(self.centre[a] - self.centre[b], axis=1)
        graph = coo_array((np.maximum(length, 1e-12), (beside.row, beside.col)), shape=beside.shape).tocsr()
        start = number[np.unique(seeds)]
        out[rows] = dijkstra(graph, indices=start[start >= 0], min_only=True, limit=limit)
        return out

    def enclosed(self, chosen: BoolArray) -> float:
        """Volume between some facets and fans over their rims, mm3: positive where they look outward of it."""
        triangles = self.triangles[chosen[self.facet_of]]
        try:
            return enclosed_volume(self.points, triangles)
        except InputError:  # rims that touch themselves: seen from their middle they still tell inside from outside
            return volume(self.points, triangles)

    def rims(self, chosen: BoolArray) -> int:
        """Number of rims of the surface made of some facets."""
        try:
            return len(border_loops(self.triangles[chosen[self.facet_of]]))
        except InputError:
            return -1


def shell_of(mesh: VolumeMesh) -> Shell:
    """The boundary of a mesh: what only one element has.

    Raises
    ------
    InputError
        The mesh has no boundary.
    """
    faces = boundary_faces(mesh.cells)
    facets = {kind: own.nodes for kind, own in faces.items() if len(own.nodes)}
    if not facets:
        raise InputError("the mesh has no boundary facets; give a mesh of volume elements")
    element = np.concatenate([faces[kind].element for kind in facets])
    return _shell(mesh.points, facets, element)


def shell_of_triangles(points: FloatArray, triangles: IntArray) -> Shell:
    """The same of a surface by itself; all of its triangles are of element 0."""
    return _shell(points, {"triangle": triangles}, np.zeros(len(triangles), dtype=np.int64))


def _shell(points: FloatArray, facets: Mapping[str, IntArray], element: IntArray) -> Shell:
    ends, owners = [], []
    for kind, block, rows in block_rows(facets):
        corners = block[:, : FACET_CORNERS[kind]]
        sides = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2)
        own = np.arange(rows.start, rows.stop)
        ends.append(np.column_stack([sides, np.repeat(own, corners.shape[1])]))
        owners += [own] * (corners.shape[1] - 2)  # a quadrilateral is two triangles
    sides = np.concatenate(ends)
    number = set_numbers(sides[:, :2])
    order = np.argsort(number, kind="stable")
    same = np.flatnonzero(number[order[1:]] == number[order[:-1]])
    # Where several sheets meet in an edge, neighbours in the list are no neighbours in space: such edges part.
    twice = np.bincount(number)[number[order[same]]] == 2
    pairs = np.column_stack([sides[order[same], 2], sides[order[same + 1], 2]])[twice]
    return Shell(
        points,
        facets,
        element,
        *centres_and_areas(points, facets),
        pairs,
        split_facets(facets),
        np.concatenate(owners),
    )
