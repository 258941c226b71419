"""Damaged files of VTK's are refused in one line, by every reader that meets them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista
from meshes import truncated_ellipsoid
from slow_params import slow_but
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

import femprep as fp
from femprep.mesh.vtk.reading import load


@pytest.fixture
def ball(tmp_path: Path) -> Path:
    path = tmp_path / "ball.vtk"
    surface = pyvista.Icosphere(radius=30.0, nsub=2)
    surface.point_data["place"] = np.asarray(surface.points)
    surface.save(path)
    return path


def test_cells_that_name_points_which_are_not_there(ball: Path) -> None:
    """VTK's own filters end the process on such a file."""
    data = bytearray(ball.read_bytes())
    place = data.index(b"CONNECTIVITY") + len(b"CONNECTIVITY vtktypeint64\n")
    data[place : place + 8] = (2**40).to_bytes(8, "big")
    ball.write_bytes(bytes(data))
    with pytest.raises(fp.FileError, match="a cell names point 1099511627776, and it holds 162 points"):
        fp.read_surface(ball)


@pytest.mark.parametrize("wrong", [[2**40], [2**62, -(2**62) - 10]], ids=["too large", "so large that they wrap"])
def test_a_list_of_cells_that_contradicts_itself(ball: Path, wrong: list[int]) -> None:
    """Each of the second ones is larger than the one before, where numbers have 64 bits: the process ended."""
    data = bytearray(ball.read_bytes())
    place = data.index(b"OFFSETS") + len(b"OFFSETS vtktypeint64\n") + 8
    data[place : place + 8 * len(wrong)] = b"".join(one.to_bytes(8, "big", signed=True) for one in wrong)
    ball.write_bytes(bytes(data))
    with pytest.raises(fp.FileError, match="contradicts itself"):
        load(ball)


def test_a_file_that_ends_the_process_which_reads_it(ball: Path) -> None:
    """Cells are written otherwise since version 5: the reader of version 4 takes their offsets for cells."""
    data = ball.read_bytes()
    assert b"Version 5.1" in data
    ball.write_bytes(data.replace(b"Version 5.1", b"Version 4.1"))
    with pytest.raises(fp.FileError, match="damaged: VTK's reader breaks down on it"):
        fp.read_surface(ball)


def test_file_cut_off_in_its_last_array(ball: Path) -> None:
    """VTK says so in a warning, and gives what it has read."""
    data = ball.read_bytes()
    ball.write_bytes(data[: data.index(b"POINT_DATA") + 500])
    with pytest.raises(fp.FileError, match="damaged: Error reading binary data"):
        fp.read_surface(ball)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["", "DATASET HEART"])
def test_a_legacy_file_without_its_kind_is_told_so(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "mesh.vtk"
    path.write_text(f"# vtk DataFile Version 3.0\nheart\nASCII\n{kind}\nPOINTS 1 float\n0 0 0\n")
    with pytest.raises(fp.FileError, match=r"mesh.vtk' holds no data set that VTK knows: its DATASET line"):
        load(path)


@pytest.mark.parametrize(("ending", "damage"), [(".vtp", b"</Points>"), (".vtp", b"eNo"), (".vtk", b"POLYGONS")])
def test_nothing_of_vtk_is_on_the_screen(tmp_path: Path, ending: str, damage: bytes) -> None:
    path = tmp_path / f"ball{ending}"
    pyvista.Icosphere(radius=30.0, nsub=2).save(path)
    data = path.read_bytes()
    assert damage in data or damage == b"eNo"
    path.write_bytes(data.replace(damage, b"####") if damage in data else data[:2000])
    command = [sys.executable, "-m", "femprep", "compare", str(path), str(path)]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 2, ended.stderr
    assert ended.stderr.count("\n") == 1, ended.stderr
    assert ended.stderr.startswith("femprep: error: ")


def test_a_document_type_without_entities_is_read(tmp_path: Path) -> None:
    path = tmp_path / "mesh.xdmf"
    mesh = truncated_ellipsoid(heights=2, around=6, layers=1)
    fp.write_mesh(mesh, path, format="dolfinx")
    text = path.read_text()
    if "<!DOCTYPE" not in text:
        path.write_text(text.replace("<Xdmf", '<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []>\n<Xdmf', 1))
    assert "<!DOCTYPE" in path.read_text()
    assert np.array_equal(fp.read_mesh(path).points, mesh.points)


@pytest.mark.parametrize("last", slow_but(["999999999999"], ["999999999999", "9000000000000000000"]))
def test_a_list_of_cells_that_says_it_is_huge(last: str, tmp_path: Path) -> None:
    """VTK asks for as much memory, and ends the process where there is none."""
    grid = pyvista.UnstructuredGrid(np.array([4, 0, 1, 2, 3]), np.array([10]), np.eye(4, 3))
    writer = vtkXMLUnstructuredGridWriter()
    path = tmp_path / "mesh.vtu"
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    writer.SetDataModeToAscii()
    writer.Write()
    text = path.read_text()
    first = text.index('Name="offsets"')
    place = text.index("4", text.index(">", first))
    path.write_text(text[:place] + last + text[place + 1 :])
    done = subprocess.run(
        [sys.executable, "-c", f"import femprep as fp; fp.read_mesh({str(path)!r})"], capture_output=True, text=True
    )
    assert done.returncode == 1  # an exception, not a signal
    assert "FileError" in done.stderr
    assert "is damaged" in done.stderr.splitlines()[-1]
