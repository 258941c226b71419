"""The fields of fibre rules at element centres, for tests that compare directions with them."""

from __future__ import annotations

from femprep.anatomy.laplace.fem import LinearElements
from femprep.anatomy.rules import Sites


def at_cells(space: LinearElements, nodes: Sites) -> Sites:
    """The fields at the centres of all elements."""
    return Sites(*(space.to_cells(getattr(nodes, name)) for name in nodes.__dataclass_fields__))
