"""A Gmsh file in, its volume mesh out: nodes as many as it says, data by the numbers they are of."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.export.deck.groups import naming_groups
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
    with _ungrouped():
        found = meshio_mesh(path)
    by_their_numbers(path, found, nodes)
    told = _choose(found)
    mesh, scale = from_meshio(found), units_of(path).per_mm
    return replace(mesh, points=mesh.points / scale, info=noted(mesh.info, *told))


@contextlib.contextmanager
def _ungrouped() -> Iterator[None]:
    """While this lasts, entities of no physical group (``Mesh.SaveAll``) are of number 0: meshio refuses them else."""
    import meshio.gmsh._gmsh41 as module

    reading = module._read_entities

    def read_entities(*given: Any) -> Any:
        tags, bounds = reading(*given)
        some = any(own for entities in tags for own in entities.values())
        return tuple({n: own or [0] * some for n, own in entities.items()} for entities in tags), bounds

    vars(module)["_read_entities"] = read_entities
    try:
        yield
    finally:
        vars(module)["_read_entities"] = reading


def _choose(mesh: Any) -> list[Notice]:
    """Give each element the number of the physical group that names it; meshio takes the first of its entity.

    A number below 0 stands for the same group, turned over.
    """
    told: list[Notice] = []
    if _TAGS not in mesh.cell_data:
        return told
    tags = [np.abs(own) for own in mesh.cell_data[_TAGS]]
    for dimension in (2, 3):
        here = [i for i, block in enumerate(mesh.cells) if block.dim == dimension]
        known = {name: int(entry[0]) for name, entry in mesh.field_data.items() if entry[1] == dimension}
        sizes = [len(mesh.cells[i].data) for i in here]
        starts = np.cumsum([0, *sizes])
        groups = [
            (name, np.concatenate([start + np.asarray(mesh.cell_sets[name][i], int) for i, start in zip(here, starts)]))
            for name in known
            if here and name in mesh.cell_sets
        ]
        chosen, said = naming_groups(groups, int(starts[-1]))
        told += said
        numbers = np.array([known[name] for name, _ in groups], dtype=np.int64)
        for i, own in zip(here, np.split(chosen, starts[1:-1])):
            tags[i][own >= 0] = numbers[own[own >= 0]]
    mesh.cell_data[_TAGS] = tags
    return told
