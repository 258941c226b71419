"""A ``mesh-complete`` folder of svMultiPhysics or SimVascular in, a volume mesh out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import FileError
from femprep.export.deck.names import Numbers
from femprep.export.deck.units import UNITS
from femprep.export.foreign import from_meshio
from femprep.export.svmultiphysics.step import ORIGIN
from femprep.export.turned import MANY, outward_facets, turned_tetrahedra
from femprep.export.vtk.xml import arrays_of, record_of
from femprep.export.vtu.read import read_foreign
from femprep.mesh.elements import FACET_TYPES
from femprep.mesh.length_unit import UNIT
from femprep.mesh.vtk.reading import load
from femprep.model import IntArray, VolumeMesh
from femprep.model.tags import FOREIGN

#: The file that makes a folder such a mesh.
MESH: Final = "mesh-complete.mesh.vtu"
#: Which data the fibre files beside it are.
_FIBRES: Final = {"fibersLong.vtu": "fiber", "fibersSheet.vtu": "sheet"}
#: Arrays that number the mesh and say nothing more.
_NUMBERS: Final = ("GlobalElementID", "GlobalNodeID", "DOMAIN_ID", "ModelRegionID")


def read(folder: Path) -> VolumeMesh:
    """Read a folder: its mesh, each file of ``mesh-surfaces`` as a tagged facet set, its fibres.

    The files name their unit only where femprep wrote them; an origin that was taken off is put back.

    Raises
    ------
    FileError
        The folder holds no such mesh, or a file is damaged.
    """
    if not (folder / MESH).is_file():
        raise FileError(f"the folder {str(folder)!r} holds no {MESH}; name the file of a mesh")
    file = read_foreign(folder / MESH)
    mesh = from_meshio(file)
    record = record_of(file.field_data)
    origin, unit = record.get(ORIGIN, (0.0, 0.0, 0.0)), record.get(UNIT)
    stated = {UNIT: {"unit": unit, "by": "statement"}} if unit else {}
    numbers = Numbers()
    numbers.regions.update(mesh.info.get(FOREIGN, {}))
    blocks: dict[str, list[tuple[IntArray, int]]] = {}
    for path in sorted((folder / "mesh-surfaces").glob("*.vtp")):
        tag = numbers.of(path.stem, facet=True)
        for kind, nodes in _face(path):
            blocks.setdefault(kind, []).append((nodes, tag))
    tags = [np.full(len(nodes), tag, dtype=np.int32) for parts in blocks.values() for nodes, tag in parts]
    cell_data = {name: values for name, values in mesh.cell_data.items() if name not in _NUMBERS}
    for fibres, name in _FIBRES.items():
        if (folder / fibres).is_file():
            cell_data[name] = np.concatenate(read_foreign(folder / fibres).cell_data["FIB_DIR"])
    mesh = replace(
        mesh,
        points=(mesh.points + origin) / (UNITS[unit].per_mm if unit else 1.0),
        facets={kind: np.concatenate([nodes for nodes, _ in parts]) for kind, parts in blocks.items()},
        facet_tag=np.concatenate([np.empty(0, dtype=np.int32), *tags]),
        cell_data=cell_data,
        point_data={name: values for name, values in mesh.point_data.items() if name not in _NUMBERS},
        info={**mesh.info, "source": {**mesh.info["source"], "facet_tag": "mesh-surfaces"}, **numbers.info, **stated},
    )
    return outward_facets(turned_tetrahedra(mesh, MANY))


def _face(path: Path) -> list[tuple[str, IntArray]]:
    """Facets of a ``.vtp`` by type, in node numbers of the whole mesh."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    surface = load(path)
    number = arrays_of(surface.GetPointData()).get("GlobalNodeID")
    if number is None:
        raise FileError(f"{str(path)!r} has no point data GlobalNodeID")
    offsets = vtk_to_numpy(surface.GetPolys().GetOffsetsArray())
    nodes = number[vtk_to_numpy(surface.GetPolys().GetConnectivityArray())].astype(np.int64) - 1
    size, found = np.diff(offsets), []
    for count, kind in FACET_TYPES.items():
        own = offsets[:-1][size == count]
        if len(own):
            found.append((kind, nodes[own[:, None] + np.arange(count)]))
    return found
