"""A DOLFIN XML mesh in, and the mesh functions that stand beside it; a volume mesh out.

meshio reads the mesh, where each vertex and cell is there once. Functions are read here: DOLFIN writes them as
collections of values, which meshio does not know.
"""

from __future__ import annotations

import glob
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple
from xml.etree import ElementTree

import numpy as np

from femprep.errors import FileError
from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.export.turned import turned_tetrahedra
from femprep.model import IntArray, VolumeMesh
from femprep.model.notice import Notice, noted

#: Elements with a number of parts, and what these are.
_LISTS: Final = {"vertices": ("vertex",), "cells": ("tetrahedron", "triangle"), "mesh_function": ("entity",)}
#: What dolfin-convert calls the function that tells regions.
_REGION: Final = "physical_region"


class _Function(NamedTuple):
    """Values of cells, or of facets: cell, which of its facets, value."""

    name: str
    dimension: int
    rows: np.ndarray


def read(path: Path) -> VolumeMesh:
    """Read a mesh, and the mesh functions ``NAME_*.xml`` beside it.

    Functions of cells are data, ``physical_region`` the regions; of facets a collection of values gives tagged facets,
    of each cell in the order of its nodes. What is neither is left out, and told.

    Raises
    ------
    FileError
        A vertex, a cell or a value is missing or there twice.
    """
    beside = sorted(path.parent.glob(f"{glob.escape(path.stem)}_*.xml"))
    for file in [path, *beside]:
        _require_all(file)
    with tempfile.TemporaryDirectory() as folder:  # away from the functions
        alone = Path(folder) / path.name
        shutil.copyfile(path, alone)
        mesh = from_meshio(meshio_mesh(alone, path))
    functions = [_function(file, file.stem.removeprefix(f"{path.stem}_")) for file in beside]
    return turned_tetrahedra(_with(mesh, functions))


def _with(mesh: VolumeMesh, functions: list[_Function]) -> VolumeMesh:
    left_out = []
    for name, dimension, rows in functions:
        places = rows[:, 0].astype(np.int64)
        if len(places) and (places.min() < 0 or places.max() >= mesh.n_cells):
            raise FileError(f"the function {name!r} has a value of a cell that is not there")
        if dimension == 3 and len(np.unique(places)) < len(places):
            raise FileError(f"the function {name!r} has several values of a cell")
        if dimension == 2 and len(rows) and (rows[:, 1].min() < 0 or rows[:, 1].max() > 3):
            raise FileError(f"the function {name!r} has a value of a facet that no cell has")
        tags = rows[:, 2]
        whole = np.array_equal(tags, np.round(tags))
        if dimension == 3:
            values = np.zeros(mesh.n_cells, dtype=rows.dtype)
            values[places] = rows[:, 2]
            taken = name == _REGION and whole
            mesh = replace(mesh, region=values) if taken else mesh.with_data(cell={name: values})
        elif dimension == 2 and whole and len(rows) and not mesh.facets and list(mesh.cells) == ["tetra"]:
            facets, first = _facets(mesh.cells["tetra"], rows[tags != 0])
            mesh = replace(mesh, facets={"triangle": facets}, facet_tag=tags[tags != 0][first])
        else:
            left_out.append(name)
    told = [Notice.of("left out", f"mesh functions {', '.join(left_out)[:200]} are left out")] if left_out else []
    return replace(mesh, info=noted(mesh.info, *told))


def _facets(cells: IntArray, rows: np.ndarray) -> tuple[IntArray, IntArray]:
    """Facets, and the row each is from: facet i of a cell lies opposite to the i-th of its nodes, by their numbers."""
    sorted_cells = np.sort(cells[rows[:, 0].astype(np.int64)], axis=1)
    others = np.array([[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]])[rows[:, 1].astype(np.int64)]
    facets = np.take_along_axis(sorted_cells, others, axis=1)
    first = np.sort(np.unique(facets, axis=0, return_index=True)[1])
    return facets[first], first


def _function(file: Path, name: str) -> _Function:
    """A mesh function: a value of each entity, or a collection of values of cells and their facets."""
    found = ElementTree.parse(file).getroot().find("mesh_function")
    if found is None:
        return _Function(name, -1, np.empty((0, 3)))
    collection = found.find("mesh_value_collection")
    head = found if collection is None else collection
    kind = float if head.get("type") in ("float", "double") else int
    dimension = int(head.get("dim", "-1"))
    if collection is not None:
        rows = [
            (int(v.get("cell_index", "-1")), int(v.get("local_entity", "0")), kind(v.get("value", ""))) for v in head
        ]
    elif dimension == 3:  # of facets the numbers are DOLFIN's
        rows = [(int(v.get("index", "-1")), 0, kind(v.get("value", ""))) for v in head]
    else:
        rows = []
    return _Function(name, dimension, np.array(rows, dtype=kind).reshape(-1, 3))


def _require_all(file: Path) -> None:
    try:
        for _, entry in ElementTree.iterparse(file):
            if entry.tag not in _LISTS or entry.find("mesh_value_collection") is not None:
                continue
            indices = [int(part.get("index", "-1")) for part in entry if part.tag in _LISTS[entry.tag]]
            size = int(entry.get("size", "0"))
            if len(indices) != size or set(indices) != set(range(size)):
                raise FileError(f"{str(file)!r} says it has {size} {entry.tag}, and does not list each of them once")
            if entry.tag != "mesh_function":
                entry.clear()
    except (ElementTree.ParseError, ValueError):  # of which others say what is wrong
        return
