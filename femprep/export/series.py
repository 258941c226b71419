"""Meshes of equal connectivity over time in, one time series out: ``.pvd`` of ``.vtu`` files, and XDMF."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from femprep.errors import InputError
from femprep.export.xdmf.write import Document
from femprep.model import VolumeMesh


def write_pvd(path: Path, files: Sequence[str], times: Sequence[float]) -> None:
    """Write ``path``, a ParaView collection of files named relative to its folder, one per time."""
    root = ElementTree.Element("VTKFile", {"type": "Collection", "version": "0.1", "byte_order": "LittleEndian"})
    collection = ElementTree.SubElement(root, "Collection")
    for file, time in zip(files, times, strict=True):
        ElementTree.SubElement(collection, "DataSet", {"timestep": repr(float(time)), "part": "0", "file": file})
    ElementTree.indent(root)
    ElementTree.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def write_xdmf_series(meshes: Sequence[VolumeMesh], folder: Path, stem: str, times: Sequence[float]) -> None:
    """Write ``stem.xdmf`` and ``stem.h5``: a temporal collection whose grids share their cells.

    Each grid has the positions of its time, mm, the region of each cell, and all cell and point data; those of equal
    values at all times are stored once.

    Parameters
    ----------
    meshes : sequence of VolumeMesh
        Of equal connectivity, elements of one type.
    folder : Path
    stem : str
    times : sequence of float
        As many.

    Raises
    ------
    InputError
        A mesh has elements of several types, or differs from the first in connectivity.
    """
    first = meshes[0]
    if len(first.cells) != 1:
        raise InputError(f"a series holds elements of one type, not {' and '.join(first.cells)}")
    ((kind, cells),) = first.cells.items()
    for number, mesh in enumerate(meshes):
        if list(mesh.cells) != [kind] or not np.array_equal(mesh.cells[kind], cells):
            raise InputError(f"mesh {number} of a series differs from the first in connectivity")
    with _Series(folder, stem) as document:
        parent = ElementTree.SubElement(
            document.domain, "Grid", {"Name": stem, "GridType": "Collection", "CollectionType": "Temporal"}
        )
        for number, (mesh, time) in enumerate(zip(meshes, times, strict=True)):
            document.number = number
            grid = document.grid(f"{stem} {number}", kind, mesh.cells[kind], "topology", parent)
            moment = ElementTree.Element("Time", {"Value": repr(float(time))})
            grid.insert(0, moment)
            document.geometry(grid, mesh.points, "geometry")
            for centre, data in (("Cell", {"region": mesh.region, **mesh.cell_data}), ("Node", mesh.point_data)):
                for name, values in data.items():
                    document.attribute(grid, name, centre, f"{centre.lower()}_data/{name}", values)


class _Series(Document):
    """A document of several times: an array that is as it was is stored no second time."""

    def __init__(self, folder: Path, stem: str) -> None:
        super().__init__(folder, stem)
        self.number = 0
        self._latest: dict[str, tuple[Any, ElementTree.Element]] = {}

    def item(self, parent: ElementTree.Element, where: str, values: Any) -> ElementTree.Element:
        """Store an array under the number of its time, or name the earlier one again."""
        if where in self._latest and np.array_equal(self._latest[where][0], values):
            found = copy(self._latest[where][1])
            parent.append(found)
            return found
        found = super().item(parent, f"{where}/{self.number}", values)
        self._latest[where] = values, found
        return found
