"""Surfaces, walls, facets and meshes as VTK itself and meshio read them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pytest
import pyvista
import trimesh
from meshes import mixed, truncated_ellipsoid, with_fibres

from femprep.errors import FemprepWarning, FileError, InputError, OptionError
from femprep.export import read_mesh, write_facets, write_mesh, write_purkinje, write_surface, write_wall
from femprep.mesh.elements import match_facets
from femprep.model import FACET_TAGS, Plane, PurkinjeNet, Surface, Wall


def tetrahedron() -> tuple[np.ndarray, np.ndarray]:
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]) * 10.1
    return points, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def test_surface_keeps_numbering_directions_and_data(tmp_path: Path) -> None:
    points, cells = tetrahedron()
    directions = points / 20.0
    surface = Surface(points, cells, "lv", directions, point_data={"u": np.arange(4.0)}, info={"vertices": 4})
    assert write_surface(surface, tmp_path / "lv.vtp") == tmp_path / "lv.vtp"
    found = pyvista.read(tmp_path / "lv.vtp")
    assert np.array_equal(found.points, points)
    assert np.array_equal(found.faces.reshape(-1, 4)[:, 1:], cells)
    assert np.array_equal(found.point_data["direction"], directions)
    assert np.array_equal(found.point_data["u"], np.arange(4.0))
    assert found.volume == pytest.approx(surface.volume)
    assert found.is_manifold


def test_quadrilateral_surface(tmp_path: Path) -> None:
    cube = pyvista.Cube().clean()
    surface = Surface(cube.points, cube.regular_faces, "cube")
    write_surface(surface, tmp_path / "cube.vtp")
    assert np.array_equal(pyvista.read(tmp_path / "cube.vtp").regular_faces, cube.regular_faces)


@pytest.mark.parametrize("ending", [".stl", ".ply", ".obj", ".off", ".STL"])
def test_an_ending_means_its_format(ending: str, tmp_path: Path) -> None:
    cube = pyvista.Cube().clean()
    surface = Surface(cube.points + 3.25, cube.regular_faces, "cube", point_data={"u": np.arange(8.0)})
    with pytest.warns(FemprepWarning, match=f"'cube{ending}' leaves out the data u"):
        path = write_surface(surface, tmp_path / f"cube{ending}")
    found = trimesh.load(path)
    assert len(found.faces) == 12
    assert found.volume == pytest.approx(surface.volume)
    assert found.bounds.ravel().tolist() == pytest.approx([2.75] * 3 + [3.75] * 3)
    points, triangles = tetrahedron()
    wall = Wall(points, triangles, [101, 102, 103, 103], [5, -1, 7, 8])
    with pytest.warns(FemprepWarning, match="facet_tag"):
        assert trimesh.load(write_wall(wall, tmp_path / f"wall{ending}")).volume == pytest.approx(wall.volume)
    mesh = truncated_ellipsoid("hexahedron")
    with pytest.warns(FemprepWarning, match="facet_tag"):
        found = trimesh.load(write_facets(mesh, tmp_path / f"facets{ending}"))
    assert len(found.faces) == 2 * mesh.n_facets


@pytest.mark.parametrize("name", ["lv.msh", "lv", "lv.vtk", "lv.stl.gz"])
def test_other_endings_are_refused_with_those_that_are_known(name: str, tmp_path: Path) -> None:
    with pytest.raises(OptionError, match=r"\.vtp, \.stl, \.ply, \.obj, \.off"):
        write_surface(Surface(*tetrahedron(), "lv"), tmp_path / name)
    net = PurkinjeNet(np.eye(3), [[0, 1], [1, 2]], [111, 111], [0, -1, -1])
    mesh = replace(truncated_ellipsoid("tetra"), purkinje=net)
    with pytest.raises(OptionError, match=r"expected one of \.vtp$"):
        write_purkinje(mesh, tmp_path / "net.stl")
    assert not list(tmp_path.iterdir())


def test_wall_has_tags_template_and_names(tmp_path: Path) -> None:
    points, triangles = tetrahedron()
    wall = Wall(points, triangles, [101, 102, 103, 103], [5, -1, 7, 8], {"base": Plane([0, 0, 0], [0, 0, 1])})
    write_wall(wall, tmp_path / "wall.vtp")
    found = pyvista.read(tmp_path / "wall.vtp")
    assert found.cell_data["facet_tag"].tolist() == [101, 102, 103, 103]
    assert found.point_data["template"].tolist() == [5, -1, 7, 8]
    assert found.field_data["base"].tolist() == [FACET_TAGS["base"], 2]
    assert found.volume == pytest.approx(wall.volume)


@pytest.mark.parametrize("kind", ["tetra", "tetra10", "wedge", "hexahedron20", "mixed"])
def test_facets_name_their_nodes_and_elements(kind: str, tmp_path: Path) -> None:
    mesh = mixed() if kind == "mixed" else truncated_ellipsoid(kind)
    write_facets(mesh, tmp_path / "facets.vtp")
    found = pyvista.read(tmp_path / "facets.vtp")
    assert found.is_manifold
    assert found.n_cells == mesh.n_facets
    assert np.array_equal(found.cell_data["facet_tag"], mesh.facet_tag)
    node = found.point_data["GlobalNodeID"] - 1
    assert np.array_equal(found.points, mesh.points[node])
    element, _ = match_facets(mesh.cells, mesh.facets)
    assert np.array_equal(found.cell_data["GlobalElementID"] - 1, element)
    assert found.field_data["endo"].tolist() == [FACET_TAGS["endo"], 2]


@pytest.mark.parametrize("kind", ["tetra", "tetra10", "wedge", "hexahedron", "hexahedron20", "mixed"])
def test_mesh_holds_volume_cells_alone_and_positive(kind: str, tmp_path: Path) -> None:
    mesh = with_fibres(mixed() if kind == "mixed" else truncated_ellipsoid(kind, curved=True))
    write_mesh(mesh, tmp_path / "mesh.vtu")
    found = pyvista.read(tmp_path / "mesh.vtu")
    assert found.n_cells == mesh.n_cells
    assert np.array_equal(found.cell_data["region"], mesh.region)
    assert np.array_equal(found.cell_data["fiber"], mesh.cell_data["fiber"])
    assert found.field_data["septum"].tolist() == [3, 3]
    assert found.compute_cell_sizes(length=False, area=False)["Volume"].min() > 0
    other = meshio.read(tmp_path / "mesh.vtu")
    assert [block.type for block in other.cells] == list(mesh.cells)
    for block, nodes in zip(other.cells, mesh.cells.values()):
        # meshio takes linear wedges by VTK's documentation, where VTK itself finds their volumes negative.
        order = [0, 2, 1, 3, 5, 4] if block.type == "wedge" else slice(None)
        assert np.array_equal(block.data[:, order], nodes)


def test_wedges_of_a_foreign_file_in_the_documented_order_are_turned(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("wedge")
    meshio.Mesh(mesh.points, [("wedge", mesh.cells["wedge"])]).write(tmp_path / "wedges.vtu")
    assert pyvista.read(tmp_path / "wedges.vtu").compute_cell_sizes()["Volume"].max() < 0
    assert np.array_equal(read_mesh(tmp_path / "wedges.vtu").cells["wedge"], mesh.cells["wedge"])


def test_data_that_are_no_numbers_are_refused(tmp_path: Path) -> None:
    mesh = truncated_ellipsoid("tetra")
    with pytest.raises(InputError, match="'label' holds no real numbers but <U1"):
        write_mesh(mesh.with_data(cell={"label": np.full(mesh.n_cells, "a")}), tmp_path / "mesh.vtu")
    assert not list(tmp_path.iterdir())


def test_arrays_of_several_blocks_come_back_shrunk_or_stored(tmp_path: Path) -> None:
    count = 300_000
    rng = np.random.default_rng(1)
    points = rng.normal(size=(count, 3))  # nothing to gain: stored
    surface = Surface(points, np.arange(count).reshape(-1, 3), "cloud", point_data={"zero": np.zeros(count)})
    path = write_surface(surface, tmp_path / "cloud.vtp")
    found = pyvista.read(path)
    assert np.array_equal(found.points, points)
    assert np.array_equal(found.faces.reshape(-1, 4)[:, 1:], surface.cells)
    assert not found.point_data["zero"].any()
    # Four letters for three bytes, of the points whole, of the zeros next to nothing.
    assert points.nbytes * 4 / 3 < path.stat().st_size < (points.nbytes + 0.5 * surface.cells.nbytes) * 4 / 3
    first = path.read_bytes()
    write_surface(surface, path)
    assert path.read_bytes() == first


@pytest.mark.parametrize("number", [-1, 255, 2**32 + 10])
def test_a_cell_of_an_unknown_type_is_not_lost_without_a_word(number: int, tmp_path: Path) -> None:
    """Files of meshio's, whose integer type VTK does not know, are read by meshio, which leaves such a cell out."""
    mesh, path = truncated_ellipsoid("tetra"), tmp_path / "a.vtk"
    regions = {"region": [mesh.region.astype(np.int32)]}
    meshio.Mesh(mesh.points, [("tetra", mesh.cells["tetra"])], cell_data=regions).write(path, binary=False)
    text = path.read_text()
    assert "vtktypeint32" in text
    assert read_mesh(path).n_cells == mesh.n_cells
    head, types = text.split("CELL_TYPES", 1)
    path.write_text(f"{head}CELL_TYPES{types.replace(chr(10) + '10' + chr(10), f'{chr(10)}{number}{chr(10)}', 1)}")
    with pytest.raises(FileError, match=f"says it has {mesh.n_cells} cells, of which {mesh.n_cells - 1} are read"):
        read_mesh(path)
