"""XDMF of several grids, as dolfinx writes it, in: the first is the mesh, others are tags of elements and facets."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from femprep.errors import InputError
from femprep.export.turned import outward_facets, turned_tetrahedra
from femprep.export.xdmf.grids import attributes_of, kind_of, tags_of, topology_of, values_of
from femprep.mesh.elements import ELEMENTS, FACET_CORNERS
from femprep.model import IntArray, VolumeMesh
from femprep.model.notice import Notice, noted


def read_tagged(grids: Sequence[ElementTree.Element], path: Path, steps: int = 1) -> VolumeMesh:
    """Read a mesh with its tags: of elements the first ones are regions, others data; of facets the first ones count.

    Tags may be of some elements, in any order: they are found by their nodes. What is neither, such as tags of edges,
    is left out, and told; of several steps in time the first is given.

    Raises
    ------
    InputError
        The first grid is no mesh of volume elements, or tags are of elements that it does not have.
    """
    whole, *others = grids
    kind, cells = topology_of(whole, path)
    if kind not in ELEMENTS:
        raise InputError(f"its first grid is of {kind}, expected a mesh of {', '.join(ELEMENTS)}")
    region, data, left_out = None, dict(attributes_of(whole, "Cell", path)), []
    facets: dict[str, IntArray] = {}
    facet_tag = np.empty(0, dtype=np.int32)
    for grid in others:
        name, own = grid.get("Name") or "tags", kind_of(grid)
        attribute = next((one for one in grid.findall("Attribute") if one.get("Center") == "Cell"), None)
        if attribute is not None and own == kind:
            tags = np.zeros(len(cells), dtype=np.int32)
            tags[places(cells, topology_of(grid, path)[1], name)] = tags_of(attribute, path)
            if region is None:
                region = tags
            else:
                data[name] = tags
        elif attribute is not None and own in FACET_CORNERS and not facets:
            facets, facet_tag = dict([topology_of(grid, path)]), tags_of(attribute, path)
        else:
            left_out.append(name)
    told = [Notice.of("left out", f"grids {', '.join(left_out)[:200]} of the file are left out")] if left_out else []
    if steps > 1:
        told.append(Notice.of("left out", "of {amount} steps in time the first is read", amount=steps))
    mesh = VolumeMesh(
        points=values_of(whole.find("Geometry"), path),
        cells={kind: cells},
        region=np.zeros(len(cells), dtype=np.int32) if region is None else region,
        facets=facets,
        facet_tag=facet_tag,
        cell_data=data,
        point_data=attributes_of(whole, "Node", path),
        info=noted({"source": {"region": "grids", "facet_tag": "grids", "left_out": []}}, *told),
    )
    return outward_facets(turned_tetrahedra(mesh))


def places(cells: IntArray, rows: IntArray, name: str) -> IntArray:
    """Which elements some rows of nodes are."""
    both = np.sort(np.concatenate([cells, rows]), axis=1)
    _, which = np.unique(both, axis=0, return_inverse=True)
    at = np.full(which.max() + 1, -1, dtype=np.int64)
    at[which.ravel()[: len(cells)]] = np.arange(len(cells))
    found = at[which.ravel()[len(cells) :]]
    if np.any(found < 0):
        raise InputError(f"its {name!r} tags an element that the mesh does not have")
    return found
