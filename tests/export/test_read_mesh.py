"""Anyone's mesh files, and files that are none."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
import pyvista
from meshes import truncated_ellipsoid
from same_mesh import assert_same

from femprep.errors import FileError
from femprep.export import read_mesh, write_mesh
from femprep.model import VolumeMesh

FOREIGN_DECK = """*Heading
 from elsewhere
*Node
      10,           0.,           0.,           0.
      20,           1.,           0.,           0.
      30,           0.,           1.,           0.
      40,           0.,           0.,           1.
      50,           1.,           1.,           1.
*Element, type=C3D4H
100, 10, 20, 30, 40
*Element, type=C3D4, elset=Lesion
200, 20, 30, 40, 50
*Element, type=S3, elset=shell
300, 10, 20, 30
*Elset, elset=Healthy, generate
100, 100, 1
*Elset, elset=Everything
Healthy, Lesion
*Surface, type=ELEMENT, name=ENDO
Healthy, S1
*Surface, type=ELEMENT, name=outside
200, S4
"""


def test_foreign_abaqus_deck(tmp_path: Path) -> None:
    (tmp_path / "deck.inp").write_text(FOREIGN_DECK)
    mesh = read_mesh(tmp_path / "deck.inp")
    assert mesh.points.tolist() == [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    assert mesh.cells["tetra"].tolist() == [[0, 1, 2, 3], [1, 2, 3, 4]]
    names = mesh.info["tag_names"]
    assert mesh.region.tolist() == [names["Healthy"], names["Lesion"]]
    assert mesh.facets["triangle"].tolist() == [[0, 2, 1], [3, 1, 4]]
    assert mesh.facet_tag.tolist() == [101, names["outside"]]
    assert mesh.info["source"]["left_out"] == ["S3"]


@pytest.mark.parametrize("ending", ["vtu", "vtk"])
def test_foreign_vtk_grid_with_mixed_cells(ending: str, tmp_path: Path) -> None:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1.0]])
    cells = np.array([4, 0, 1, 2, 3, 3, 0, 2, 1, 4, 1, 2, 3, 4, 1, 0])
    grid = pyvista.UnstructuredGrid(cells, [10, 5, 10, 1], points)
    grid.cell_data["elemTag"] = [7, 101, 8, 9]
    grid.cell_data["fiber"] = np.arange(12.0).reshape(4, 3)
    grid.save(tmp_path / f"grid.{ending}")
    mesh = read_mesh(tmp_path / f"grid.{ending}")
    assert mesh.cells["tetra"].tolist() == [[0, 1, 2, 3], [1, 2, 3, 4]]
    assert mesh.region.tolist() == [7, 8]
    assert mesh.facets["triangle"].tolist() == [[0, 2, 1]]
    assert mesh.facet_tag.tolist() == [101]
    assert mesh.cell_data["fiber"].tolist() == [[0, 1, 2], [6, 7, 8]]


@pytest.mark.parametrize("ending", ["mesh", "med", "msh", "xdmf", "vtk", "vtu"])
def test_what_meshio_wrote(ending: str, tmp_path: Path) -> None:
    own = truncated_ellipsoid("tetra")
    array = {"mesh": "medit:ref", "med": "cell_tags", "msh": "gmsh:physical"}.get(ending, "region")
    data = {array: [own.region, own.facet_tag]}
    if ending == "msh":
        data["gmsh:geometrical"] = data[array]
    foreign = meshio.Mesh(
        own.points, [("tetra", own.cells["tetra"]), ("triangle", own.facets["triangle"])], cell_data=data
    )
    path = tmp_path / f"lv.{ending}"
    meshio.write(path, foreign, **({"file_format": "gmsh22"} if ending == "msh" else {}))
    mesh = read_mesh(path)
    assert_same(mesh, own, tolerance=1e-12)


def test_inverted_elements_stay_inverted(tmp_path: Path) -> None:
    own = truncated_ellipsoid("tetra")
    block = np.array(own.cells["tetra"])
    block[3] = block[3][[0, 2, 1, 3]]
    write_mesh(VolumeMesh(own.points, {"tetra": block}, own.region), tmp_path / "lv.inp")
    assert np.array_equal(read_mesh(tmp_path / "lv.inp").cells["tetra"], block)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        *((f"cut.{ending}", None) for ending in ("vtu", "inp", "msh", "xdmf")),
        *((f"empty.{ending}", b"") for ending in ("vtu", "vtk", "inp", "msh", "xdmf", "med", "mesh", "vtp")),
        *((f"noise.{ending}", bytes(range(256)) * 4) for ending in ("vtu", "vtk", "inp", "msh", "xdmf", "med", "mesh")),
        ("what.docx", b"hello"),
        ("noending", b"hello"),
    ],
)
def test_damaged_files_give_one_clear_line(
    name: str, content: bytes | None, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / name
    if content is None:
        formats = {"vtu": "vtu", "inp": "abaqus", "msh": "gmsh", "xdmf": "dolfinx"}
        write_mesh(truncated_ellipsoid("tetra"), path, format=formats[path.suffix[1:]])
        whole = path.read_bytes()
        path.write_bytes(whole[: len(whole) // 3])
    else:
        path.write_bytes(content)
    with pytest.raises(FileError) as caught:
        read_mesh(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_missing_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="does not exist"):
        read_mesh(tmp_path / "none.vtu")


def test_surface_mesh_is_refused_with_what_it_holds(tmp_path: Path) -> None:
    pyvista.UnstructuredGrid(pyvista.Sphere().triangulate()).save(tmp_path / "sphere.vtu")
    with pytest.raises(FileError, match="holds no volume elements \\(found triangle\\)"):
        read_mesh(tmp_path / "sphere.vtu")


FORMATS = {".msh": "gmsh22", ".mesh": "medit", ".xdmf": "xdmf"}


@pytest.mark.parametrize("ending", FORMATS)
def test_a_mesh_whose_elements_are_none_is_refused(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"none{ending}"
    meshio.write(path, meshio.Mesh(np.eye(4, 3), [("tetra", np.empty((0, 4), dtype=int))]), FORMATS[ending])
    with pytest.raises(FileError, match=r"holds no volume elements.*; give a mesh of tetra"):
        read_mesh(path)


@pytest.mark.parametrize("ending", [".node", ".ele"])
def test_tetgen_of_comments_alone(ending: str, tmp_path: Path) -> None:
    path, mesh = tmp_path / "mesh.node", truncated_ellipsoid(heights=2, around=6, layers=1)
    meshio.write(path, meshio.Mesh(mesh.points, list(mesh.cells.items())), "tetgen")
    assert read_mesh(path).n_cells == mesh.n_cells
    path.with_suffix(ending).write_text("# all else was lost\n")
    with pytest.raises(FileError, match="holds no"):
        read_mesh(path)


@pytest.mark.parametrize("content", [b"(2\0\0\0", b"(10 (0 1\n"])
def test_a_mesh_of_ansys_is_pointed_to_what_converts_it(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "mesh.msh").write_bytes(content)
    with pytest.raises(FileError, match="meshio convert"):
        read_mesh(tmp_path / "mesh.msh")


def test_coordinates_whose_squares_overflow_are_refused(tmp_path: Path) -> None:
    (tmp_path / "deck.inp").write_text(FOREIGN_DECK.replace("40,           0.", "40,        1e300"))
    with pytest.raises(FileError, match=r"point 3 is \[1e\+300, 0.0, 1.0\]"):
        read_mesh(tmp_path / "deck.inp")


def test_coordinates_that_are_no_numbers_are_refused(tmp_path: Path) -> None:
    (tmp_path / "deck.inp").write_text(FOREIGN_DECK.replace("40,           0.", "40,           nan"))
    with pytest.raises(FileError, match=r"point 3 is \[nan, 0.0, 1.0\] \(1 such\)"):
        read_mesh(tmp_path / "deck.inp")


def test_an_element_of_too_few_nodes(tmp_path: Path) -> None:
    grid = pyvista.UnstructuredGrid(np.array([3, 0, 1, 2]), np.array([10]), np.eye(4, 3))
    grid.save(tmp_path / "mesh.vtu")
    with pytest.raises(FileError, match="a tetra has 3 nodes, expected 4"):
        read_mesh(tmp_path / "mesh.vtu")


@pytest.mark.parametrize("tag", [2**62, -(2**63), 2**31])
def test_numbers_that_no_tag_can_be_are_not_cut_to_one(tag: int, tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra", heights=2, around=6, layers=1)
    tags = np.full(mesh.n_cells, tag, dtype=np.int64)
    blocks = [("tetra", np.array(mesh.cells["tetra"]))]
    meshio.write(tmp_path / "mesh.vtu", meshio.Mesh(mesh.points, blocks, cell_data={"material": [tags]}))
    found = read_mesh(tmp_path / "mesh.vtu")
    assert found.info["source"]["region"] == "none"
    assert np.array_equal(found.cell_data["material"], tags)


def test_numbers_of_elements_are_no_regions(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid(heights=3, around=8, layers=1)
    assert mesh.n_cells > 100
    found = meshio.Mesh(mesh.points, list(mesh.cells.items()), cell_data={"ID": [np.arange(mesh.n_cells)]})
    found.write(tmp_path / "a.vtu")
    read = read_mesh(tmp_path / "a.vtu")
    assert set(read.region.tolist()) == {0}
    assert read.cell_data["ID"].tolist() == list(range(mesh.n_cells))
    found.cell_data["ID"][0] //= 2
    found.write(tmp_path / "b.vtu")
    assert len(set(read_mesh(tmp_path / "b.vtu").region.tolist())) == mesh.n_cells // 2


@pytest.mark.parametrize(
    "ending", [".avs", ".bdf", ".cgns", ".dat", ".f3grid", ".h5m", ".post", ".su2", ".ugrid", ".vol"]
)
def test_a_format_that_is_not_read_says_what_converts_it(ending: str, tmp_path: Path) -> None:
    (tmp_path / f"mesh{ending}").write_text("anything")
    with pytest.raises(FileError, match=f"meshio convert mesh{ending} mesh.vtu"):
        read_mesh(tmp_path / f"mesh{ending}")
