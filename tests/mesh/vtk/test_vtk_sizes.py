"""Files of VTK's that tell of more than they can hold are refused before VTK asks for memory; sound ones are not."""

from __future__ import annotations

import base64
import re
from pathlib import Path

import numpy as np
import pytest

from femprep.errors import FileError
from femprep.mesh.vtk.reading import load
from femprep.mesh.vtk.sizes import require_sizes

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
    require_sizes(path)
    assert load(path).GetNumberOfCells() == 20_000


@pytest.mark.parametrize("binary", [True, False])
def test_legacy_files_are_read(binary: bool, tmp_path: Path) -> None:
    grid().save(tmp_path / "grid.vtk", binary=binary)  # type: ignore[attr-defined]
    require_sizes(tmp_path / "grid.vtk")
    assert load(tmp_path / "grid.vtk").GetNumberOfPoints() == 10_000


def heart(path: Path) -> bytes:
    """A few tetrahedra, written to a file of any kind."""
    made = pyvista.UnstructuredGrid({10: np.array([[0, 1, 2, 3]])}, np.eye(4, 3))
    made.point_data["load"] = np.arange(4.0)
    made.field_data["note"] = np.arange(3)
    made.save(path, binary=path.suffix != ".vtk")
    return path.read_bytes()


@pytest.mark.parametrize("number", [10**8, 10**12, 2**62, 10**30, -1])
@pytest.mark.parametrize(
    "name", ["NumberOfPoints", "NumberOfCells", "NumberOfTuples", "NumberOfComponents", "RangeMax"]
)
def test_numbers_of_xml_files(name: str, number: int, tmp_path: Path) -> None:
    path = tmp_path / "grid.vtu"
    data = heart(path)
    assert name.encode() in data
    path.write_bytes(re.sub(rf' {name}="[^"]*"'.encode(), f' {name}="{number}"'.encode(), data))
    if name == "RangeMax":  # says nothing of sizes
        assert load(path).GetNumberOfCells() == 1
        return
    with pytest.raises(FileError, match="is damaged: it says NumberOf"):
        load(path)


@pytest.mark.parametrize("extent", ["0 100000 0 100000 0 100000", "0 1 0 1", "0 1 0 1 0 99999999999", "0 1 0 1 0 x"])
def test_extents_of_images(extent: str, tmp_path: Path) -> None:
    path = tmp_path / "field.vti"
    image = pyvista.ImageData(dimensions=(3, 3, 3))
    image.point_data["edge_length"] = np.ones(27)
    image.save(path)
    assert load(path).GetNumberOfPoints() == 27
    path.write_bytes(path.read_bytes().replace(b'WholeExtent="0 2 0 2 0 2"', f'WholeExtent="{extent}"'.encode()))
    with pytest.raises(FileError, match="it says WholeExtent"):
        load(path)


@pytest.mark.parametrize("offset", ["100000000", "9" * 30, "-1", ""])
def test_arrays_behind_the_end(offset: str, tmp_path: Path) -> None:
    path = tmp_path / "grid.vtu"
    write(grid(), path, 2)
    path.write_bytes(re.sub(rb' offset="[^"]*"', f' offset="{offset}"'.encode(), path.read_bytes()))
    with pytest.raises(FileError, match="is damaged: an array begins at"):
        load(path)


@pytest.mark.parametrize("words", ["POINTS", "CELLS", "CELL_TYPES", "POINT_DATA", "note 1"])
@pytest.mark.parametrize("number", [10**8, 10**12, 2**62, 10**30, -1])
def test_numbers_of_legacy_files(words: str, number: int, tmp_path: Path) -> None:
    path = tmp_path / "grid.vtk"
    data = heart(path)
    found, count = re.subn(rf"{words} \d+".encode(), f"{words} {number}".encode(), data)
    assert count == 1
    path.write_bytes(found)
    with pytest.raises(FileError, match=f"it says '{words} {number}"):
        load(path)


def one_point(path: Path, head: list[int], wide: bool = False, compressed: bool = True) -> None:
    """A file of one array, of which there is the head alone."""
    numbers = np.array(head, dtype="<u8" if wide else "<u4").tobytes()
    compressor = ' compressor="vtkZLibDataCompressor"' if compressed else ""
    path.write_text(
        f'<VTKFile type="UnstructuredGrid" byte_order="LittleEndian" header_type="UInt{64 if wide else 32}"'
        f"{compressor}>"
        '<UnstructuredGrid><Piece NumberOfPoints="1" NumberOfCells="0"><Points>'
        f'<DataArray type="Float64" NumberOfComponents="3" format="binary">\n {base64.b64encode(numbers).decode()}'
        "</DataArray></Points></Piece></UnstructuredGrid></VTKFile>"
    )


@pytest.mark.parametrize("compressed", [True, False])
@pytest.mark.parametrize("wide", [True, False])
def test_heads_of_arrays(compressed: bool, wide: bool, tmp_path: Path) -> None:
    path, huge = tmp_path / "grid.vtu", 2**60 if wide else 2**31
    one_point(path, [huge, 1, 0] if compressed else [huge], wide, compressed)
    with pytest.raises(FileError, match=f"an array says that it has {huge} bytes"):
        load(path)


@pytest.mark.parametrize("head", [[1, 0, 8], [1, 0, 0], [0, 1 << 20, 8], [1, 32, 64], [2, 32, 33]])
@pytest.mark.parametrize("wide", [True, False])
def test_blocks_that_cannot_be(head: list[int], wide: bool, tmp_path: Path) -> None:
    """VTK divides by their size, or writes beyond them, which ends the process."""
    path = tmp_path / "grid.vtu"
    one_point(path, [*head, 8], wide)
    words = f"an array says that it has {head[0]} blocks of {head[1]} bytes, the last of {head[2]}"
    with pytest.raises(FileError, match=words):
        load(path)


def test_an_array_that_is_no_base_64_is_refused(tmp_path: Path) -> None:
    """VTK took 10 GB and 43 s for what it read into it."""
    path = tmp_path / "grid.vtu"
    write(grid(), path, 1)
    text = path.read_text()
    first = re.search(r'format="binary"[^>]*>\s*', text)
    assert first is not None
    path.write_text(text[: first.end() + 3] + "==" + text[first.end() + 5 :])
    with pytest.raises(FileError, match="which is no base 64"):
        load(path)
