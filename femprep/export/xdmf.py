"""A volume mesh to XDMF and HDF5 for dolfinx and legacy FEniCS, with ``markers.json`` and ``info.json``."""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np

from femprep.errors import InputError
from femprep.export.names import facet_names, region_names
from femprep.export.split import to_tetrahedra
from femprep.export.units import UNITS
from femprep.model import VolumeMesh
from femprep.options import ExportOptions

log = logging.getLogger(__name__)

#: Grid names: dolfinx's ``read_mesh(name=...)`` and ``read_meshtags(mesh, name)`` choose by them, and
#: ``cardiac_geometries.Geometry.from_folder`` expects these. Legacy FEniCS reads the attribute of the same name.
MESH, CELL_TAGS, FACET_TAGS = "Mesh", "Cell tags", "Facet tags"

#: XDMF's topology names (node order is VTK's).
TOPOLOGY: Final[Mapping[str, str]] = {
    "tetra": "Tetrahedron",
    "tetra10": "Tetrahedron_10",
    "hexahedron": "Hexahedron",
    "triangle": "Triangle",
    "triangle6": "Triangle_6",
    "quad": "Quadrilateral",
}


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.xdmf``, ``stem.h5``, ``markers.json`` (name to tag and dimension) and ``info.json`` for dolfinx.

    Tetrahedra of four and ten nodes and hexahedra of eight go as they are; dolfinx reads no facet tags on wedges and
    no twenty-node hexahedra, so every other mesh is cut into linear tetrahedra, and ``info.json`` says so.

    Raises
    ------
    InputError
        Data of a cell or point array are no numbers.
    """
    _write(mesh, folder, stem, options, whole=("tetra", "tetra10", "hexahedron"))


def write_fenics(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write the same for legacy FEniCS, which reads linear tetrahedra alone: every other mesh is cut into them.

    Raises
    ------
    InputError
        Data of a cell or point array are no numbers.
    """
    _write(mesh, folder, stem, options, whole=("tetra",))


def _write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions, whole: tuple[str, ...]) -> None:
    units = UNITS[options.length_unit]
    kinds = list(mesh.cells)
    note = ""
    if len(kinds) != 1 or kinds[0] not in whole:
        note = f"{' and '.join(kinds)} cut into linear tetrahedra"
        log.warning("%s: the reader of %s.xdmf knows no others", note, stem)
        mesh = to_tetrahedra(mesh)
    _write_grids(mesh, folder, stem, units.per_mm)
    tags = {name.upper(): [tag, 3] for name, tag in region_names(mesh).items()}
    tags |= {name.upper(): [tag, 2] for name, tag in facet_names(mesh).items()}
    info = {"length_unit": units.length, "units": units.line, "source": "femprep", "changed": note}
    _write_json(folder / "markers.json", tags)
    _write_json(folder / "info.json", info)


def _write_json(path: Path, value: Any) -> None:
    path.write_text(json.dumps(value, indent=2) + "\n", encoding="utf-8")


def _write_grids(mesh: VolumeMesh, folder: Path, stem: str, scale: float) -> None:
    import h5py

    (kind, cells), h5 = next(iter(mesh.cells.items())), f"{stem}.h5"
    with h5py.File(folder / h5, "w") as store:

        def item(parent: ElementTree.Element, where: str, values: Any) -> None:
            array = np.ascontiguousarray(values)
            if array.dtype.kind not in "biuf":
                raise InputError(f"data {where.rsplit('/', 1)[-1]!r} are {array.dtype}; XDMF holds numbers")
            array = array.astype(np.uint8) if array.dtype.kind == "b" else array
            store.create_dataset(where, data=array, track_times=False)
            number = {"i": "Int", "u": "UInt", "f": "Float"}[array.dtype.kind]
            size = " ".join(map(str, array.shape))
            attributes = {"Dimensions": size, "NumberType": number, "Precision": str(array.dtype.itemsize)}
            ElementTree.SubElement(parent, "DataItem", {**attributes, "Format": "HDF"}).text = f"{h5}:{where}"

        def grid(name: str, kind: str, nodes: Any, where: str) -> ElementTree.Element:
            out = ElementTree.SubElement(domain, "Grid", {"Name": name, "GridType": "Uniform"})
            sizes = {"NumberOfElements": str(len(nodes)), "NodesPerElement": str(nodes.shape[1])}
            topology = ElementTree.SubElement(out, "Topology", {"TopologyType": TOPOLOGY[kind], **sizes})
            item(topology, f"{where}/topology", nodes)
            return out

        def geometry(parent: ElementTree.Element) -> None:
            if MESH not in store:
                item(ElementTree.SubElement(parent, "Geometry", {"GeometryType": "XYZ"}), f"/{MESH}/geometry", points)
            else:
                element = ElementTree.SubElement(parent, "Geometry", {"GeometryType": "XYZ"})
                size = {"Dimensions": f"{len(points)} 3", "NumberType": "Float", "Precision": "8", "Format": "HDF"}
                ElementTree.SubElement(element, "DataItem", size).text = f"{h5}:/{MESH}/geometry"

        def attribute(parent: ElementTree.Element, name: str, center: str, where: str, values: Any) -> None:
            width = np.asarray(values).shape[1:] or (1,)
            form = {1: "Scalar", 3: "Vector", 6: "Tensor6", 9: "Tensor"}.get(int(np.prod(width)), "Matrix")
            item(
                ElementTree.SubElement(parent, "Attribute", {"Name": name, "AttributeType": form, "Center": center}),
                where,
                values,
            )

        points = mesh.points * scale
        root = ElementTree.Element("Xdmf", {"Version": "3.0"})
        domain = ElementTree.SubElement(root, "Domain")
        whole = grid(MESH, kind, cells, "/cells")
        geometry(whole)
        for name, values in mesh.cell_data.items():
            attribute(whole, name, "Cell", f"/cell_data/{name}", values)
        for name, values in mesh.point_data.items():
            attribute(whole, name, "Node", f"/point_data/{name}", values)
        tags = grid(CELL_TAGS, kind, cells, "/cell_tags")
        geometry(tags)
        attribute(tags, CELL_TAGS, "Cell", "/cell_tags/values", mesh.region)
        for facet_kind, block in mesh.facets.items():
            tagged = grid(FACET_TAGS, facet_kind, block, "/facet_tags")
            geometry(tagged)
            attribute(tagged, FACET_TAGS, "Cell", "/facet_tags/values", mesh.facet_tag)
    ElementTree.indent(root)
    ElementTree.ElementTree(root).write(folder / f"{stem}.xdmf", encoding="utf-8", xml_declaration=True)
