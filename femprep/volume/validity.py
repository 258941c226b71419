"""A mesh in, what makes it unfit out: inverted elements, holes, touching sheets, doubled points, missing tags."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from femprep.compiled import compiled
from femprep.elements import ELEMENTS, FACET_CORNERS, element_faces, row_numbers, set_numbers
from femprep.model import VolumeMesh
from femprep.volume.report import Validity

IntArray = npt.NDArray[np.int64]


def validity(mesh: VolumeMesh, relative_jacobian: npt.NDArray[np.float64]) -> Validity:
    """Judge everything but shapes.

    Parameters
    ----------
    mesh : VolumeMesh
        Any mesh, with or without tags.
    relative_jacobian : (n_cells,) array
        As from ``element_measures``.
    """
    faces, owner = _face_rings(mesh.cells)
    facets = _facet_rings(mesh)
    number = _ring_numbers(np.concatenate([faces, facets]))
    face, facet = number[: len(faces)], number[len(faces) :]
    count = np.bincount(face, minlength=int(number.max(initial=-1)) + 1)
    boundary = faces[count[face] == 1]
    edges = _BoundaryEdges(boundary)
    used = used_points(mesh)
    outer = count[facet] == 1
    first = np.zeros(len(count), dtype=np.int64)
    first[face[::-1]] = np.arange(len(face))[::-1]
    inward = ~_same_sense(facets[outer], faces[first[facet[outer]]])
    return Validity(
        inverted_elements=int((~(relative_jacobian > 0)).sum()),
        duplicate_elements=_duplicate_elements(mesh.cells),
        non_manifold_faces=int((count > 2).sum()),
        open_boundary_edges=int((edges.count == 1).sum()),
        non_manifold_boundary_edges=int((edges.count > 2).sum()),
        non_manifold_boundary_points=edges.pinched,
        duplicate_points=len(cKDTree(mesh.points[used]).query_pairs(_tiny(mesh, used), output_type="ndarray")),
        orphan_points=len(mesh.points) - len(used),
        pieces=_components(mesh.n_cells, face, owner, len(count)),
        boundary_shells=edges.shells,
        euler_characteristic=len(np.unique(boundary[boundary >= 0])) - len(edges.count) + len(boundary),
        boundary_facets=len(boundary),
        untagged_boundary_facets=None if mesh.n_facets == 0 else len(boundary) - len(np.unique(facet[outer])),
        stray_facets=int((count[facet] == 0).sum()),
        inward_facets=int(inward.sum()),
    )


def _ring_numbers(rings: IntArray) -> IntArray:
    """Number from 0 of each ring, equal for rings of the same corners."""
    # What stands for no fourth corner goes last: first numbers that differ make rows quick to compare.
    if (rings[:, 3] < 0).all():
        return set_numbers(rings[:, :3])
    return set_numbers(np.where(rings < 0, rings.max(initial=0) + 1, rings))


def _face_rings(cells: Mapping[str, IntArray]) -> tuple[IntArray, IntArray]:
    """Corner rings of all faces of all elements ``(f, 4)``, -1 after a triangle's third, and the elements."""
    rings, owner = [np.empty((0, 4), dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for kind, faces in element_faces(cells).items():
        corners = FACET_CORNERS[kind]
        ring = np.full((len(faces.nodes), 4), -1, dtype=np.int64)
        ring[:, :corners] = faces.nodes[:, :corners]
        rings.append(ring)
        owner.append(faces.element)
    return np.concatenate(rings), np.concatenate(owner)


def _facet_rings(mesh: VolumeMesh) -> IntArray:
    """Corner rings ``(n_facets, 4)`` of the tagged facets, -1 after a triangle's third."""
    rings, first = np.full((mesh.n_facets, 4), -1, dtype=np.int64), 0
    for kind, block in mesh.facets.items():
        rings[first : first + len(block), : FACET_CORNERS[kind]] = block[:, : FACET_CORNERS[kind]]
        first += len(block)
    return rings


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


def _tiny(mesh: VolumeMesh, used: IntArray) -> float:
    """Distance below which two points are one: 1e-9 of the mesh's extent."""
    return 1e-9 * float(np.ptp(mesh.points[used], axis=0).max(initial=0.0)) if len(used) else 0.0


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
