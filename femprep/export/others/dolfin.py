"""A DOLFIN XML mesh in, where each vertex and cell is there once; a volume mesh out."""

from __future__ import annotations

import glob
from pathlib import Path
from xml.etree import ElementTree

from femprep.errors import FileError
from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.export.turned import turned_tetrahedra
from femprep.mesh.vtk.entities import refuse_entities
from femprep.model import VolumeMesh

#: Elements with a number of parts, and what these are.
_LISTS = {"vertices": ("vertex",), "cells": ("tetrahedron", "triangle"), "mesh_function": ("entity",)}


def read(path: Path) -> VolumeMesh:
    """Read a mesh, and the mesh functions of cells that stand beside it.

    Raises
    ------
    FileError
        A vertex, a cell or a value is missing or there twice: meshio leaves it as it was in the memory.
    """
    for file in [path, *sorted(path.parent.glob(f"{glob.escape(path.stem)}_*.xml"))]:
        refuse_entities(file)
        _require_all(file)
    return turned_tetrahedra(from_meshio(meshio_mesh(path)))


def _require_all(file: Path) -> None:
    try:
        for _, entry in ElementTree.iterparse(file):
            if entry.tag not in _LISTS:
                continue
            indices = [int(part.get("index", "-1")) for part in entry if part.tag in _LISTS[entry.tag]]
            size = int(entry.get("size", "0"))
            if len(indices) != size or set(indices) != set(range(size)):
                raise FileError(f"{str(file)!r} says it has {size} {entry.tag}, and does not list each of them once")
            entry.clear()
    except (ElementTree.ParseError, ValueError):  # of which meshio says what is wrong
        return
