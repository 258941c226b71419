"""The JSON files beside the XDMF: names of tags as dolfinx users know them, units, and what was changed."""

from __future__ import annotations

import json
import logging
from pathlib import Path

import pytest
from meshes import mixed, truncated_ellipsoid

from femprep.export import FORMATS, read_mesh, write_format, write_mesh
from femprep.export.table import markdown_table

TAGS = {"LV": [1, 3], "SEPTUM": [3, 3], "ENDO": [101, 2], "EPI": [102, 2], "BASE": [103, 2], "APEX": [104, 2]}


@pytest.mark.parametrize("name", ["dolfinx", "fenics"])
def test_markers_and_info(name: str, tmp_path: Path) -> None:
    write_format(truncated_ellipsoid("tetra"), tmp_path, name, length_unit="m")
    folder = (tmp_path / FORMATS[name].filename).parent
    assert sorted(path.name for path in folder.iterdir()) == ["info.json", "markers.json", "mesh.h5", "mesh.xdmf"]
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
