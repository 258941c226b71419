"""A VTK data set in, its XML file out: written array by array, at the speed of the disk where nothing can be gained.

VTK's own writer puts the whole file into memory first, or ends the process on a full disk. Here one array at a time is
deflated, in blocks, and blocks of numbers that hardly shrink (directions, most coordinates) are stored as they are.
"""

from __future__ import annotations

import binascii
import sys
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO, Final
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

#: Bytes of a block that is deflated by itself.
_BLOCK: Final = 1 << 20
#: Where the first of an array's blocks shrinks to more than this, deflating the others is not worth its time.
_WORTH: Final = 0.85
_TYPES: Final = {"i": "Int", "u": "UInt", "f": "Float"}


def write_dataset(dataset: Any, path: Path) -> None:
    """Write polygons or an unstructured grid as binary XML, byte for byte the same each time.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    polygons = dataset.IsA("vtkPolyData")
    kind = "PolyData" if polygons else "UnstructuredGrid"
    order = "LittleEndian" if sys.byteorder == "little" else "BigEndian"
    count = f'NumberOfPoints="{dataset.GetNumberOfPoints()}"'
    parts = {"Verts": "GetVerts", "Lines": "GetLines", "Strips": "GetStrips", "Polys": "GetPolys"} if polygons else {}
    cells = {name: getattr(dataset, get)() for name, get in parts.items()}
    if polygons:
        count += "".join(f' NumberOf{name}="{own.GetNumberOfCells()}"' for name, own in cells.items())
    else:
        count += f' NumberOfCells="{dataset.GetNumberOfCells()}"'
    with path.open("wb") as file:
        _line(file, '<?xml version="1.0"?>')
        head = f'<VTKFile type="{kind}" version="0.1" byte_order="{order}" header_type="UInt32"'
        _line(file, f'{head} compressor="vtkZLibDataCompressor">')
        _line(file, f"<{kind}>")
        _section(file, "FieldData", _arrays(dataset.GetFieldData()), field=True)
        _line(file, f"<Piece {count}>")
        _section(file, "PointData", _arrays(dataset.GetPointData()))
        _section(file, "CellData", _arrays(dataset.GetCellData()))
        points = dataset.GetPoints()
        _section(file, "Points", [("Points", _numpy(points.GetData()) if points else np.empty((0, 3)))])
        for name, own in cells.items():
            _section(file, name, _ends(own))
        if not polygons:
            _section(file, "Cells", [*_ends(dataset.GetCells()), ("types", _kinds(dataset))])
        _line(file, f"</Piece>\n</{kind}>\n</VTKFile>")


def _numpy(array: Any) -> npt.NDArray[Any]:
    """The numbers of a VTK array; they are not copied."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return np.asarray(vtk_to_numpy(array))


def _kinds(grid: Any) -> npt.NDArray[Any]:
    """VTK's type of each cell."""
    try:
        return _numpy(grid.GetCellTypes())
    except TypeError:  # before VTK 9.6
        return _numpy(grid.GetCellTypesArray())


def _arrays(data: Any) -> Iterable[tuple[str, npt.NDArray[Any]]]:
    for i in range(data.GetNumberOfArrays()):
        array = data.GetArray(i)
        yield array.GetName(), _numpy(array)


def _ends(cells: Any) -> list[tuple[str, npt.NDArray[Any]]]:
    """Nodes of cells, and behind which of them each cell ends."""
    return [
        ("connectivity", _numpy(cells.GetConnectivityArray())),
        ("offsets", _numpy(cells.GetOffsetsArray())[1:]),
    ]


def _section(file: BinaryIO, name: str, arrays: Iterable[tuple[str, npt.NDArray[Any]]], field: bool = False) -> None:
    _line(file, f"<{name}>")
    for title, values in arrays:
        own = np.ascontiguousarray(values)
        more = f' NumberOfComponents="{own.shape[1]}"' if own.ndim == 2 else ""
        more += f' NumberOfTuples="{len(own)}"' if field else ""
        kind = f"{_TYPES[own.dtype.kind]}{8 * own.dtype.itemsize}"
        _line(file, f'<DataArray type="{kind}" Name={quoteattr(title)}{more} format="binary">')
        _words(file, own)
        _line(file, "\n</DataArray>")
    _line(file, f"</{name}>")


def _line(file: BinaryIO, text: str) -> None:
    file.write(text.encode("ascii", "xmlcharrefreplace") + b"\n")


def _words(file: BinaryIO, array: npt.NDArray[Any]) -> None:
    """The numbers of an array: sizes of its blocks, then the blocks, each of both in base 64."""
    raw = array.reshape(-1).view(np.uint8).data
    blocks: list[bytes] = []
    level = 1
    for start in range(0, len(raw), _BLOCK):
        part = raw[start : start + _BLOCK]
        block = zlib.compress(part, level)
        if start == 0 and len(block) > _WORTH * len(part):
            level = 0  # stored as it is, in the same form
        blocks.append(block)
    head = np.array([len(blocks), _BLOCK, len(raw) % _BLOCK, *map(len, blocks)], dtype=np.uint32)
    file.write(binascii.b2a_base64(head.tobytes(), newline=False))
    rest = b""
    for block in blocks:
        data = rest + block
        whole = len(data) - len(data) % 3
        file.write(binascii.b2a_base64(memoryview(data)[:whole], newline=False))
        rest = data[whole:]
    file.write(binascii.b2a_base64(rest, newline=False))
