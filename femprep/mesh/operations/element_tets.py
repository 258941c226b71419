"""Elements of any type in, the linear tetrahedra each is made of out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from femprep.mesh.elements import ELEMENTS
from femprep.model import IntArray
from femprep.model.blocks import block_rows


def mesh_tets(cells: Mapping[str, IntArray]) -> tuple[IntArray, IntArray]:
    """Tetrahedra of all elements of a mesh ``(m, 4)``, and the element each comes from ``(m,)``."""
    tets, owner = [], []
    for kind, block, rows in block_rows(cells):
        own, row = element_tets(kind, block)
        tets.append(own)
        owner.append(row + rows.start)
    return np.concatenate(tets), np.concatenate(owner)


def element_tets(kind: str, block: IntArray) -> tuple[IntArray, IntArray]:
    """Tetrahedra of linear or quadratic elements, and the row of ``block`` each comes from, those of a row together.

    Each element is the cone of its smallest node over the faces that do not hold it, and each quadrilateral is cut
    through its own smallest node: neighbours agree without knowing each other, and no point is added. A wedge gives
    3, a hexahedron 6. Positive elements with flat faces give positive tetrahedra.

    References
    ----------
    Dompierre, Labbe, Vallet, Camarero (1999): How to subdivide pyramids, prisms and hexahedra into tetrahedra.
    8th International Meshing Roundtable, section 3 (the cut through the smallest node).
    """
    element = ELEMENTS[kind]
    if element.corners == 4:
        return block[:, :4], np.arange(len(block))
    smallest = np.argmin(block[:, : element.corners], axis=1)
    tets, rows = [], []
    for node in range(element.corners):
        chosen = np.flatnonzero(smallest == node)
        for face in element.faces:
            if node in face:
                continue
            nodes = block[chosen][:, face]
            triangles = quads_to_triangles(nodes) if len(face) == 4 else nodes
            row = np.repeat(chosen, len(triangles) // max(len(chosen), 1))
            tets.append(np.column_stack([triangles[:, [0, 2, 1]], block[row, node]]))
            rows.append(row)
    row = np.concatenate(rows)
    order = np.argsort(row, kind="stable")
    return np.concatenate(tets)[order], row[order]


def quads_to_triangles(quads: IntArray) -> IntArray:
    """Two triangles of each quadrilateral, ``(n, 4)`` to ``(2 n, 3)``, cut through its smallest node number."""
    turn = (np.argmin(quads[:, :4], axis=1)[:, None] + np.arange(4)) % 4
    nodes = np.take_along_axis(quads[:, :4], turn, axis=1)
    return nodes[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
