"""A tagged mesh in, the number of elements through its wall out."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from femprep.mesh.elements import ELEMENTS, FACET_CORNERS
from femprep.mesh.least_corner import BlockParts, distinct_pairs
from femprep.model import IntArray, VolumeMesh, is_blood, tag_name
from femprep.model.blocks import chosen_rows, nodes_of


def elements_through_wall(mesh: VolumeMesh, edges: IntArray | None = None) -> IntArray:
    """Number of elements between each endocardial node and the epicardium.

    It is the number of edges on the shortest chain of element edges from the node to any epicardial node: every edge
    of the chain crosses one layer of elements, so that a wall swept in n layers has n. Mid-side nodes are left out.

    Parameters
    ----------
    mesh : VolumeMesh
        With facets tagged ``epi`` and ``endo`` (or ``endo_lv``, ``endo_rv``, ...).
    edges : (e, 2) array, optional
        Its edges, where they are known.

    Returns
    -------
    (k,) array
        A number per endocardial node, in the order of node numbers; -1 where no chain reaches the epicardium. Empty
        where the mesh has no endocardial or no epicardial facets.
    """
    inner = _nodes(mesh, lambda name: name == "endo" or name.startswith("endo_"))
    outer = _nodes(mesh, lambda name: name == "epi")
    if len(inner) == 0 or len(outer) == 0:
        return np.empty(0, dtype=np.int64)
    if edges is None:
        edges = mesh_edges(chosen_rows(mesh.cells, ~is_blood(mesh.region)))
    distance = np.full(len(mesh.points), -1, dtype=np.int64)
    distance[outer] = 0
    _spread(edges, distance)
    return distance[inner]


def _spread(edges: IntArray, distance: IntArray) -> None:
    """Count edges onward from where the distance is 0, in place; -1 where no chain leads."""
    step = 0
    while True:
        one, two = distance[edges].T
        # All edges with one end reached in the step before: the other end is one further.
        onward = np.append(edges[(one == step) & (two < 0), 1], edges[(two == step) & (one < 0), 0])
        if not len(onward):
            return
        step += 1
        distance[onward] = step
        edges = edges[(one < 0) | (two < 0)]


def mesh_edges(cells: Mapping[str, IntArray]) -> IntArray:
    """The edges of all elements of some blocks, each once, corners only, ``(e, 2)``, smaller number first."""
    return distinct_pairs([BlockParts(block, np.array(ELEMENTS[name].edges)) for name, block in cells.items()])


def _nodes(mesh: VolumeMesh, wanted: Callable[[str], bool]) -> IntArray:
    """Corner nodes of the facets whose tag's name is wanted."""
    chosen = [int(t) for t in np.unique(mesh.facet_tag) if wanted(tag_name(int(t)))]
    blocks = chosen_rows(mesh.facets, np.isin(mesh.facet_tag, chosen))
    return nodes_of({kind: block[:, : FACET_CORNERS[kind]] for kind, block in blocks.items()})
