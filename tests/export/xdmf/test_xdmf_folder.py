"""The JSON files beside the XDMF: names of tags as dolfinx users know them, units, and what was changed."""

from __future__ import annotations

import json
import logging
from pathlib import Path, PurePosixPath
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
from meshes import mixed, truncated_ellipsoid

from femprep.export import FORMATS, read_mesh, write_format, write_mesh
from femprep.export.table import markdown_table

TAGS = {"LV": [1, 3], "SEPTUM": [3, 3], "ENDO": [101, 2], "EPI": [102, 2], "BASE": [103, 2], "APEX": [104, 2]}


@pytest.mark.parametrize("name", ["dolfinx", "fenics"])
def test_markers_and_info(name: str, tmp_path: Path) -> None:
    write_format(truncated_ellipsoid("tetra"), tmp_path, name, length_unit="m")
    folder = (tmp_path / FORMATS[name].filename).parent
    files = {PurePosixPath(name).name for name in FORMATS[name].files}
    assert {path.name for path in folder.iterdir()} == files
    assert files >= {"info.json", "markers.json", "mesh.h5", "mesh.xdmf"}
    assert json.loads((folder / "markers.json").read_text()) == TAGS
    info = json.loads((folder / "info.json").read_text())
    assert (info["length_unit"], info["changed"]) == ("m", "")


@pytest.mark.parametrize(
    ("kind", "format", "changed", "back"),
    [
        ("wedge", "dolfinx", "wedge cut into linear tetrahedra", "tetra"),
        ("mixed", "dolfinx", "hexahedron and wedge cut into linear tetrahedra", "tetra"),
        ("hexahedron20", "dolfinx", "hexahedron20 reduced to their corners", "hexahedron"),
        ("tetra10", "fenics", "tetra10 cut into linear tetrahedra", "tetra"),
    ],
)
def test_what_a_reader_cannot_take_is_changed_and_said(
    kind: str, format: str, changed: str, back: str, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    mesh = mixed() if kind == "mixed" else truncated_ellipsoid(kind)
    with caplog.at_level(logging.WARNING):
        write_mesh(mesh, tmp_path / "mesh.xdmf", format=format)
    assert json.loads((tmp_path / "info.json").read_text())["changed"] == changed
    assert caplog.messages
    found = read_mesh(tmp_path / "mesh.xdmf")
    assert list(found.cells) == [back]
    assert found.region_names == mesh.region_names
    assert found.facet_names == mesh.facet_names


@pytest.mark.parametrize("kind", ["tetra", "tetra10", "hexahedron", "wedge"])
def test_folder_is_what_cardiac_geometries_reads(kind: str, tmp_path: Path) -> None:
    """After ``Geometry.from_folder`` and ``utils.read_mesh`` of cardiac_geometriesx 0.16: dolfinx does the rest."""
    mesh = truncated_ellipsoid(kind)
    write_format(mesh, tmp_path, "dolfinx")
    folder = tmp_path / "dolfinx"
    # A file geometry.bp would be read in place of all others.
    assert not (folder / "geometry.bp").exists()
    grids = {
        grid.get("Name"): grid for grid in ElementTree.parse(folder / "mesh.xdmf").getroot().iterfind("Domain/Grid")
    }
    assert list(grids) == ["Mesh", "Cell tags", "Facet tags"]
    markers = json.loads((folder / "markers.json").read_text())
    assert isinstance(json.loads((folder / "info.json").read_text()), dict)

    def values(element: ElementTree.Element | None) -> np.ndarray:
        item = element.find("DataItem") if element is not None else None
        assert item is not None
        assert item.get("Format") == "HDF"
        file, where = (item.text or "").split(":")
        with h5py.File(folder / file) as store:
            array = np.asarray(store[where])
        assert [int(n) for n in (item.get("Dimensions") or "").split()] == list(array.shape)
        return array

    for name, dimension in (("Cell tags", 3), ("Facet tags", 2)):
        tags = values(grids[name].find(f"Attribute[@Name='{name}']"))
        assert tags.dtype == np.int32
        assert sorted(np.unique(tags)) == sorted(tag for tag, dim in markers.values() if dim == dimension)
        assert len(tags) == len(values(grids[name].find("Topology")))
        # Tags are found by their nodes, so all grids have to count points alike.
        assert np.array_equal(values(grids[name].find("Geometry")), values(grids["Mesh"].find("Geometry")))
    nodes = {tuple(sorted(row)) for row in values(grids["Mesh"].find("Topology")).tolist()}
    assert {tuple(sorted(row)) for row in values(grids["Cell tags"].find("Topology")).tolist()} == nodes


def test_table_says_of_every_format_what_it_is() -> None:
    for entry in FORMATS.values():
        assert entry.program
        assert entry.carries
        assert entry.elements
        assert entry.units
        assert entry.read_by
        assert callable(entry.writer)
    lines = markdown_table().splitlines()
    assert [line.split("|")[1].strip(" `") for line in lines[2:]] == list(FORMATS)
    assert len({line.count("|") for line in lines}) == 1
