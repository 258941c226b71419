"""A tagged mesh in, its facets and the faces of elements beside them out, numbered: equal numbers, equal corners."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from femprep.mesh.elements import ELEMENTS, FACET_CORNERS, element_faces
from femprep.mesh.numbering import set_numbers
from femprep.model import BoolArray, IntArray, VolumeMesh, is_blood
from femprep.model.blocks import block_rows, chosen_rows


@dataclass(frozen=True)
class FaceTable:
    """The tagged facets of a mesh, and all faces that may lie on one or between wall and blood.

    Attributes
    ----------
    rings : (f, 3) or (f, 4) array
        Corners of each face, outward from its element; -1 after a triangle's third where there are quadrilaterals.
    element : (f,) array
        The element of each face.
    number : (f,) array
    facets : (n_facets, 3) or (n_facets, 4) array
        Corners of the tagged facets, in the same way.
    facet_number : (n_facets,) array
    count : (k,) array
        Number of faces of each number.
    """

    rings: IntArray
    element: IntArray
    number: IntArray
    facets: IntArray
    facet_number: IntArray
    count: IntArray

    @cached_property
    def first(self) -> IntArray:
        """The first face of each number, ``(k,)``; 0 where there is none."""
        return self._place(slice(None, None, -1))

    @cached_property
    def last(self) -> IntArray:
        """The last face of each number, ``(k,)``; 0 where there is none."""
        return self._place(slice(None))

    def _place(self, way: slice) -> IntArray:
        found = np.zeros(len(self.count), dtype=np.int64)
        found[self.number[way]] = np.arange(len(self.number))[way]
        return found


def face_table(mesh: VolumeMesh) -> FaceTable:
    """Number the facets of a mesh, and the faces of the few elements that may have them or lie beside other tissue."""
    near = _beside(mesh)
    cells, numbered = chosen_rows(mesh.cells, near), np.flatnonzero(near)
    faces = element_faces(cells)
    corners = max([3, *(FACET_CORNERS[kind] for kind in (*faces, *mesh.facets))])
    own = corner_rings({kind: found.nodes for kind, found in faces.items()}, corners)
    facets = corner_rings(mesh.facets, corners)
    number = set_numbers(own, facets)
    face, facet = number[: len(own)], number[len(own) :]
    element = np.concatenate([np.empty(0, dtype=np.int64), *(found.element for found in faces.values())])
    count = np.bincount(face, minlength=int(number.max(initial=-1)) + 1)
    return FaceTable(own, numbered[element], face, facets, facet, count)


def _beside(mesh: VolumeMesh) -> BoolArray:
    """Elements with three or more corners that are those of facets, or of wall and blood at once, ``(n,)``."""
    marked = np.zeros(len(mesh.points), dtype=np.bool_)
    blood = is_blood(mesh.region)
    if blood.any():
        sides = np.zeros((2, len(mesh.points)), dtype=np.bool_)
        for _, block, rows in block_rows(mesh.cells):
            for side in (0, 1):
                sides[side, block[blood[rows] == side]] = True
        marked = sides[0] & sides[1]
    for block in mesh.facets.values():
        marked[block] = True
    near = [marked[block[:, : ELEMENTS[name].corners]].sum(axis=1) >= 3 for name, block in mesh.cells.items()]
    return np.concatenate([np.empty(0, dtype=np.bool_), *near])


def corner_rings(blocks: Mapping[str, IntArray], corners: int) -> IntArray:
    """Corners of all faces of some blocks ``(f, corners)``, -1 after those a face has."""
    found = np.full((sum(map(len, blocks.values())), corners), -1, dtype=np.int64)
    for kind, block, rows in block_rows(blocks):
        found[rows, : FACET_CORNERS[kind]] = block[:, : FACET_CORNERS[kind]]
    return found
