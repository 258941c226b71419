"""Element type in, how it is cut into eight of its kind out: where the new nodes lie and which of them each child has.

The nodes of the cut (its lattice) are the corners, the middles of the edges in the order of the quadratic element, the
centres of the quadrilateral faces, and the centre of a hexahedron. A tetrahedron leaves an octahedron between the four
at its corners, which falls into four along one of its three diagonals.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from femprep.mesh.elements import ELEMENTS, QUADRATIC
from femprep.mesh.measures.sample_points import family, reference_nodes
from femprep.model import FloatArray, IntArray

#: Children of a facet over its corners, the middles of its sides, and the centre of a quadrilateral.
FACET_CHILDREN: Final = {
    "triangle": np.array([(0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)]),
    "quad": np.array([(0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3)]),
}
#: Opposite corners of the octahedron inside a tetrahedron, and the ring of the other four.
_DIAGONALS: Final = (((4, 9), (5, 6, 7, 8)), ((5, 7), (4, 6, 9, 8)), ((6, 8), (4, 5, 9, 7)))


@dataclass(frozen=True)
class Cut:
    """How the elements of one shape are cut.

    Attributes
    ----------
    lattice : (l, 3) array
        Reference coordinates of the lattice.
    quads : tuple of tuples
        Corners of each quadrilateral face, whose centres follow the middles of the edges.
    children : (d, 8, corners) array
        Lattice nodes of each child, for each way to cut: three diagonals of a tetrahedron, one way for others.
    """

    lattice: FloatArray
    quads: tuple[tuple[int, ...], ...]
    children: IntArray


@cache
def cut_of(name: str) -> Cut:
    """The cut of an element type, linear or quadratic."""
    shape = family(name)
    nodes = reference_nodes(QUADRATIC[shape])
    corners = ELEMENTS[shape].corners
    quads = tuple(face for face in ELEMENTS[shape].faces if len(face) == 4)
    centres = [nodes[list(face)].mean(axis=0) for face in quads]
    body = [nodes[:corners].mean(axis=0)] if shape == "hexahedron" else []
    lattice = np.array([*nodes, *centres, *body])
    if shape == "tetra":
        children = np.array([_tetrahedra(lattice, diagonal, ring) for diagonal, ring in _DIAGONALS])
    else:
        children = _halved(lattice, shape)[None]
    for array in (lattice, children):
        array.setflags(write=False)
    return Cut(lattice, quads, children)


def _tetrahedra(lattice: FloatArray, diagonal: tuple[int, int], ring: tuple[int, ...]) -> list[list[int]]:
    """The four children at the corners, then the four around a diagonal, all positive."""
    around = [[*diagonal, ring[i], ring[(i + 1) % 4]] for i in range(4)]
    found = [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3], *around]
    for child in found:
        a, b, c, d = lattice[child]
        if np.linalg.det([b - a, c - a, d - a]) < 0:
            child[2], child[3] = child[3], child[2]
    return found


def _halved(lattice: FloatArray, shape: str) -> IntArray:
    """Children of a wedge or hexahedron: halves of the parent, moved to each of the places that halves have."""
    number = {tuple(np.round(at, 6)): i for i, at in enumerate(lattice.tolist())}
    corner = lattice[: ELEMENTS[shape].corners]
    places = [[number[tuple(np.round((start + other) / 2, 6))] for other in corner] for start in corner]
    if shape == "hexahedron":
        return np.array(places)
    # The middle triangle of a wedge faces the other way and lies at no corner: it is turned in the plane, not moved.
    low, middle, high = (6, 7, 8), (15, 16, 17), (9, 10, 11)
    return np.array([*places[:3], [*low, *middle], *places[3:], [*middle, *high]])
