"""Meshes of equal connectivity over time in, one time series out: ``.pvd`` of ``.vtu`` files, and XDMF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from femprep.errors import InputError
from femprep.export.xdmf.write import TOPOLOGY, Document
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
    with Document(folder, stem) as document:
        parent = ElementTree.SubElement(
            document.domain, "Grid", {"Name": stem, "GridType": "Collection", "CollectionType": "Temporal"}
        )
        stored: dict[str, tuple[np.ndarray, dict[str, str]]] = {}

        def item(element: ElementTree.Element, where: str, number: int, values: np.ndarray) -> None:
            if where in stored and np.array_equal(stored[where][0], values):
                known = dict(stored[where][1])
                text = known.pop("text")
                ElementTree.SubElement(element, "DataItem", known).text = text
            else:
                stored[where] = (values, document.item(element, f"{where}/{number}", values))

        for number, (mesh, time) in enumerate(zip(meshes, times, strict=True)):
            grid = ElementTree.SubElement(parent, "Grid", {"Name": f"{stem} {number}", "GridType": "Uniform"})
            ElementTree.SubElement(grid, "Time", {"Value": repr(float(time))})
            sizes = {"NumberOfElements": str(len(cells)), "NodesPerElement": str(cells.shape[1])}
            topology = ElementTree.SubElement(grid, "Topology", {"TopologyType": TOPOLOGY[kind], **sizes})
            item(topology, "topology", number, np.asarray(mesh.cells[kind]))
            item(ElementTree.SubElement(grid, "Geometry", {"GeometryType": "XYZ"}), "geometry", number, mesh.points)
            blocks = (("Cell", {"region": mesh.region, **mesh.cell_data}), ("Node", mesh.point_data))
            for centre, data in blocks:
                for name, values in data.items():
                    width = int(np.prod(np.asarray(values).shape[1:]))
                    form = {1: "Scalar", 3: "Vector", 6: "Tensor6", 9: "Tensor"}.get(width, "Matrix")
                    attributes = {"Name": name, "AttributeType": form, "Center": centre}
                    element = ElementTree.SubElement(grid, "Attribute", attributes)
                    item(element, f"{centre.lower()}_data/{name}", number, np.asarray(values))
