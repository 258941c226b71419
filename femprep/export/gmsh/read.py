"""A Gmsh file in, its volume mesh out: nodes as many as it says, data by the numbers they are of."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from femprep.export.deck.units import units_of
from femprep.export.deck.unread import with_unread
from femprep.export.foreign import from_meshio
from femprep.export.gmsh.counts import node_numbers
from femprep.export.gmsh.groups import choose_groups, group_names, whole_groups
from femprep.export.gmsh.rows import by_their_numbers, require_heads
from femprep.export.through_meshio import meshio_mesh
from femprep.model import VolumeMesh
from femprep.model.notice import noted


def read(path: Path) -> VolumeMesh:
    """Read a ``.msh`` file.

    Raises
    ------
    FileError
        It is damaged.
    """
    nodes = node_numbers(path)
    require_heads(path)
    with whole_groups():
        found = meshio_mesh(path)
    by_their_numbers(path, found, nodes)
    told = choose_groups(found)
    found.names, found.field_data = group_names(found), {}
    mesh, scale = from_meshio(found), units_of(path).per_mm
    less = [name for dimension in (0, 1) for name in found.names.get(dimension, {}).values()]
    mesh = with_unread(mesh, "groups of points or lines", less)
    return replace(mesh, points=mesh.points / scale, info=noted(mesh.info, *told))
