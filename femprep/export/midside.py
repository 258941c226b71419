"""A mesh just read in; an error where its mid-side nodes lie at other edges than their own."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.mesh.elements import ELEMENTS
from femprep.model import BoolArray, VolumeMesh

#: Elements of a type that are looked at, over all of them: a file has one order for a type.
_LOOKED_AT: Final = 1000


def require_own_edges(mesh: VolumeMesh) -> None:
    """Check that the mid-side nodes of quadratic elements are in the order of the edges.

    Formats differ in it (Exodus lists the vertical edges of a hexahedron before the upper ones, PERMAS corners and
    mid-side nodes in turn), and meshio does not always put them in order.

    Raises
    ------
    InputError
        In most elements of a type a mid-side node is nearer to the middle of another edge.
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
    """Whether a mid-side node of an element, of the nodes ``(n, p, 3)``, is nearer to another edge than to its own."""
    element = ELEMENTS[kind]
    first, last = np.array(element.edges).T
    middles = (nodes[:, first] + nodes[:, last]) / 2.0
    away = np.linalg.norm(nodes[:, element.corners :, None] - middles[:, None], axis=-1)
    own = np.diagonal(away, axis1=1, axis2=2)
    return np.asarray(np.any(away.min(axis=2) < own * (1.0 - 1e-9), axis=1))
