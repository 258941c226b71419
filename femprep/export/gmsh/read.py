"""A Gmsh file in, its volume mesh out: nodes as many as it says, data by the numbers they are of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.export.deck.units import units_of
from femprep.export.foreign import from_meshio
from femprep.export.gmsh.counts import node_numbers
from femprep.export.gmsh.rows import by_their_numbers, require_heads
from femprep.export.through_meshio import meshio_mesh
from femprep.model import VolumeMesh
from femprep.model.notice import Notice, noted

#: What meshio calls the number of the first physical group of each element.
_TAGS: Final = "gmsh:physical"


def read(path: Path) -> VolumeMesh:
    """Read a ``.msh`` file, of Gmsh or of Ansys.

    Raises
    ------
    FileError
        It is damaged.
    """
    nodes = node_numbers(path)
    require_heads(path)
    found = meshio_mesh(path)
    by_their_numbers(path, found, nodes)
    if _TAGS in found.cell_data:  # one below 0 stands for the same group, turned over
        found.cell_data[_TAGS] = [np.abs(tags) for tags in found.cell_data[_TAGS]]
    mesh, scale = from_meshio(found), units_of(path).per_mm
    return replace(mesh, points=mesh.points / scale, info=noted(mesh.info, *_shared(found)))


def _shared(mesh: Any) -> Iterator[Notice]:
    """Groups that lack elements, as these are in another one too: a mesh of ours has one region for each."""
    tags = mesh.cell_data.get(_TAGS, ())
    for name, (number, dimension) in mesh.field_data.items():
        all_of_it = sum(map(len, mesh.cell_sets.get(name, ())))
        own = sum(
            int(np.count_nonzero(one == number)) for one, block in zip(tags, mesh.cells) if block.dim == dimension
        )
        if own < all_of_it:
            words = f"the group {name!r} lacks {{amount}} of its {all_of_it} elements, which are in another one as well"
            yield Notice.of("left out", words, amount=all_of_it - own)
