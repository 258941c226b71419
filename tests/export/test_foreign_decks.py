"""Small files of openCARP, FEBio, LS-DYNA and SimVascular as others write them, read element by element."""

from __future__ import annotations

import logging
from pathlib import Path

import numpy as np
import pytest
import pyvista
from meshes import truncated_ellipsoid, with_fibres

from femprep.cli import main
from femprep.errors import FileError
from femprep.export import read_mesh, write_mesh

POINTS = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]


def test_opencarp_mesh_of_mixed_elements_in_any_order(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    prism = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1], [1, 0, 1], [1, 1, 2]]
    rows = [" ".join(str(1000.0 * x) for x in point) for point in prism]
    (tmp_path / "block.pts").write_text("7\n" + "\n".join(rows) + "\n")
    # A prism's second face runs the other way round: node 3 lies over 0, 5 over 1, 4 over 2.
    (tmp_path / "block.elem").write_text("4\nTt 3 5 4 6 2\nPr 0 1 2 3 4 5 9\nLn 0 1 5\nTt 3 4 5 6 3\n")
    (tmp_path / "block.lon").write_text("1\n1 0 0\n0 1 0\n0 0 1\n0 0 -1\n")
    with caplog.at_level(logging.WARNING):
        mesh = read_mesh(tmp_path / "block.pts")
    assert "types Ln are left out" in caplog.text
    assert mesh.points.tolist() == np.array(prism, dtype=float).tolist()
    assert mesh.cells["tetra"].tolist() == [[3, 5, 4, 6], [3, 4, 5, 6]]
    assert mesh.cells["wedge"].tolist() == [[0, 1, 2, 3, 5, 4]]
    assert mesh.region.tolist() == [2, 3, 9]
    assert mesh.cell_data["fiber"].tolist() == [[1, 0, 0], [0, 0, -1], [0, 1, 0]]
    assert read_mesh(tmp_path / "block.elem").n_cells == 3
    (tmp_path / "block.pts").write_text("9\n" + "\n".join(rows) + "\n")
    with pytest.raises(FileError, match="says '9' points and holds 7"):
        read_mesh(tmp_path / "block.pts")
    (tmp_path / "block.pts").unlink()
    with pytest.raises(FileError, match="does not exist; the points of an openCARP mesh stand in it"):
        read_mesh(tmp_path / "block.elem")


FEB = """<?xml version="1.0" encoding="ISO-8859-1"?>
<febio_spec version="4.0"><Module type="solid"/><Mesh>
<Nodes name="Object1"><node id="11">0,0,0</node><node id="12">1,0,0</node><node id="13">0,1,0</node></Nodes>
<Nodes name="Object2"><node id="24">0,0,1</node><node id="25">1,1,1</node></Nodes>
<Elements type="tet4" name="Healthy"><elem id="1">11,12,13,24</elem></Elements>
<Elements type="tri3" name="Shell"><elem id="2">11,12,13</elem></Elements>
<Elements type="tet4" name="Lesion"><elem id="7">12,13,24,25</elem></Elements>
<Surface name="ENDO"><tri3 id="1">11,13,12</tri3></Surface>
<Surface name="outside"><tri3 id="1">24,12,25</tri3></Surface>
</Mesh><MeshData>
<ElementData type="fiber" elem_set="Healthy"><e lid="1">1,0,0</e></ElementData>
<ElementData type="fiber" elem_set="Lesion"><e lid="1">0,0,1</e></ElementData>
</MeshData></febio_spec>
"""


def test_febio_model_with_parts_surfaces_and_fibres(tmp_path: Path) -> None:
    (tmp_path / "model.feb").write_text(FEB)
    mesh = read_mesh(tmp_path / "model.feb")
    names = mesh.info["tag_names"]
    assert mesh.points.tolist() == POINTS
    assert mesh.cells["tetra"].tolist() == [[0, 1, 2, 3], [1, 2, 3, 4]]
    assert mesh.region.tolist() == [names["Healthy"], names["Lesion"]]
    assert mesh.facets["triangle"].tolist() == [[0, 2, 1], [3, 1, 4]]
    assert mesh.facet_tag.tolist() == [101, names["outside"]]
    assert mesh.cell_data["fiber"].tolist() == [[1, 0, 0], [0, 0, 1]]
    assert mesh.info["source"]["left_out"] == ["tri3"]
    (tmp_path / "model.feb").write_text(FEB.replace("12,13,24,25", "12,13,24,99"))
    with pytest.raises(FileError, match="node 99 is used, but not defined"):
        read_mesh(tmp_path / "model.feb")


