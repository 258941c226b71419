"""A mesh in, what makes it unfit out: inverted elements, holes, touching sheets, doubled points, missing tags."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from femprep.mesh.compiled import compiled
from femprep.mesh.elements import ELEMENTS, FACET_CORNERS, element_faces
from femprep.mesh.numbering import row_numbers, set_numbers
from femprep.model import IntArray, VolumeMesh, is_blood
from femprep.model.blocks import block_rows
from femprep.volume.quality.report import Validity


@dataclass(frozen=True)
class FaceTable:
    """All faces of all elements and all tagged facets of a mesh, numbered: equal numbers, equal corners.

    Attributes
    ----------
    rings : (f, 3) or (f, 4) array
        Corners of each face, outward from its element; -1 after a triangle's third where there are quadrilaterals.
    element : (f,) array
        The element of each face.
    number : (f,) array
    facets : (n_facets, 3) or (n_facets, 4) array
        Corners of the tagged facets, in the same way.
    facet_number : (n_facets,) array
    count : (k,) array
        Number of faces of each number.
    """

    rings: IntArray
    element: IntArray
    number: IntArray
    facets: IntArray
    facet_number: IntArray
    count: IntArray

    @cached_property
    def first(self) -> IntArray:
        """The first face of each number, ``(k,)``; 0 where there is none."""
        return self._place(slice(None, None, -1))

    @cached_property
    def last(self) -> IntArray:
        """The last face of each number, ``(k,)``; 0 where there is none."""
        return self._place(slice(None))

    def _place(self, way: slice) -> IntArray:
        found = np.zeros(len(self.count), dtype=np.int64)
        found[self.number[way]] = np.arange(len(self.number))[way]
        return found

    def greatest_ratio(self, volume: npt.NDArray[np.float64]) -> float | None:
        """Largest ratio of the volumes ``(n,)`` of two elements that share a face; 1 where none do.

        None where one of them has none.
        """
        ratio = float(_greatest_ratio(self.number, self.element, volume, len(self.count)))
        return ratio if ratio > 0.0 else None


@compiled()
def _greatest_ratio(number: IntArray, element: IntArray, volume: npt.NDArray[np.float64], count: int) -> float:
    """Largest ratio over all faces, each element there with the next; 0 where a volume is not positive."""
    last, ratio = np.full(count, -1, dtype=np.int64), 1.0
    for i in range(len(number)):
        one, other = element[i], last[number[i]]
        if other >= 0:
            low, high = min(volume[one], volume[other]), max(volume[one], volume[other])
            if low <= 0.0:
                return 0.0
            ratio = max(ratio, high / low)
        last[number[i]] = one
    return ratio


def face_table(mesh: VolumeMesh) -> FaceTable:
    """Number the faces and facets of a mesh."""
    faces = element_faces(mesh.cells)
    corners = max([3, *(FACET_CORNERS[kind] for kind in (*faces, *mesh.facets))])
    rings = _rings({kind: own.nodes for kind, own in faces.items()}, corners)
    facets = _rings(mesh.facets, corners)
    blocks = [rings, facets]
    if corners > 3:  # what stands for no fourth corner goes last: first numbers that differ make rows quick to compare
        last = max(int(block.max(initial=0)) for block in blocks) + 1
        blocks = [np.where(block < 0, last, block) for block in blocks]
    number = set_numbers(*blocks)
    face, facet = number[: len(rings)], number[len(rings) :]
    element = np.concatenate([np.empty(0, dtype=np.int64), *(own.element for own in faces.values())])
    return FaceTable(rings, element, face, facets, facet, np.bincount(face, minlength=int(number.max(initial=-1)) + 1))


def _rings(blocks: Mapping[str, IntArray], corners: int) -> IntArray:
    """Corners of all faces of some blocks ``(f, corners)``, -1 after those a face has."""
    if len(blocks) == 1:
        kind, block = next(iter(blocks.items()))
        if FACET_CORNERS[kind] == corners:
            return block[:, :corners]
    rings = np.full((sum(map(len, blocks.values())), corners), -1, dtype=np.int64)
    for kind, block, rows in block_rows(blocks):
        rings[rows, : FACET_CORNERS[kind]] = block[:, : FACET_CORNERS[kind]]
    return rings


def validity(mesh: VolumeMesh, relative_jacobian: npt.NDArray[np.float64], table: FaceTable | None = None) -> Validity:
    """Judge everything but shapes.

    Parameters
    ----------
    mesh : VolumeMesh
        Any mesh, with or without tags.
    relative_jacobian : (n_cells,) array
        As from ``element_measures``.
    table : FaceTable, optional
        Its faces, where they are numbered already.
    """
    table = face_table(mesh) if table is None else table
    count, facet = table.count, table.facet_number
    boundary = _with_fourth(table.rings[count[table.number] == 1])
    edges = _BoundaryEdges(boundary)
    used = used_points(mesh)
    outer = count[facet] == 1
    inward = ~_same_sense(_with_fourth(table.facets[outer]), _with_fourth(table.rings[table.first[facet[outer]]]))
    return Validity(
        inverted_elements=int((~(relative_jacobian > 0)).sum()),
        duplicate_elements=_duplicate_elements(mesh.cells),
        non_manifold_faces=int((count > 2).sum()),
        open_boundary_edges=int((edges.count == 1).sum()),
        non_manifold_boundary_edges=int((edges.count > 2).sum()),
        non_manifold_boundary_points=edges.pinched,
        duplicate_points=_duplicate_points(mesh.points[used]),
        orphan_points=len(mesh.points) - len(used),
        pieces=_components(mesh.n_cells, table.number, table.element, len(count)),
        boundary_shells=edges.shells,
        euler_characteristic=len(np.unique(boundary[boundary >= 0])) - len(edges.count) + len(boundary),
        boundary_facets=len(boundary),
        untagged_boundary_facets=None if mesh.n_facets == 0 else len(boundary) - len(np.unique(facet[outer])),
        stray_facets=int((count[facet] == 0).sum()),
        inward_facets=int(inward.sum()),
        interface_facets=int((count[facet] == 2).sum()),
        **_interface(mesh, table),
    )


def _interface(mesh: VolumeMesh, table: FaceTable) -> dict[str, int]:
    """What is wrong with the facets between wall and blood; nothing where there is no blood."""
    blood = is_blood(mesh.region)
    if not blood.any() or mesh.n_facets == 0:
        return {}
    shared = np.flatnonzero(table.count == 2)
    first, last = table.first[shared], table.last[shared]
    of_first, of_last = blood[table.element[first]], blood[table.element[last]]
    between = of_first != of_last
    tagged = np.zeros(len(table.count), dtype=bool)
    tagged[table.facet_number] = True
    # Where a facet lies between wall and blood: the wall's face, which it is to be wound like.
    wall = np.full(len(table.count), -1, dtype=np.int64)
    wall[shared[between]] = np.where(of_first, last, first)[between]
    inside = np.flatnonzero(table.count[table.facet_number] == 2)
    face = wall[table.facet_number[inside]]
    right = face >= 0
    right[right] = _same_sense(_with_fourth(table.facets[inside[right]]), _with_fourth(table.rings[face[right]]))
    return {
        "untagged_interface_facets": int((~tagged[shared[between]]).sum()),
        "misplaced_interface_facets": int((~right).sum()),
    }


def _with_fourth(rings: IntArray) -> IntArray:
    """Rings ``(f, 4)``: -1 after a triangle's third corner."""
    return np.pad(rings, ((0, 0), (0, 4 - rings.shape[1])), constant_values=-1)


