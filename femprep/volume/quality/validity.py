"""A mesh in, what makes it unfit out: inverted elements, holes, touching sheets, doubled points, missing tags."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree

from femprep.mesh.elements import ELEMENTS
from femprep.mesh.least_corner import BlockParts, by_least_corner
from femprep.mesh.topology import edge_table, euler_characteristic, pieces, pinched_vertices
from femprep.model import BoolArray, FloatArray, IntArray, VolumeMesh, is_blood
from femprep.model.blocks import nodes_of
from femprep.model.facets import split_facets
from femprep.volume.quality.face_table import FaceTable, face_table
from femprep.volume.quality.neighbours import Neighbours
from femprep.volume.quality.report import Validity


def validity(mesh: VolumeMesh, relative_jacobian: FloatArray, faces: Neighbours) -> Validity:
    """Judge everything but shapes.

    Parameters
    ----------
    mesh : VolumeMesh
        Any mesh, with or without tags.
    relative_jacobian : (n_cells,) array
        As from ``element_measures``.
    faces : Neighbours
        How its elements meet.
    """
    table = face_table(mesh)
    count, facet = table.count, table.facet_number
    # Quadrilaterals split in two have the same rims, shells and points where sheets touch.
    boundary = split_facets({kind: own.nodes for kind, own in faces.boundary.items()})
    total = sum(len(own.nodes) for own in faces.boundary.values())
    edges = edge_table(boundary)
    used = nodes_of(mesh.cells)
    outer = count[facet] == 1
    inward = ~_same_sense(_with_fourth(table.facets[outer]), _with_fourth(table.rings[table.first[facet[outer]]]))
    return Validity(
        inverted_elements=int((~(relative_jacobian > 0)).sum()),
        duplicate_elements=_duplicate_elements(mesh.cells),
        non_manifold_faces=faces.crowded,
        open_boundary_edges=int((edges.count == 1).sum()),
        non_manifold_boundary_edges=int((edges.count > 2).sum()),
        non_manifold_boundary_points=len(pinched_vertices(boundary, edges)),
        duplicate_points=_duplicate_points(mesh.points[used]),
        orphan_points=len(mesh.points) - len(used),
        pieces=faces.pieces,
        boundary_shells=int(pieces(boundary, edges).max(initial=-1)) + 1,
        euler_characteristic=euler_characteristic(boundary, edges),
        boundary_facets=total,
        untagged_boundary_facets=None if mesh.n_facets == 0 else total - len(np.unique(facet[outer])),
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
        whole = BlockParts(block, np.arange(ELEMENTS[name].corners)[None])
        total += sum(int((chunk.before() >= 0).sum()) for chunk in by_least_corner([whole]))
    return total


def _same_sense(one: IntArray, two: IntArray) -> BoolArray:
    """Whether rings of the same corners run the same way round: the corner after the smallest is the same."""
    after = []
    for ring in (one, two):
        size = np.where(ring[:, 3] >= 0, 4, 3)
        least = np.argmin(np.where(ring >= 0, ring, np.iinfo(np.int64).max), axis=1)
        after.append(ring[np.arange(len(ring)), (least + 1) % size])
    return np.asarray(after[0] == after[1])
