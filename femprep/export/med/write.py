"""A volume mesh to MED (Salome, code_aster): families for every tag, fields for fibres; through meshio."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.export.deck.data import over_all
from femprep.export.deck.fibres import segments
from femprep.export.deck.names import facet_names, facet_nodes, region_names
from femprep.export.deck.units import UNITS, Units
from femprep.model import IntArray, VolumeMesh, verdict_of
from femprep.options import ExportOptions

log = logging.getLogger(__name__)

#: Which of our nodes each of MED's is. MED's first face runs the other way round; the numbering of its edges follows
#: the corners as ours does. Every row is its own inverse.
MED_ORDER: Final = {
    "tetra": (0, 2, 1, 3),
    "tetra10": (0, 2, 1, 3, 6, 5, 4, 7, 9, 8),
    "wedge": (0, 2, 1, 3, 5, 4),
    "wedge15": (0, 2, 1, 3, 5, 4, 8, 7, 6, 11, 10, 9, 12, 14, 13),
    "hexahedron": (0, 3, 2, 1, 4, 7, 6, 5),
    "hexahedron20": (0, 3, 2, 1, 4, 7, 6, 5, 11, 10, 9, 8, 15, 14, 13, 12, 16, 19, 18, 17),
}
#: Attribute of the mesh, which readers of MED leave alone, that keeps its verdict as JSON.
_VERDICT: Final = "FEMPREP_VERDICT"


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.med``.

    Groups of volumes carry the names of regions and AHA segments, groups of faces and of nodes those of facet tags.
    Cell data are fields on the volumes (zero on faces), point data fields on the nodes.
    """
    import meshio
    from meshio._mesh import topological_dimension

    topological_dimension.setdefault("wedge15", 3)  # meshio writes it, but for a gap in its own table
    cells = [(kind, block[:, list(MED_ORDER[kind])]) for kind, block in mesh.cells.items()]
    cells += list(mesh.facets.items())
    families, tags = _cell_families(mesh)
    node_families, node_tags = _node_families(mesh)
    out = meshio.Mesh(
        mesh.points * UNITS[options.length_unit].per_mm,
        cells,
        point_data={"point_tags": node_tags, **{name: _floats(values) for name, values in mesh.point_data.items()}},
        cell_data={"cell_tags": _split(tags, cells), **_fields(mesh, cells)},
    )
    out.cell_tags, out.point_tags = families, node_families
    content = BytesIO()  # in memory first: HDF5 does not bear a full disk
    meshio.write(content, out, file_format="med")
    _describe(content, UNITS[options.length_unit], verdict_of(mesh))
    (folder / f"{stem}.med").write_bytes(content.getbuffer())


def _describe(content: BytesIO, units: Units, verdict: dict[str, Any]) -> None:
    """Name the unit of each axis, which meshio leaves empty, and the mesh; its verdict is an attribute of our own."""
    import h5py

    with h5py.File(content, "r+") as file:
        attributes = file["ENS_MAA/mesh"].attrs
        attributes["UNI"] = np.bytes_("".join(f"{units.length:<16}" for _ in range(3)))
        attributes["DES"] = np.bytes_(f"femprep volume mesh; {units.line}")
        if verdict:
            attributes[_VERDICT] = np.bytes_(json.dumps(verdict))


def _split(values: np.ndarray, cells: list[tuple[str, Any]]) -> list[np.ndarray]:
    ends = np.cumsum([len(block) for _, block in cells])[:-1]
    return np.split(values, ends)


def _floats(values: Any) -> np.ndarray:
    array = np.asarray(values, dtype=np.float64)
    return array.reshape(len(array), -1) if array.ndim > 2 else array


def _fields(mesh: VolumeMesh, cells: list[tuple[str, Any]]) -> dict[str, list[np.ndarray]]:
    return {name: _split(_floats(values), cells) for name, values in over_all(mesh).items()}


def _cell_families(mesh: VolumeMesh) -> tuple[dict[int, list[str]], IntArray]:
    """Families of elements, which MED numbers below zero: one for each combination of groups."""
    memberships = [[name] for name in _of_tags(mesh.region, region_names(mesh))]
    for name, rows in segments(mesh).items():
        for row in rows.tolist():
            memberships[row].append(name)
    memberships += [[name] for name in _of_tags(mesh.facet_tag, facet_names(mesh))]
    return _families(memberships, -1)


def _node_families(mesh: VolumeMesh) -> tuple[dict[int, list[str]], IntArray]:
    """Families of nodes, which MED numbers above zero; a node at a rim is in several groups."""
    memberships: list[list[str]] = [[] for _ in range(len(mesh.points))]
    for name, tag in facet_names(mesh).items():
        for node in facet_nodes(mesh, tag).tolist():
            memberships[node].append(name)
    return _families(memberships, 1)


def _of_tags(tags: np.ndarray, names: dict[str, int]) -> Iterable[str]:
    known = {tag: name for name, tag in names.items()}
    return (known[tag] for tag in tags.tolist())


def _families(memberships: list[list[str]], sign: int) -> tuple[dict[int, list[str]], IntArray]:
    numbers: dict[tuple[str, ...], int] = {(): 0}
    out = [numbers.setdefault(tuple(groups), sign * len(numbers)) for groups in memberships]
    families = {number: list(groups) for groups, number in numbers.items() if groups}
    return families, np.array(out, dtype=np.int64)
