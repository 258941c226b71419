"""The element and facet types that meshes may have, by meshio's names, and how many nodes each has."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from femprep.errors import InputError
from femprep.model.arrays import IntArray

#: Nodes of each volume element.
ELEMENT_NODES: Final[Mapping[str, int]] = MappingProxyType(
    {"tetra": 4, "tetra10": 10, "wedge": 6, "wedge15": 15, "hexahedron": 8, "hexahedron20": 20}
)
#: Nodes of each facet.
FACET_NODES: Final[Mapping[str, int]] = MappingProxyType({"triangle": 3, "quad": 4, "triangle6": 6, "quad8": 8})


def require_types(blocks: Mapping[str, IntArray], known: Mapping[str, int], what: str) -> None:
    """Refuse blocks of other types than some, or of another number of nodes than their type has.

    Raises
    ------
    InputError
    """
    for kind, block in blocks.items():
        if kind not in known:
            raise InputError(f"{what} type {kind!r} is not known; known are {', '.join(known)}")
        if block.shape[1] != known[kind]:
            raise InputError(f"a {kind} has {block.shape[1]} nodes, expected {known[kind]}")
