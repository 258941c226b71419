"""A volume mesh to XDMF and HDF5 for dolfinx and legacy FEniCS, with names and units in JSON files beside."""

from __future__ import annotations

import json
import logging
from collections.abc import Mapping
from copy import copy
from io import BytesIO
from pathlib import Path
from typing import Any, Final, Self
from xml.etree import ElementTree

import numpy as np

from femprep.export.deck.fibres import directions
from femprep.export.deck.names import facet_names, region_names
from femprep.export.deck.split import linear, to_tetrahedra
from femprep.export.deck.units import UNITS
from femprep.export.xdmf.checkpoint import elements, write_fibres, write_into
from femprep.model import VolumeMesh, verdict_of
from femprep.model.tags import FOREIGN, FOREIGN_FACETS
from femprep.model.verdict import VERDICT
from femprep.options import ExportOptions

log = logging.getLogger(__name__)

#: Grid names: dolfinx's ``read_mesh(name=...)`` and ``read_meshtags(mesh, name)`` choose by them, and
#: ``cardiac_geometries.Geometry.from_folder`` expects these. Legacy FEniCS reads the attribute of the same name.
MESH, CELL_TAGS, FACET_TAGS = "Mesh", "Cell tags", "Facet tags"

#: The stem of the mesh that readers of a whole folder look for: the files without a stem in their names are its own.
FOLDERS: Final = "mesh"

#: XDMF's topology names (node order is VTK's).
TOPOLOGY: Final[Mapping[str, str]] = {
    "tetra": "Tetrahedron",
    "tetra10": "Tetrahedron_10",
    "wedge": "Wedge",
    "wedge15": "Wedge_15",
    "hexahedron": "Hexahedron",
    "hexahedron20": "Hexahedron_20",
    "triangle": "Triangle",
    "triangle6": "Triangle_6",
    "quad": "Quadrilateral",
}
#: Elements that are written as they are, by format.
WHOLE: Final = {"dolfinx": ("tetra", "tetra10", "hexahedron"), "fenics": ("tetra",)}
_CORNERS: Final = "reduced to their corners"


