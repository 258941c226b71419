"""Sets of nodes, of points and lines, and of elements that are no regions: told in one line; those of ours are none."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
import pyvista
from meshes import truncated_ellipsoid, with_fibres
from notices import reported

import femprep as fp
from femprep.anatomy import add_pericardium
from femprep.export.table import FORMATS

LEFT = "{} of the file are left out"


def told(path: Path) -> list[str]:
    return reported(fp.read_mesh(path))


def written(path: Path, old: str = "", new: str = "") -> Path:
    """A mesh of ours with something put in."""
    fp.write_mesh(truncated_ellipsoid("tetra"), path)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new + old, 1))
    return path


@pytest.mark.parametrize("name", FORMATS)
def test_files_of_ours_are_told_of_nothing(name: str, tmp_path: Path) -> None:
    mesh = with_fibres(truncated_ellipsoid("tetra"))
    height = mesh.points[:, 2] - mesh.points[:, 2].min()
    mesh = add_pericardium(mesh.with_data(point={"apicobasal": height / height.max()}))
    path = tmp_path / Path(FORMATS[name].filename).name
    fp.write_mesh(mesh, path, format=name)
    springs = ["elements of types *ELEMENT_DISCRETE of the file are left out"]
    assert told(path) == (springs if name == "ls-dyna" else [])


def test_sets_of_nodes_of_abaqus(tmp_path: Path) -> None:
    rows = "*NSET, NSET=fix\n1, 2\n*NSET, NSET=Epi\n1\n*NSET, NSET=all, GENERATE\n1, 2000000000\n*NSET, NSET=none\n"
    path = written(tmp_path / "a.inp", "*NSET, NSET=endo\n", rows)
    assert told(path) == [LEFT.format("sets of nodes fix, Epi")]


def test_sets_of_ls_dyna(tmp_path: Path) -> None:
    rows = "*SET_NODE_LIST_TITLE\npacing\n         7\n         1         2\n"
    rows += "*SET_PART_LIST_TITLE\nmuscle\n         8\n         1\n*SET_NODE_ADD\n        12\n         7\n"
    rows += "*SET_SOLID_TITLE\nscar\n         9\n         1\n"
    words = "sets of nodes pacing, sets of solids scar and sets *SET_PART_LIST_TITLE muscle, *SET_NODE_ADD 12"
    assert told(written(tmp_path / "a.k", "*END\n", rows)) == [LEFT.format(words)]


def test_sets_of_febio(tmp_path: Path) -> None:
    rows = (
        '<NodeSet name="pacing">1,2</NodeSet><NodeSet name="odd">@1</NodeSet><ElementSet name="scar">1,2</ElementSet>'
    )
    rows += '<Edge name="rim"><line2 id="1">1,2</line2></Edge>'
    words = "sets of nodes pacing, odd, sets of elements scar and sets of edges rim"
    assert told(written(tmp_path / "a.feb", "</Mesh>\n<MeshDomains>", rows)) == [LEFT.format(words)]


def test_groups_of_points_and_lines_of_gmsh(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    cells = [("vertex", [[0]]), ("line", [[0, 1]]), ("tetra", mesh.cells["tetra"])]
    tags = [np.array([301]), np.array([302]), mesh.region]
    names = {"site": np.array([301, 0]), "rim": np.array([302, 1]), "lv": np.array([1, 3])}
    data = {"gmsh:physical": tags, "gmsh:geometrical": tags}
    meshio.Mesh(mesh.points, cells, cell_data=data, field_data=names).write(tmp_path / "a.msh", file_format="gmsh22")
    words = "elements of types line, vertex and groups of points or lines site, rim"
    assert told(tmp_path / "a.msh")[-1] == LEFT.format(words)


def test_references_of_vertices_of_medit(tmp_path: Path) -> None:
    path = written(tmp_path / "a.mesh", "\nEnd\n", "\nEdges\n1\n1 2 302\n")
    text = path.read_text()
    first = text.split("Vertices\n", 1)[1].splitlines()[1]
    path.write_text(text.replace(first, first[:-1] + "7", 1))
    assert told(path) == [LEFT.format("elements of types line and references of vertices 7")]


def test_lines_and_field_data_of_vtk(tmp_path: Path) -> None:
    cells, kinds = [1, 0, 2, 0, 1, 4, 0, 1, 2, 3], [1, 3, 10]
    grid = pyvista.UnstructuredGrid(cells, kinds, np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1.0)]))
    grid.field_data["time"] = [1.5]
    grid.field_data["note"] = ["by hand"]
    grid.field_data["lv"] = np.array([1, 3])
    grid.save(tmp_path / "a.vtu")
    assert told(tmp_path / "a.vtu") == [LEFT.format("elements of types line, vertex and field data time, note")]


def test_groups_of_nodes_of_med(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    found = meshio.Mesh(mesh.points, [("tetra", mesh.cells["tetra"])], cell_data={"cell_tags": [mesh.region * 0]})
    found.point_data["point_tags"] = np.where(np.arange(len(mesh.points)) < 3, 1, 0)
    found.point_tags, found.cell_tags = {1: ["pacing"]}, {}
    found.write(tmp_path / "a.med")
    assert told(tmp_path / "a.med") == [LEFT.format("sets of nodes pacing")]