def _card(*values: object, width: int = 8) -> str:
    return "".join(f"{value:>{width}}" for value in values)


def test_ls_dyna_keyword_file(tmp_path: Path) -> None:
    nodes = "\n".join(f"{i:8d}{x:16.8f}{y:16.8f}{z:16.8f}" for i, (x, y, z) in zip((5, 6, 7, 8, 9), POINTS))
    lines = [
        *("*KEYWORD", "$ a comment", "*NODE", nodes, "*PART", "Healthy muscle", _card(1, 1, 1, width=10)),
        *("Lesion", _card(2, 1, 1, width=10), "*ELEMENT_SOLID"),
        *(_card(1, 1, 5, 6, 7, 8, 8, 8, 8, 8), _card(2, 2, 6, 7, 8, 9, 9, 9, 9, 9)),
        *("*ELEMENT_SHELL", _card(3, 1, 5, 6, 7, 7), "*SET_SEGMENT_TITLE", "ENDO", _card(4, width=10)),
        *(_card(5, 7, 6, 6, width=10), "*SET_SOLID_TITLE", "aha_4", _card(9, width=10), _card(2, width=10), "*END"),
    ]
    (tmp_path / "model.k").write_text("\n".join(lines) + "\n")
    mesh = read_mesh(tmp_path / "model.k")
    names = mesh.info["tag_names"]
    assert mesh.points.tolist() == POINTS
    assert mesh.cells["tetra"].tolist() == [[0, 1, 2, 3], [1, 2, 3, 4]]
    assert mesh.region.tolist() == [names["Healthy muscle"], names["Lesion"]]
    assert mesh.facets["triangle"].tolist() == [[0, 2, 1]]
    assert mesh.facet_tag.tolist() == [101]
    assert mesh.cell_data["aha"].tolist() == [0, 4]
    assert mesh.info["source"]["left_out"] == ["*ELEMENT_SHELL"]
    (tmp_path / "model.k").write_text("no keywords")
    with pytest.raises(FileError, match="no LS-DYNA keyword file"):
        read_mesh(tmp_path / "model.k")


def test_simvascular_folder(tmp_path: Path) -> None:
    grid = pyvista.UnstructuredGrid([4, 0, 1, 2, 3, 4, 1, 2, 3, 4], [10, 10], np.array(POINTS, dtype=float))
    grid.cell_data["ModelRegionID"] = np.array([1, 1])
    (tmp_path / "mesh-surfaces").mkdir()
    grid.save(tmp_path / "mesh-complete.mesh.vtu")
    face = pyvista.PolyData(np.array(POINTS, dtype=float)[[0, 1, 2]], [3, 0, 2, 1])
    face.point_data["GlobalNodeID"] = np.array([1, 2, 3])
    face.save(tmp_path / "mesh-surfaces" / "lumen.vtp")
    mesh = read_mesh(tmp_path)
    assert mesh.facets["triangle"].tolist() == [[0, 2, 1]]
    assert mesh.facet_tag.tolist() == [mesh.info["tag_names"]["lumen"]]
    face.clear_data()
    face.save(tmp_path / "mesh-surfaces" / "lumen.vtp")
    with pytest.raises(FileError, match=r"lumen\.vtp' has no point data GlobalNodeID"):
        read_mesh(tmp_path)
    with pytest.raises(FileError, match="holds no mesh-complete"):
        read_mesh(tmp_path / "mesh-surfaces")


@pytest.mark.parametrize("name", ["lv.feb", "lv.k", "lv.pts", "lv.inp", "lv.med", "lv.mesh"])
def test_command_line_converts_back(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_mesh(with_fibres(truncated_ellipsoid("tetra")), tmp_path / name)
    assert main(["convert", str(tmp_path / name), str(tmp_path / "back.vtu")]) == 0
    back = read_mesh(tmp_path / "back.vtu")
    assert {"fiber", "sheet"} <= set(back.cell_data)
    assert main(["convert", str(tmp_path / "back.vtu"), str(tmp_path / "lv"), "--format", "svmultiphysics"]) == 0
    assert main(["convert", str(tmp_path / "lv"), str(tmp_path / "again.vtu"), "-q"]) == 0
    assert np.array_equal(read_mesh(tmp_path / "again.vtu").region, back.region)
    assert capsys.readouterr().err == ""
