"""A mesh of tetrahedra with flat ones on its smooth surfaces in, the mesh without them out.

A tetrahedron two or three of whose faces lie on one smooth surface, and so all its corners, is as flat as the surface:
moving its nodes along the surface mends nothing, and its children on the surface are twice as flat with each level. Its
other faces, whose nodes lie on the same surface, become the boundary, and refinement puts that onto the surface.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from femprep.mesh.elements import ELEMENTS, match_facets
from femprep.model import VolumeMesh, frozen
from femprep.volume.optimise import tet_quality

#: Rounds of taking away: flat elements lie upon each other two or three deep at most.
_ROUNDS: Final = 8


def without_flat(mesh: VolumeMesh, tags: list[int], poor: float = np.inf) -> tuple[VolumeMesh, int]:
    """Take tetrahedra with two boundary facets of one of some tags away, and those under them that then are such.

    Parameters
    ----------
    mesh : VolumeMesh
        One block ``"tetra"``, triangles as facets; no data but regions and tags.
    tags : list of int
        Tags of smooth surfaces that bound the mesh on one side alone.
    poor : float
        Quality below which one is taken away, of :func:`femprep.volume.optimise.tet_quality`; each, if not given.

    Returns
    -------
    mesh : VolumeMesh
    count : int
        How many were taken away.
    """
    total = 0
    for _ in range(_ROUNDS):
        mesh, count = _without(mesh, tags, poor)
        total += count
        if count == 0:
            break
    return mesh, total


def _without(mesh: VolumeMesh, tags: list[int], poor: float) -> tuple[VolumeMesh, int]:
    """One round: of tetrahedra that share a node, the poorest alone."""
    cells, facets, tag = mesh.cells["tetra"], mesh.facets["triangle"], mesh.facet_tag
    quality = tet_quality(mesh.points, cells)
    bad = np.flatnonzero(quality < poor)
    if not len(bad):
        return mesh, 0
    element, face = match_facets({"tetra": cells[bad]}, mesh.facets)
    own = np.flatnonzero(element >= 0)
    of_element: dict[int, list[int]] = {}
    for row in own.tolist():
        of_element.setdefault(int(bad[element[row]]), []).append(row)
    boundary = np.sort(facets[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    keys = np.unique(boundary[:, 0] * len(mesh.points) + boundary[:, 1])
    gone: list[int] = []
    dropped: list[int] = []
    added: list[tuple[list[int], int]] = []
    touched: set[int] = set()
    for number, rows in sorted(of_element.items(), key=lambda item: float(quality[item[0]])):
        nodes = cells[number].tolist()
        own_tags = {int(tag[row]) for row in rows}
        if len(rows) not in (2, 3) or len(own_tags) > 1 or not own_tags <= set(tags) or touched & set(nodes):
            continue
        if len(rows) == 2:
            ridge = set(facets[rows[0]].tolist()) & set(facets[rows[1]].tolist())
            valley = sorted(set(nodes) - ridge)
            key = valley[0] * len(mesh.points) + valley[1]
            at = int(np.searchsorted(keys, key))
            if at < len(keys) and keys[at] == key:  # a boundary edge already: two sheets would touch in it
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
    new = np.concatenate([facets[left], np.array([nodes for nodes, _ in added])])
    # The top of a flat pyramid, three faces of which were facets, is a node of nothing else.
    used = np.zeros(len(mesh.points), dtype=np.bool_)
    used[cells[kept]] = True
    number_of = np.cumsum(used) - 1
    found = replace(
        mesh,
        points=frozen(mesh.points[used]),
        cells={"tetra": frozen(number_of[cells[kept]])},
        region=mesh.region[kept],
        facets={"triangle": number_of[new]},
        facet_tag=np.concatenate([tag[left], np.array([t for _, t in added], dtype=np.int32)]),
    )
    if mesh.nested is not None:
        found = replace(found, nested=mesh.nested.part(found, np.flatnonzero(used), kept))
    return found, len(gone)
