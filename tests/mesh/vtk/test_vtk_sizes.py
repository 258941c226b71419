"""What VTK writes is read; a file whose sizes are wrong is refused before it can end the process."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from femprep.errors import FileError
from femprep.mesh.vtk.reading import load

pyvista = pytest.importorskip("pyvista")


def grid() -> object:
    """Many tetrahedra that compress well: all in one place, all data zero."""
    cells = np.tile([0, 0, 0, 0], (20_000, 1))
    made = pyvista.UnstructuredGrid({10: cells}, np.zeros((10_000, 3)))
    made.point_data["load"] = np.zeros(10_000)
    made.field_data["note"] = np.arange(3)
    return made


def write(made: object, path: Path, mode: int, compressor: int = 1, encoded: bool = False) -> None:
    """Write a grid by VTK itself: 0 as text, 1 within the tags, 2 behind them; without a compressor or by one."""
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    writer = vtkXMLUnstructuredGridWriter()
    writer.SetInputData(made)
    writer.SetFileName(str(path))
    writer.SetDataMode(mode)
    writer.SetEncodeAppendedData(encoded)
    writer.SetCompressorType(compressor)
    if compressor % 2:
        writer.SetHeaderTypeToUInt64()
        writer.SetByteOrderToBigEndian()
    assert writer.Write()


@pytest.mark.parametrize("compressor", [0, 1, 2, 3])
@pytest.mark.parametrize(("mode", "encoded"), [(0, False), (1, False), (2, False), (2, True)])
def test_what_vtk_writes_is_read(mode: int, encoded: bool, compressor: int, tmp_path: Path) -> None:
    path = tmp_path / "grid.vtu"
    write(grid(), path, mode, compressor, encoded)
    assert load(path).GetNumberOfCells() == 20_000


@pytest.mark.parametrize("binary", [True, False])
def test_legacy_files_are_read(binary: bool, tmp_path: Path) -> None:
    grid().save(tmp_path / "grid.vtk", binary=binary)  # type: ignore[attr-defined]
    assert load(tmp_path / "grid.vtk").GetNumberOfPoints() == 10_000


def heart(path: Path) -> bytes:
    """A few tetrahedra, written to a file of any kind."""
    made = pyvista.UnstructuredGrid({10: np.array([[0, 1, 2, 3]])}, np.eye(4, 3))
    made.point_data["load"] = np.arange(4.0)
    made.field_data["note"] = np.arange(3)
    made.save(path, binary=path.suffix != ".vtk")
    return path.read_bytes()


@pytest.mark.parametrize("words", ["POINTS", "CELLS"])
@pytest.mark.parametrize("number", [10**12])
def test_numbers_of_legacy_files(words: str, number: int, tmp_path: Path) -> None:
    path = tmp_path / "grid.vtk"
    data = heart(path)
    found, count = re.subn(rf"{words} \d+".encode(), f"{words} {number}".encode(), data)
    assert count == 1
    path.write_bytes(found)
    with pytest.raises(FileError, match="damaged"):
        load(path)
