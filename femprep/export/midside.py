"""A mesh just read in; an error where its mid-side nodes lie at other edges than their own."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.optimize import linear_sum_assignment

from femprep.errors import InputError
from femprep.mesh.elements import ELEMENTS
from femprep.model import BoolArray, VolumeMesh

#: Elements of a type that are looked at, over all of them: a file has one order for a type.
_LOOKED_AT: Final = 1000
#: How much nearer the nodes are to the edges in that order: of sound elements, however curved, none is by far the best.
_NEARER: Final = 0.5


def require_own_edges(mesh: VolumeMesh) -> None:
    """Check that the mid-side nodes of quadratic elements are in the order of the edges.

    Formats differ in it (Exodus lists the vertical edges of a hexahedron before the upper ones, Gmsh the edges of a
    corner in turn), and not everyone who writes a file puts them in its order.

    Raises
    ------
    InputError
        In most elements of a type the mid-side nodes are far nearer to the middles of the edges in another order.
    """
    for kind, rows in mesh.cells.items():
        if ELEMENTS[kind].quadratic and len(rows):
            astray = _astray(mesh.points[rows[:: -(-len(rows) // _LOOKED_AT)]], kind)
            if 2 * np.count_nonzero(astray) > len(astray):
                raise InputError(
                    f"most {kind} have mid-side nodes that lie at other edges: the file has another order of nodes "
                    "than it is read in; convert it to .vtu by the program that made it"
                )


def _astray(nodes: np.ndarray, kind: str) -> BoolArray:
    """Whether the mid-side nodes of an element, of the nodes ``(n, p, 3)``, are nearer to its edges in another order.

    Each edge gets one node: on a thin curved element the middles of two edges are nearer to each other than to theirs.
    """
    element = ELEMENTS[kind]
    first, last = np.array(element.edges).T
    middles = (nodes[:, first] + nodes[:, last]) / 2.0
    away = np.linalg.norm(nodes[:, element.corners :, None] - middles[:, None], axis=-1)
    best = np.array([one[linear_sum_assignment(one)].sum() for one in away])
    return np.asarray(best < _NEARER * np.trace(away, axis1=1, axis2=2))
