"""Sets that a file has beside regions and facets in, what is told of those that a mesh has no place for out."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.export.deck.fibres import segment_of
from femprep.export.deck.names import facet_nodes, region_nodes
from femprep.export.deck.springs import RING
from femprep.mesh.elements import ELEMENTS, FACET_CORNERS
from femprep.model import IntArray, VolumeMesh

#: Key of ``info["source"]`` for what is left out beside elements of other types, in words.
UNREAD: Final = "also_left_out"
#: Facets of openCARP and of VTK.
_FACETS: Final = ("Tr", "Qd", "polygon", "triangle_strip", "pixel")
#: How much of a list of names is told.
_MOST: Final = 200


def no_elements(found: Iterable[str]) -> InputError:
    """What is wrong with a file of no volume elements, and what there is to do."""
    found = list(found)
    words = f"holds no volume elements (found {', '.join(found) or 'none at all'}); "
    if any(kind in FACET_CORNERS or kind in _FACETS for kind in found):
        words += (
            "it is a surface: femprep mesh --surface FILE (.vtp, .vtu, .vtk, .stl, .ply, .obj, .elem) meshes the wall "
        )
        words += "between endocardium and epicardium, one of them alone has no wall"
    else:
        words += f"give a mesh of {', '.join(ELEMENTS)}"
    return InputError(words)


def with_unread(mesh: VolumeMesh, what: str, names: Iterable[str]) -> VolumeMesh:
    """The mesh with words on what else of its file is left out, which :func:`read_mesh` makes one notice of."""
    listed = ", ".join(dict.fromkeys(names))
    if not listed:
        return mesh
    source = mesh.info.get("source", {})
    words = f"{what} {listed}" if len(listed) <= _MOST else f"{what} {listed[:_MOST]}..."
    return replace(mesh, info={**mesh.info, "source": {**source, UNREAD: [*source.get(UNREAD, ()), words]}})


def with_node_sets(mesh: VolumeMesh, sets: Mapping[str, IntArray | None]) -> VolumeMesh:
    """The mesh with words on sets of nodes, but for those of all nodes, and of a region or facets of their name.

    The basal ring of decks of ours is where two kinds of facets meet.

    Parameters
    ----------
    mesh : VolumeMesh
    sets : mapping of str to (n,) array or None
        Rows of the points of each, or None where they are not known.
    """
    return with_unread(
        mesh, "sets of nodes", [name for name, nodes in sets.items() if not _is_there(mesh, name, nodes)]
    )


def with_element_sets(
    mesh: VolumeMesh, what: str, sets: Mapping[str, Collection[int]], regions: Mapping[str, Collection[int]]
) -> VolumeMesh:
    """The mesh with words on sets of elements that are neither AHA segments nor all elements, or those of a region.

    Parameters
    ----------
    mesh : VolumeMesh
    what : str
        What the sets are called.
    sets, regions : mapping of str to collection of int
        Numbers of elements by name, those of all regions by their names in small letters.
    """
    whole = {number for own in regions.values() for number in own}
    lost = [
        name
        for name, own in sets.items()
        if segment_of(name) is None and {*own} not in (set(), whole, {*regions.get(name.lower(), ())})
    ]
    return with_unread(mesh, what, lost)


def _is_there(mesh: VolumeMesh, name: str, nodes: IntArray | None) -> bool:
    own = name.lower()
    if nodes is None or own == RING:
        return own == RING
    rows = np.unique(nodes)
    if len(rows) in (0, len(mesh.points)):
        return True
    alike = [region_nodes(mesh, tag) for other, tag in mesh.region_names.items() if other.lower() == own]
    for other, tag in mesh.facet_names.items():
        if other.lower() == own:
            alike += [facet_nodes(mesh, tag), facet_nodes(mesh, tag, corners=True)]
    return any(np.array_equal(rows, one) for one in alike)