class _BoundaryEdges:
    """Edges of boundary faces given as rings: how many faces at each, shells, points where sheets touch."""

    def __init__(self, rings: IntArray) -> None:
        quad = rings[:, 3] >= 0
        after = np.roll(rings, -1, axis=1)
        after[~quad, 2] = rings[~quad, 0]
        real = rings >= 0
        face = np.broadcast_to(np.arange(len(rings))[:, None], rings.shape)[real]
        start, stop = rings[real], after[real]
        size = int(rings.max(initial=0)) + 1
        _, number, self.count = np.unique(
            np.minimum(start, stop) * size + np.maximum(start, stop), return_inverse=True, return_counts=True
        )
        number = number.ravel()
        self.shells = _components(len(rings), number, face, len(self.count))
        # A node per corner of a face. The corner starts one edge and ends the one before: link it to that end of each.
        corner = np.arange(len(start))
        index = np.full(rings.shape, -1, dtype=np.int64)
        index[real] = corner
        index_after = np.roll(index, -1, axis=1)
        index_after[~quad, 2] = index[~quad, 0]
        other = index_after[real]
        hub = len(start) + 2 * number
        rows = np.concatenate([corner, other])
        hubs = np.concatenate([hub + (start > stop), hub + (stop > start)])
        graph = coo_array(
            (np.ones(len(rows), dtype=np.int8), (rows, hubs)), shape=(len(start) + 2 * len(self.count),) * 2
        )
        _, label = connected_components(graph, directed=False)
        _, one = np.unique(row_numbers(np.stack([start, label[: len(start)]], axis=1)), return_index=True)
        self.pinched = int((np.bincount(start[one]) > 1).sum())