def write(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write ``stem.xdmf`` and ``stem.h5``, ``markers_stem.json`` (name to tag and dimension) and ``info_stem.json``.

    Tetrahedra of four and ten nodes and hexahedra of eight go as they are. dolfinx reads no quadratic hexahedra from
    XDMF: of those the corners go. It reads no facet tags on wedges: they, and mixed meshes, are cut into linear
    tetrahedra. ``info.json`` says so. Names in ``markers.json`` are in capitals, by which fenicsx-pulse knows them;
    names that a mesh brought from elsewhere stand in ``info.json`` as they were. Cell data
    (fibres, sheets, AHA segments) are attributes of the grid ``Mesh`` and arrays ``cell_data/<name>`` of the HDF5
    file, a row per cell of the file: dolfinx' cell i is row ``mesh.topology.original_cell_index[i]``.

    ``cardiac_geometries.Geometry.from_folder`` takes mesh, tags, markers, info and fibres from a folder with
    ``mesh.xdmf``, ``markers.json`` and ``info.json``, the last of ``microstructure.bp`` through ADIOS2: these come with
    the stem ``mesh`` alone, so that meshes of other names may share a folder. Where Python has no ADIOS2, the HDF5 file
    is a checkpoint of all of it: ``Geometry.from_file(comm, "mesh.h5")`` after
    ``io4dolfinx.set_default_backend("h5py")``.
    """
    written = _write(mesh, folder, stem, options, whole=WHOLE["dolfinx"], checkpoint=True)
    if stem == FOLDERS:
        write_fibres(folder, written)


def write_fenics(mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions) -> None:
    """Write the same for legacy FEniCS, which reads linear tetrahedra alone: every other mesh is cut into them.

    Fibre and sheet come as checkpoints too, ``stem_fiber.xdmf`` and ``stem_sheet.xdmf``:
    ``XDMFFile(...).read_checkpoint(f, "fiber", 0)`` fills a function of ``VectorFunctionSpace(mesh, "DG", 0)``.
    """
    written = _write(mesh, folder, stem, options, whole=WHOLE["fenics"])
    found = directions(written)
    for name, values in zip(("fiber", "sheet"), found or ()):
        if name in written.cell_data:
            _write_checkpoint(written, folder, f"{stem}_{name}", name, values, UNITS[options.length_unit].per_mm)


def reduced(mesh: VolumeMesh, whole: tuple[str, ...]) -> str:
    """What becomes of elements of a mesh that a reader of these types knows not; empty where it knows them."""
    kinds = list(mesh.cells)
    if kinds == ["hexahedron20"] and "hexahedron" in whole:
        return f"hexahedron20 {_CORNERS}"
    if len(kinds) != 1 or kinds[0] not in whole:
        return f"{' and '.join(kinds)} cut into linear tetrahedra"
    return ""


def _write(
    mesh: VolumeMesh, folder: Path, stem: str, options: ExportOptions, whole: tuple[str, ...], checkpoint: bool = False
) -> VolumeMesh:
    units = UNITS[options.length_unit]
    note = reduced(mesh, whole)
    if note.endswith(_CORNERS):
        mesh = linear(mesh, "dolfinx")
    elif note:
        log.warning("%s: the reader of %s.xdmf knows no others", note, stem)
        mesh = to_tetrahedra(mesh)
    (kind, cells) = next(iter(mesh.cells.items()))
    with Document(folder, stem) as document:
        grid = document.grid(MESH, kind, cells, "cells/topology")
        document.geometry(grid, mesh.points * units.per_mm)
        for name, values in mesh.cell_data.items():
            document.attribute(grid, name, "Cell", f"cell_data/{name}", values)
        for name, values in mesh.point_data.items():
            document.attribute(grid, name, "Node", f"point_data/{name}", values)
        grid = document.grid(CELL_TAGS, kind, cells, "cell_tags/topology")
        document.geometry(grid)
        document.attribute(grid, CELL_TAGS, "Cell", "cell_tags/values", mesh.region)
        for facet_kind, block in mesh.facets.items():
            grid = document.grid(FACET_TAGS, facet_kind, block, "facet_tags/topology")
            document.geometry(grid)
            document.attribute(grid, FACET_TAGS, "Cell", "facet_tags/values", mesh.facet_tag)
        if checkpoint:
            write_into(document.store, mesh)
    tags = {name.upper(): [tag, 3] for name, tag in region_names(mesh).items()}
    tags |= {name.upper(): [tag, 2] for name, tag in facet_names(mesh).items()}
    info: dict[str, Any] = {"length_unit": units.length, "units": units.line, "source": "femprep", "changed": note}
    info |= {VERDICT: verdict} if (verdict := verdict_of(mesh)) else {}
    info |= {key: mesh.info[key] for key in (FOREIGN, FOREIGN_FACETS) if key in mesh.info}
    texts = {"markers": tags, "info": info, **({"microstructure": elements(mesh)} if checkpoint else {})}
    for name, text in texts.items():
        # from_file on the HDF5 file reads the former; from_folder, which takes mesh.xdmf alone, the latter.
        for file in (f"{name}_{stem}.json", *([f"{name}.json"] if stem == FOLDERS else [])):
            (folder / file).write_text(json.dumps(text, indent=2) + "\n", encoding="utf-8")
    return mesh


def _write_checkpoint(mesh: VolumeMesh, folder: Path, stem: str, name: str, values: Any, scale: float) -> None:
    """A vector per cell as dolfin's ``write_checkpoint`` writes a function of degree 0."""
    count, where = mesh.n_cells, f"{name}/{name}_0"
    with Document(folder, stem) as document:
        collection = {"GridType": "Collection", "CollectionType": "Temporal", "Name": name}
        parent = ElementTree.SubElement(document.domain, "Grid", collection)
        grid = document.grid(f"{name}_0", "tetra", mesh.cells["tetra"], f"{where}/mesh/topology", parent)
        document.geometry(grid, mesh.points * scale)
        ElementTree.SubElement(grid, "Time", {"Value": "0"})
        element = {"ElementFamily": "DG", "ElementDegree": "0", "ElementCell": "tetrahedron"}
        kind = {"Name": name, "Center": "Other", "AttributeType": "Vector", "ItemType": "FiniteElementFunction"}
        function = ElementTree.SubElement(grid, "Attribute", {**kind, **element})
        document.item(function, f"{where}/cell_dofs", np.arange(3 * count, dtype=np.int32)[:, None])
        document.item(function, f"{where}/vector", np.asarray(values, dtype=np.float64).reshape(-1, 1))
        document.item(function, f"{where}/x_cell_dofs", np.arange(0, 3 * count + 1, 3, dtype=np.uint64)[:, None])
        document.item(function, f"{where}/cells", np.arange(count, dtype=np.uint64)[:, None])


class Document:
    """An XDMF file in the making, its arrays in an HDF5 file of the same stem beside it."""

    def __init__(self, folder: Path, stem: str) -> None:
        import h5py

        self._path, self._h5 = folder / f"{stem}.xdmf", f"{stem}.h5"
        self._content = BytesIO()  # in memory first: HDF5 does not bear a full disk
        self.store = h5py.File(self._content, "w")
        self._root = ElementTree.Element("Xdmf", {"Version": "3.0"})
        self._points: ElementTree.Element | None = None
        self.domain = ElementTree.SubElement(self._root, "Domain")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self.store.close()
        if kind is None:
            self._path.with_name(self._h5).write_bytes(self._content.getbuffer())
            ElementTree.indent(self._root)
            ElementTree.ElementTree(self._root).write(self._path, encoding="utf-8", xml_declaration=True)

    def item(self, parent: ElementTree.Element, where: str, values: Any) -> ElementTree.Element:
        """Store an array and name it in the document."""
        array = np.ascontiguousarray(values)
        array = array.astype(np.uint8) if array.dtype.kind == "b" else array
        self.store.create_dataset(where, data=array, track_times=False)
        number = {"i": "Int", "u": "UInt", "f": "Float"}[array.dtype.kind]
        size = " ".join(map(str, array.shape))
        attributes = {"Dimensions": size, "NumberType": number, "Precision": str(array.dtype.itemsize), "Format": "HDF"}
        found = ElementTree.SubElement(parent, "DataItem", attributes)
        found.text = f"{self._h5}:/{where}"
        return found

    def grid(
        self, name: str, kind: str, nodes: Any, where: str, parent: ElementTree.Element | None = None
    ) -> ElementTree.Element:
        """A uniform grid with its topology."""
        target = self.domain if parent is None else parent
        out = ElementTree.SubElement(target, "Grid", {"Name": name, "GridType": "Uniform"})
        sizes = {"NumberOfElements": str(len(nodes)), "NodesPerElement": str(nodes.shape[1])}
        self.item(ElementTree.SubElement(out, "Topology", {"TopologyType": TOPOLOGY[kind], **sizes}), where, nodes)
        return out

    def geometry(self, grid: ElementTree.Element, points: Any = None, where: str = f"{MESH}/geometry") -> None:
        """The points of a grid; without any, those of the first grid: every grid has the mesh's numbering."""
        element = ElementTree.SubElement(grid, "Geometry", {"GeometryType": "XYZ"})
        if points is not None:
            self._points = self.item(element, where, points)
        elif self._points is not None:
            element.append(copy(self._points))

    def attribute(self, grid: ElementTree.Element, name: str, center: str, where: str, values: Any) -> None:
        """Values at the cells or nodes of a grid."""
        width = int(np.prod(np.asarray(values).shape[1:]))
        form = {1: "Scalar", 3: "Vector", 6: "Tensor6", 9: "Tensor"}.get(width, "Matrix")
        element = ElementTree.SubElement(grid, "Attribute", {"Name": name, "AttributeType": form, "Center": center})
        self.item(element, where, values)
