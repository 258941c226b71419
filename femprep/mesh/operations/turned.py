"""Elements or facets in, the same nodes in the order that turns them inside out: right again after a mirroring."""

from __future__ import annotations

from typing import Final

from femprep.mesh.elements import ELEMENTS, FACET_CORNERS
from femprep.model import IntArray

#: Corners in turned order, by their number.
_CORNERS: Final = {4: (1, 0, 2, 3), 6: (0, 2, 1, 3, 5, 4), 8: (0, 3, 2, 1, 4, 7, 6, 5)}


def turned_cells(name: str, block: IntArray) -> IntArray:
    """Elements ``(m, p)`` of a type, each turned."""
    kind = ELEMENTS[name]
    order = list(_CORNERS[kind.corners])
    if kind.quadratic:
        number = {frozenset(edge): kind.corners + k for k, edge in enumerate(kind.edges)}
        order += [number[frozenset((order[i], order[j]))] for i, j in kind.edges]
    return block[:, order]


def turned_facets(name: str, block: IntArray) -> IntArray:
    """Facets ``(m, p)`` of a type, each seen from its other side."""
    corners = FACET_CORNERS[name]
    order = [0, *range(corners - 1, 0, -1)]
    if block.shape[1] > corners:
        order += list(range(2 * corners - 1, corners - 1, -1))
    return block[:, order]