def _components(count: int, hub: IntArray, member: IntArray, hubs: int) -> int:
    """Number of pieces ``count`` things are in that are linked where they share a hub."""
    return int(_count_pieces(count, np.ascontiguousarray(hub), np.ascontiguousarray(member), hubs))


@compiled()
def _count_pieces(count: int, hub: IntArray, member: IntArray, hubs: int) -> int:
    """Union and find, each path halved as it is walked."""
    parent = np.arange(count)
    first = np.full(hubs, -1, dtype=np.int64)
    left = count
    for i in range(len(hub)):
        a, b = member[i], first[hub[i]]
        if b < 0:
            first[hub[i]] = a
            continue
        while parent[a] != a:
            parent[a] = parent[parent[a]]
            a = parent[a]
        while parent[b] != b:
            parent[b] = parent[parent[b]]
            b = parent[b]
        if a != b:
            parent[max(a, b)] = min(a, b)
            left -= 1
    return left


def used_points(mesh: VolumeMesh) -> IntArray:
    """Numbers of the points some element uses."""
    used = np.zeros(len(mesh.points), dtype=bool)
    for block in mesh.cells.values():
        used[block] = True
    return np.flatnonzero(used)


def _duplicate_points(points: npt.NDArray[np.float64]) -> int:
    """Number of pairs of points nearer than 1e-9 of the extent of all."""
    if len(points) == 0:
        return 0
    tiny = 1e-9 * float(np.ptp(points, axis=0).max())
    # Only points whose x is that near to another's: few, quickly searched.
    order = np.argsort(points[:, 0])
    close = np.diff(points[order, 0]) <= tiny
    candidates = order[np.append(close, False) | np.append(False, close)]
    return len(cKDTree(points[candidates]).query_pairs(tiny, output_type="ndarray")) if len(candidates) else 0


def _duplicate_elements(cells: Mapping[str, IntArray]) -> int:
    total = 0
    for name, block in cells.items():
        total += len(block) - int(set_numbers(block[:, : ELEMENTS[name].corners]).max(initial=-1)) - 1
    return total


def _same_sense(one: IntArray, two: IntArray) -> npt.NDArray[np.bool_]:
    """Whether rings of the same corners run the same way round: the corner after the smallest is the same."""
    after = []
    for ring in (one, two):
        size = np.where(ring[:, 3] >= 0, 4, 3)
        least = np.argmin(np.where(ring >= 0, ring, np.iinfo(np.int64).max), axis=1)
        after.append(ring[np.arange(len(ring)), (least + 1) % size])
    return np.asarray(after[0] == after[1])
