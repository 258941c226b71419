"""A mesh of several parts in, the same with its parts joined where their nodes coincide out."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from femprep.annotation.shell import Shell
from femprep.errors import InputError
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import components
from femprep.model import Notice, VolumeMesh, noted
from femprep.model.blocks import nodes_of
from femprep.model.notice import spot
from femprep.model.used_points import on_used_points

#: Nodes coincide that are nearer than this share of a typical edge of the boundary.
_SAME: Final = 1e-4
#: Facets of two parts touch that are nearer than this share of an edge; parts touch in this share of one's facets.
_NEAR, _TOUCHING = 0.1, 0.05


def with_parts_joined(mesh: VolumeMesh, shell: Shell) -> VolumeMesh:
    """The mesh with one node in place of several that coincide, where parts border on each other."""
    rows = nodes_of(shell.facets)
    pairs = cKDTree(mesh.points[rows]).query_pairs(_SAME * shell.edge, output_type="ndarray")
    if not len(pairs):
        return mesh
    place = components(pairs[:, 0], pairs[:, 1], len(rows))
    _, first, group = np.unique(place, return_index=True, return_inverse=True)
    number = np.arange(len(mesh.points))
    number[rows] = rows[first[group]]
    joined = ({kind: number[block] for kind, block in blocks.items()} for blocks in (mesh.cells, mesh.facets))
    fields, _ = on_used_points(mesh, *joined)
    words = f"parts of the mesh were joined: {len(mesh.points) - len(fields['points'])} nodes coincide with others"
    return replace(mesh, **fields, info=noted(mesh.info, Notice.of("repaired", words)))


def require_joined(shell: Shell) -> None:
    """Refuse parts that touch without common nodes: what lies between them is no boundary of the heart.

    Raises
    ------
    InputError
    """
    piece = shell.pieces()
    for k in range(1, int(piece.max()) + 1):
        mine = piece[shell.facet_of] == k
        own = shell.triangles[mine]
        centre = shell.points[own].mean(axis=1)
        finder = ClosestFinder(shell.points, shell.triangles[~mine])
        found = finder(centre, within=np.full(len(own), _NEAR * shell.edge))
        joined = (found.nodes[:, :, None] == own[:, None, :]).any(axis=(1, 2))
        near = np.isfinite(found.distance) & ~joined
        if np.count_nonzero(near) > _TOUCHING * len(own):
            raise InputError(
                f"parts of the mesh touch near {spot(centre[near][0])} without common nodes, so that the "
                "boundary of the heart is not known; join the parts where the mesh was made"
            )
