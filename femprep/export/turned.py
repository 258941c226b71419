"""A mesh whose file has no order of nodes within an element, in; its tetrahedra all positive, out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from femprep.mesh.elements import ELEMENTS, FACET_CORNERS, boundary_faces, first_row
from femprep.mesh.numbering import set_numbers
from femprep.model import BoolArray, IntArray, VolumeMesh
from femprep.model.notice import Notice, noted

#: Share of negative tetrahedra of a file of VTK's from which on its writer had no order of nodes: FEniCS' have half.
MANY: Final = 0.4
#: Nodes of a tetrahedron with its first two corners exchanged.
_EXCHANGED: Final[Mapping[str, list[int]]] = {"tetra": [1, 0, 2, 3], "tetra10": [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]}


def turned_tetrahedra(mesh: VolumeMesh, least: float = 0.0) -> VolumeMesh:
    """The mesh with its negative tetrahedra turned, and a notice of them, where that is all that is wrong with them.

    FEniCS lists nodes by their numbers, so that half of its tetrahedra are negative. Where one is folded over its
    neighbour, the two lie on the same side of the face between them once both are positive: such a mesh stays.

    Parameters
    ----------
    mesh : VolumeMesh
    least : float
        Share of negative tetrahedra from which on they are turned; fewer are taken for faults.
    """
    if any(kind not in _EXCHANGED or rows.shape[1] != ELEMENTS[kind].nodes for kind, rows in mesh.cells.items()):
        return mesh
    turned = {kind: (rows, _negative(mesh.points[rows[:, :4]])) for kind, rows in mesh.cells.items()}
    count = sum(int(np.count_nonzero(negative)) for _, negative in turned.values())
    if not count or count < least * mesh.n_cells:
        return mesh
    cells = {
        kind: np.where(negative[:, None], rows[:, _EXCHANGED[kind]], rows) for kind, (rows, negative) in turned.items()
    }
    if not _lie_apart(np.concatenate([rows[:, :4] for rows in cells.values()])):
        return mesh
    words = f"{{amount}} of {mesh.n_cells} tetrahedra, whose nodes the file lists the other way round, are turned"
    told = Notice.of("assumed", words, amount=count)
    return replace(mesh, cells=cells, info=noted(mesh.info, told))


def outward_facets(mesh: VolumeMesh) -> VolumeMesh:
    """The mesh with the facets on its boundary wound outward, of a file that lists their nodes by their numbers."""
    faces, facets = boundary_faces(mesh.cells), dict(mesh.facets)
    for kind, rows in mesh.facets.items():
        own = faces[kind].nodes if kind in faces else rows[:0]
        number = set_numbers(own[:, : FACET_CORNERS[kind]], rows[:, : FACET_CORNERS[kind]])
        row = first_row(number[: len(own), None], number[len(own) :, None])
        facets[kind] = np.where((row >= 0)[:, None], own[row] if len(own) else rows, rows)
    return replace(mesh, facets=facets)


def _negative(corners: np.ndarray) -> BoolArray:
    a, b, c = (corners[:, i] - corners[:, 0] for i in (1, 2, 3))
    return np.asarray(np.einsum("ij,ij->i", np.cross(a, b), c) < 0)


def _lie_apart(corners: IntArray) -> bool:
    """Whether the two elements of each face see it from opposite sides."""
    faces = np.concatenate([corners[:, list(face)] for face in ELEMENTS["tetra"].faces])
    order = np.argsort(faces, axis=1)
    odd = np.isin(order @ [9, 3, 1], [7, 11, 21])  # 0 2 1, 1 0 2 and 2 1 0, by one exchange
    _, which = np.unique(np.take_along_axis(faces, order, axis=1), axis=0, return_inverse=True)
    both = np.bincount(which.ravel()) == 2
    return bool(np.all(np.bincount(which.ravel(), weights=np.where(odd, 1.0, -1.0))[both] == 0))
