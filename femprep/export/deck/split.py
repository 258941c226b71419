"""A mesh of any elements in, the same mesh of linear tetrahedra, or of linear elements, out."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import Final

import numpy as np

from femprep.mesh.elements import ELEMENTS, FACET_CORNERS
from femprep.mesh.operations.element_tets import element_tets, quads_to_triangles
from femprep.model import VolumeMesh
from femprep.model.blocks import block_rows
from femprep.model.used_points import on_used_points

log = logging.getLogger(__name__)

_LINEAR: Final = {
    "tetra10": "tetra",
    "wedge15": "wedge",
    "hexahedron20": "hexahedron",
    "triangle6": "triangle",
    "quad8": "quad",
}


def to_tetrahedra(mesh: VolumeMesh) -> VolumeMesh:
    """The mesh with every element cut into linear tetrahedra and every facet into triangles.

    Corner points keep their order; points that no tetrahedron has any more (mid-side nodes of quadratic elements) go.
    Every new element and facet has the tags and data of the one it comes from.
    """
    cells, rows = [], [np.empty(0, dtype=np.int64)]
    for kind, block, own in block_rows(mesh.cells):
        tets, row = element_tets(kind, block)
        cells.append(tets)
        rows.append(row + own.start)
    facets, facet_rows = [], [np.empty(0, dtype=np.int64)]
    for kind, block, own in block_rows(mesh.facets):
        quad = FACET_CORNERS[kind] == 4
        facets.append(quads_to_triangles(block) if quad else block[:, :3])
        facet_rows.append(np.repeat(np.arange(own.start, own.stop), 2 if quad else 1))
    row, facet_row = np.concatenate(rows), np.concatenate(facet_rows)
    triangles = {"triangle": np.concatenate(facets)} if facets else {}
    fields, number = on_used_points(mesh, {"tetra": np.concatenate(cells)}, triangles)
    return replace(
        mesh,
        region=mesh.region[row],
        facet_tag=mesh.facet_tag[facet_row],
        cell_data={name: np.asarray(values)[row] for name, values in mesh.cell_data.items()},
        facet_data={name: np.asarray(values)[facet_row] for name, values in mesh.facet_data.items()},
        purkinje=mesh.purkinje and mesh.purkinje.renumbered(number),
        **fields,
    )


def linear(mesh: VolumeMesh, reader: str) -> VolumeMesh:
    """The mesh with the corners of its elements alone, for a reader that knows no mid-side nodes.

    Points that are corners of no element go; the order of the others stays. A linear mesh comes back as it is.
    """
    if all(not ELEMENTS[kind].quadratic for kind in mesh.cells):
        return mesh
    log.warning("%s reads linear elements alone: mid-side nodes are left out", reader)
    cells = {_LINEAR.get(kind, kind): block[:, : ELEMENTS[kind].corners] for kind, block in mesh.cells.items()}
    facets = {_LINEAR.get(kind, kind): block[:, : FACET_CORNERS[kind]] for kind, block in mesh.facets.items()}
    fields, number = on_used_points(mesh, cells, facets)
    return replace(mesh, purkinje=mesh.purkinje and mesh.purkinje.renumbered(number), **fields)
