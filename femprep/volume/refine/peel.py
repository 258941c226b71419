"""A mesh of tetrahedra with flat ones on its smooth surfaces in, the mesh without them out.

A tetrahedron two of whose faces lie on one smooth surface, and all whose corners do, is as flat as the surface: moving
its nodes along the surface mends nothing, and its children are as flat. It is taken away where it is poor; its other
two faces, whose nodes lie on the same surface, become the boundary, and refinement puts that onto the surface.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from femprep.mesh.elements import ELEMENTS, match_facets
from femprep.model import VolumeMesh
from femprep.volume.optimise import tet_quality


def without_flat(mesh: VolumeMesh, tags: list[int], poor: float) -> tuple[VolumeMesh, int]:
    """Take poor tetrahedra with two boundary facets of one of some tags away.

    Parameters
    ----------
    mesh : VolumeMesh
        One block ``"tetra"``, triangles as facets, no other data.
    tags : list of int
        Tags of smooth surfaces that bound the mesh on one side alone.
    poor : float
        Quality below which one is taken away, of :func:`femprep.volume.optimise.tet_quality`.

    Returns
    -------
    mesh : VolumeMesh
    count : int
        How many were taken away.
    """
    cells, facets, tag = mesh.cells["tetra"], mesh.facets["triangle"], mesh.facet_tag
    quality = tet_quality(mesh.points, cells)
    element, face = match_facets(mesh.cells, mesh.facets)
    owned = np.flatnonzero(element >= 0)
    bad = owned[quality[element[owned]] < poor]
    of_element: dict[int, list[int]] = {}
    for row in bad.tolist():
        of_element.setdefault(int(element[row]), []).append(row)
    boundary = {tuple(sorted(pair)) for facet in facets.tolist() for pair in zip(facet, facet[1:] + facet[:1])}
    gone: list[int] = []
    dropped: list[int] = []
    added: list[tuple[list[int], int]] = []
    touched: set[int] = set()
    for number, rows in sorted(of_element.items(), key=lambda item: quality[item[0]]):
        if len(rows) != 2 or tag[rows[0]] != tag[rows[1]] or int(tag[rows[0]]) not in tags:
            continue
        nodes = cells[number].tolist()
        ridge = set(facets[rows[0]].tolist()) & set(facets[rows[1]].tolist())
        valley = sorted(set(nodes) - ridge)
        if len(valley) != 2 or tuple(valley) in boundary or touched & set(nodes):
            continue
        gone.append(number)
        dropped += rows
        touched |= set(nodes)
        for other in sorted(set(range(4)) - {int(face[row]) for row in rows}):
            # A face of what is taken away is wound out of it, into what stays: turned round it is the boundary.
            inner = ELEMENTS["tetra"].faces[other]
            added.append(([nodes[inner[0]], nodes[inner[2]], nodes[inner[1]]], int(tag[rows[0]])))
    if not gone:
        return mesh, 0
    kept, left = np.delete(np.arange(len(cells)), gone), np.delete(np.arange(len(facets)), dropped)
    new = np.array([nodes for nodes, _ in added])
    found = replace(
        mesh,
        cells={"tetra": cells[kept]},
        region=mesh.region[kept],
        facets={"triangle": np.concatenate([facets[left], new])},
        facet_tag=np.concatenate([tag[left], np.array([t for _, t in added], dtype=np.int32)]),
    )
    return found, len(gone)
