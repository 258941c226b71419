from __future__ import annotations

import numpy as np
import pytest
import pyvista
import trimesh
from surface_shapes import cube_of_quads, sphere

from femprep.errors import FileError
from femprep.export import write_surface
from femprep.model import Surface
from femprep.surface.files import read_surface


def test_own_files_come_back_as_they_were(tmp_path):
    ball = sphere(subdivisions=2)
    directions = ball.points / np.linalg.norm(ball.points, axis=1, keepdims=True)
    rows = np.arange(len(ball.points))
    written = Surface(
        ball.points, ball.cells, "lv", directions, point_data={"rank": rows[::-1].copy()}, info={"vertices": len(rows)}
    )
    read = read_surface(write_surface(written, tmp_path / "lv.vtp"))
    assert read.points.tobytes() == written.points.tobytes()
    assert read.cells.tobytes() == written.cells.tobytes()
    assert read.directions.tobytes() == written.directions.tobytes()
    assert read.point_data["rank"].tolist() == written.point_data["rank"].tolist()
    assert read.name == "lv"
    assert read.info["vertices"] == len(rows)


def test_quadrilaterals_stay_quadrilaterals(tmp_path):
    read = read_surface(write_surface(cube_of_quads(), tmp_path / "cube.vtp"))
    assert read.cells.tolist() == cube_of_quads().cells.tolist()


@pytest.mark.parametrize("suffix", [".stl", ".ply", ".obj", ".off", ".vtp", ".vtk"])
def test_files_of_others(tmp_path, suffix):
    ball = sphere(subdivisions=2)
    path = tmp_path / f"ball{suffix}"
    if suffix in (".vtp", ".vtk"):
        pyvista.PolyData.from_regular_faces(ball.points, ball.cells).save(path)
    else:
        trimesh.Trimesh(ball.points, ball.cells, process=False).export(path)
    read = read_surface(path)
    assert len(read.points) == len(ball.points)
    assert len(read.cells) == len(ball.cells)
    assert read.volume == pytest.approx(ball.volume, rel=1e-5)
    assert read.name == "ball"


def test_an_inward_surface_is_turned_and_said_so(tmp_path):
    ball = sphere(subdivisions=1)
    trimesh.Trimesh(ball.points, ball.cells[:, ::-1], process=False).export(tmp_path / "in.stl")
    read = read_surface(tmp_path / "in.stl")
    assert read.volume > 0
    assert read.info["turned_outward"]
    assert read.info["merged_points"] == 3 * len(ball.cells) - len(ball.points)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.xyz", b"", "unknown surface format"),
        ("a.stl", None, "does not exist"),
        ("a.stl", b"nonsense", "damaged|no surface|no triangles"),
        ("a.vtp", b"<VTKFile broken", "damaged|no surface|no triangles"),
        ("a.ply", b"ply\nformat", "damaged|no surface|no triangles"),
        ("a.stl", b"solid empty\nendsolid empty\n", "damaged|no surface|no triangles"),
    ],
)
def test_bad_files_are_refused_in_one_line(tmp_path, name, content, message):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(FileError, match=message) as caught:
        read_surface(path)
    assert "\n" not in str(caught.value)


def test_materials_that_a_file_names_are_not_opened(tmp_path, monkeypatch):
    (tmp_path / "b.mtl").write_text("newmtl a\nmap_Kd picture.png\n")
    (tmp_path / "picture.png").write_bytes(b"no picture")
    triangle = "mtllib b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl a\nf 1/1 2/1 3/1\n"
    (tmp_path / "b.obj").write_text(triangle)
    opened = []
    monkeypatch.setattr("builtins.open", lambda name, *_, **__: opened.append(name))
    assert len(read_surface(tmp_path / "b.obj").cells) == 1
    assert opened == []


def test_unstructured_grids_are_read_without_their_lines_and_points(tmp_path):
    ball = sphere(subdivisions=1)
    lines = [pyvista.PolyData(ball.points, lines=[2, 0, 1]), pyvista.PolyData(ball.points[:3])]
    quads = pyvista.PolyData.from_regular_faces(cube_of_quads().points + 100.0, cube_of_quads().cells)
    grid = pyvista.merge([pyvista.PolyData.from_regular_faces(ball.points, ball.cells), quads, *lines])
    grid.cast_to_unstructured_grid().save(tmp_path / "a.vtu")
    read = read_surface(tmp_path / "a.vtu")
    assert read.cells.shape == (len(ball.cells) + 12, 3)
    assert any("lines" in notice["what"] for notice in read.info["notices"])


def test_a_volume_mesh_is_no_surface(tmp_path):
    pyvista.ImageData(dimensions=(3, 3, 3)).cast_to_unstructured_grid().save(tmp_path / "a.vtk")
    with pytest.raises(FileError, match="8 volume elements"):
        read_surface(tmp_path / "a.vtk")


def test_triangles_of_opencarp_are_read_in_mm(tmp_path):
    (tmp_path / "a.pts").write_text("4\n0 0 0\n1000 0 0\n1000 1000 0\n0 1000 0\n")
    (tmp_path / "a.elem").write_text("3\nTr 0 1 2 5\nQd 0 1 2 3 5\nLn 0 1 5\n")
    read = read_surface(tmp_path / "a.elem")
    assert len(read.cells) == 3
    assert read.points.max() == 1.0


def test_polygons_of_six_nodes_are_quadratic_triangles(tmp_path):
    """svMultiPhysics writes the faces of ten-node tetrahedra so: corners, then middles."""
    points = np.array(
        [[0, 0, 0], [2, 0, 0], [0, 2, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 2, 0], [2, 1, 0], [1, 2, 0]]
    )
    faces = [6, 0, 1, 2, 3, 4, 5, 6, 1, 6, 2, 7, 8, 4]
    pyvista.PolyData(points.astype(float), faces=faces).save(tmp_path / "a.vtp")
    read = read_surface(tmp_path / "a.vtp")
    corners = read.points[read.cells]
    area = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 2]
    assert area.tolist() == [0.5] * 8
