"""What meshio read of a MED file in; a volume mesh out: nodes in our order, groups as regions and facet tags."""

from __future__ import annotations

import json
import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from femprep.errors import FileError
from femprep.export.deck.groups import naming_groups
from femprep.export.deck.units import UNITS
from femprep.export.deck.unread import with_node_sets
from femprep.export.foreign import from_meshio
from femprep.export.med.write import _VERDICT, MED_ORDER
from femprep.mesh.elements import ELEMENTS
from femprep.model import IntArray, VolumeMesh
from femprep.model.notice import Notice, noted
from femprep.model.verdict import VERDICT

log = logging.getLogger(__name__)


def unit_of(path: Path) -> str | None:
    """Unit of length that a MED file names; None where it names none that is known."""
    import h5py

    with h5py.File(path, "r") as file:
        for mesh in file["ENS_MAA"].values():
            name = bytes(mesh.attrs.get("UNI", b"")).decode("latin-1")[:16].strip("\0 ")
            if name in UNITS:
                return name
    return None


def _verdict_in(path: Path) -> dict[str, Any]:
    """What a MED file of ours keeps of the mesh's verdict, as ``info`` has it; empty for anyone else's."""
    import h5py

    with h5py.File(path, "r") as file:
        kept = [mesh.attrs[_VERDICT] for mesh in file["ENS_MAA"].values() if _VERDICT in mesh.attrs]
    return {VERDICT: json.loads(bytes(kept[0]))} if kept else {}


def read(path: Path, mesh: Any) -> VolumeMesh:
    """The mesh that meshio read from a MED file, its nodes in our order, its groups as regions and facet tags.

    meshio writes MED files with its own node order; where the proper order turns every element inside out, the file
    is taken to be one of those.

    Raises
    ------
    FileError
        The file has no volume elements.
    """
    for block in mesh.cells:
        if block.type in MED_ORDER and len(block.data):
            turned = np.asarray(block.data)[:, list(MED_ORDER[block.type])]
            if not np.all(_inside_out(turned, np.asarray(mesh.points), block.type)):
                block.data = turned
            else:
                log.info("%s: %s are in meshio's node order", path, block.type)
    if not any(block.type in ELEMENTS for block in mesh.cells):
        raise FileError(f"{str(path)!r} holds no volume elements")
    told = _choose(mesh)
    found = from_meshio(mesh)
    points = found.points / UNITS[unit_of(path) or "mm"].per_mm
    data = {name: values for name, values in found.point_data.items() if name != "point_tags"}
    found = replace(found, points=points, point_data=data, info=noted({**found.info, **_verdict_in(path)}, *told))
    return with_node_sets(found, _node_groups(mesh))


def _node_groups(mesh: Any) -> dict[str, IntArray]:
    """Rows of the points of each group of nodes."""
    groups = getattr(mesh, "point_tags", {})
    own = np.asarray(mesh.point_data.get("point_tags", ()))
    names = {name for listed in groups.values() for name in listed}
    return {
        name: np.flatnonzero(np.isin(own, [tag for tag, listed in groups.items() if name in listed]))
        for name in sorted(names)
    }


def _choose(mesh: Any) -> list[Notice]:
    """Leave each family the group that names its elements; a region names one that is in an AHA segment, too."""
    families = {
        tag: [name for name in names if not name.startswith("aha_")]
        for tag, names in getattr(mesh, "cell_tags", {}).items()
    }
    told: list[Notice] = []
    for dimension in (2, 3) if "cell_tags" in mesh.cell_data else ():
        here = [i for i, block in enumerate(mesh.cells) if block.dim == dimension]
        own = np.concatenate([np.empty(0, dtype=np.int64), *(mesh.cell_data["cell_tags"][i] for i in here)])
        of = {tag: names for tag, names in families.items() if tag in own}
        names = list(dict.fromkeys(name for tag in of for name in of[tag]))
        rows = {name: np.flatnonzero(np.isin(own, [tag for tag in of if name in of[tag]])) for name in names}
        chosen, said = naming_groups(list(rows.items()), len(own))
        told += said
        for tag in of:
            number = chosen[np.flatnonzero(own == tag)[0]]
            families[tag] = [names[number]] if number >= 0 else []
    mesh.cell_tags = families
    return told


def _inside_out(nodes: IntArray, points: np.ndarray, kind: str) -> np.ndarray:
    """Whether the first corner of each element is turned inside out."""
    first = {4: (1, 2, 3), 6: (1, 2, 3), 8: (1, 3, 4)}[ELEMENTS[kind].corners]
    origin = points[nodes[:, 0]]
    a, b, c = (points[nodes[:, i]] - origin for i in first)
    return np.asarray(np.einsum("ij,ij->i", np.cross(a, b), c) < 0)
