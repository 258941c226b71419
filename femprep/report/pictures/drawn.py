"""A mesh of many elements in, those of them that its page draws out: the surface, and what cuts at some heights show.

The view takes about twenty bytes an element, and most elements have no visible face. Above ``MOST`` elements the page
therefore holds only those at the boundary, at borders between regions and segments (each can be hidden on the page),
and on both sides of cuts at a few heights.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.anatomy.part import part_of
from femprep.mesh.elements import ELEMENTS, boundary_faces
from femprep.model import BoolArray, FloatArray, IntArray, TagArray, VolumeMesh
from femprep.model.blocks import block_rows, chosen_rows, nodes_of

#: Elements above which a page holds a part of them.
MOST: Final = 250_000
#: Elements that further cuts than the middle ones may bring the part to.
_PART: Final = 400_000
#: Heights of cuts, shares of the mesh's extent, in the order in which they are added.
_CUTS: Final = (0.5, 0.25, 0.75, 0.375, 0.625, 0.125, 0.875)


@dataclass(frozen=True, eq=False)
class Drawn:
    """What a page draws of a mesh.

    Attributes
    ----------
    mesh : VolumeMesh
        The mesh, or some of its elements.
    elements, nodes : (n,), (p,) arrays
        Which of the whole mesh these are, ascending.
    cuts : list of float
        Where it can be cut along each axis, shares of its extent; empty where everywhere.
    """

    mesh: VolumeMesh
    elements: IntArray
    nodes: IntArray
    cuts: list[float]


def drawn(mesh: VolumeMesh, axes: Sequence[Sequence[float]], always: Iterable[int], most: int = MOST) -> Drawn:
    """Choose the elements that a page draws.

    Parameters
    ----------
    mesh : VolumeMesh
    axes : three unit vectors
        Along which it can be cut.
    always : iterable of int
        Elements to draw in any case.
    most : int
        Elements above which some are chosen.
    """
    if mesh.n_cells <= most:
        return Drawn(mesh, np.arange(mesh.n_cells), np.arange(len(mesh.points)), [])
    corners = {kind: block[:, : ELEMENTS[kind].corners] for kind, block in mesh.cells.items()}
    kept = np.zeros(mesh.n_cells, dtype=np.bool_)
    kept[list(always)] = True
    for faces in boundary_faces(mesh.cells).values():
        kept[faces.element] = True
    labels = mesh.region, np.asarray(mesh.cell_data.get("aha", mesh.region))
    touched = np.logical_or(*(_borders(corners, label, len(mesh.points)) for label in labels))
    extents = [_extents(corners, mesh.points @ np.asarray(axis)) for axis in axes]
    cuts: list[float] = []
    for share in _CUTS:
        wanted = touched.copy()
        for low, high in extents:
            at = low.min() + share * (high.max() - low.min())
            wanted[nodes_of(chosen_rows(corners, (low <= at) & (high >= at)))] = True
        # A cut goes through one at least of two elements with a common face on either side of it, and three nodes of
        # the other are those of that face.
        found = kept | np.concatenate([sum(wanted[node] for node in block.T) >= 3 for block in corners.values()])
        if cuts and found.sum() > _PART:
            break
        kept, touched = found, wanted
        cuts.append(share)
    part, elements, nodes, _ = part_of(mesh, kept)
    return Drawn(part, elements, nodes, sorted(cuts))


def _borders(corners: dict[str, IntArray], label: TagArray, count: int) -> BoolArray:
    """Nodes of elements of more than one label, a mask of ``count``."""
    low, high = np.full(count, label.max()), np.full(count, label.min())
    for _, block, rows in block_rows(corners):
        np.minimum.at(low, block, label[rows, None])
        np.maximum.at(high, block, label[rows, None])
    return low < high


def _extents(corners: dict[str, IntArray], height: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest corner of each element, ``(n,)`` each."""
    ends = np.minimum, np.maximum
    low, high = ([end.reduce([height[node] for node in block.T]) for block in corners.values()] for end in ends)
    return np.concatenate(low), np.concatenate(high)
