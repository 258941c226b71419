"""A mesh in, what makes it unfit out: inverted elements, holes, touching sheets, doubled points, missing tags."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from femprep.elements import ELEMENTS, FACET_CORNERS, element_faces, match_facets
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
    rings, owner = _face_rings(mesh.cells)
    key, number, count = _unique_faces(rings)
    single = count[number] == 1
    boundary = rings[single]
    edges = _BoundaryEdges(boundary)
    used = _used_points(mesh)
    tagged, stray, inward = _facet_faults(mesh)
    return Validity(
        inverted_elements=int((~(relative_jacobian > 0)).sum()),
        duplicate_elements=_duplicate_elements(mesh.cells),
        non_manifold_faces=int((count > 2).sum()),
        open_boundary_edges=int((edges.count == 1).sum()),
        non_manifold_boundary_edges=int((edges.count > 2).sum()),
        non_manifold_boundary_points=edges.pinched,
        duplicate_points=len(cKDTree(mesh.points[used]).query_pairs(_tiny(mesh, used), output_type="ndarray")),
        orphan_points=len(mesh.points) - len(used),
        pieces=_components(mesh.n_cells, number, owner, len(key)),
        boundary_shells=edges.shells,
        euler_characteristic=len(np.unique(boundary[boundary >= 0])) - len(edges.count) + len(boundary),
        boundary_facets=len(boundary),
        untagged_boundary_facets=None if mesh.n_facets == 0 else len(boundary) - tagged,
        stray_facets=stray,
        inward_facets=inward,
    )


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


def _unique_faces(rings: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Faces as sets of corners, the number of each ring's face, and how many elements each face belongs to."""
    if len(rings) == 0:
        return rings, np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    key, number, count = np.unique(np.sort(rings, axis=1), axis=0, return_inverse=True, return_counts=True)
    return key, number.ravel(), count


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
        fans = np.unique(np.stack([start, label[: len(start)]], axis=1), axis=0)
        self.pinched = int((np.unique(fans[:, 0], return_counts=True)[1] > 1).sum()) if len(fans) else 0


def _components(count: int, hub: IntArray, member: IntArray, hubs: int) -> int:
    """Number of pieces ``count`` things are in that are linked where they share a hub."""
    if count == 0:
        return 0
    size = count + hubs
    graph = coo_array((np.ones(len(hub), dtype=np.int8), (member, count + hub)), shape=(size, size))
    return int(connected_components(graph, directed=False)[0])


def _used_points(mesh: VolumeMesh) -> IntArray:
    parts = [np.unique(block) for block in mesh.cells.values()]
    return np.unique(np.concatenate([np.empty(0, dtype=np.int64), *parts]))


def _tiny(mesh: VolumeMesh, used: IntArray) -> float:
    """Distance below which two points are one: 1e-9 of the mesh's extent."""
    return 1e-9 * float(np.ptp(mesh.points[used], axis=0).max(initial=0.0)) if len(used) else 0.0


def _duplicate_elements(cells: Mapping[str, IntArray]) -> int:
    total = 0
    for name, block in cells.items():
        corners = np.sort(block[:, : ELEMENTS[name].corners], axis=1)
        total += len(corners) - len(np.unique(corners, axis=0))
    return total


def _facet_faults(mesh: VolumeMesh) -> tuple[int, int, int]:
    """Boundary facets that are tagged, tagged facets no element has, tagged boundary facets wound inward."""
    element, face = match_facets(mesh.cells, mesh.facets)
    matched = element >= 0
    rings, _ = _face_rings(mesh.cells)
    if len(rings) == 0 or not matched.any():
        return 0, int((~matched).sum()), 0
    _, number, count = _unique_faces(rings)
    ring_of = _element_rings(mesh, element[matched], face[matched])
    wanted = np.full((len(ring_of), 4), -1, dtype=np.int64)
    facets, first = np.full((mesh.n_facets, 4), -1, dtype=np.int64), 0
    for kind, block in mesh.facets.items():
        facets[first : first + len(block), : FACET_CORNERS[kind]] = block[:, : FACET_CORNERS[kind]]
        first += len(block)
    wanted = facets[matched]
    key = np.unique(np.sort(rings[count[number] == 1], axis=1), axis=0)
    both, where = np.unique(np.concatenate([key, np.sort(wanted, axis=1)]), axis=0, return_inverse=True)
    where = where.ravel()
    is_boundary = np.zeros(len(both), dtype=bool)
    is_boundary[where[: len(key)]] = True
    on_boundary = is_boundary[where[len(key) :]]
    tagged = len(np.unique(where[len(key) :][on_boundary]))
    inward = on_boundary & ~_same_sense(wanted, ring_of)
    return tagged, int((~matched).sum()), int(inward.sum())


def _element_rings(mesh: VolumeMesh, element: IntArray, face: IntArray) -> IntArray:
    """Corner rings ``(k, 4)`` of given faces of given elements, outward."""
    out, first = np.full((len(element), 4), -1, dtype=np.int64), 0
    for name, block in mesh.cells.items():
        for number, corners in enumerate(ELEMENTS[name].faces):
            chosen = (element >= first) & (element < first + len(block)) & (face == number)
            out[chosen, : len(corners)] = block[element[chosen] - first][:, list(corners)]
        first += len(block)
    return out


def _same_sense(one: IntArray, two: IntArray) -> npt.NDArray[np.bool_]:
    """Whether rings of the same corners run the same way round: the corner after the smallest is the same."""
    after = []
    for ring in (one, two):
        size = np.where(ring[:, 3] >= 0, 4, 3)
        least = np.argmin(np.where(ring >= 0, ring, np.iinfo(np.int64).max), axis=1)
        after.append(ring[np.arange(len(ring)), (least + 1) % size])
    return np.asarray(after[0] == after[1])
