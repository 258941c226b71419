"""VTK data sets to and from XML files, with numpy arrays as their data."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from femprep.errors import InputError, quoted
from femprep.export.vtk.file import write_dataset

#: Name of the field array (UTF-8 bytes of JSON) that keeps what VTK has no place for.
RECORD = "femprep_json"


def add_arrays(data: Any, arrays: Mapping[str, Any], what: str, *, shared: bool = False) -> None:
    """Add numpy arrays to point, cell or field data of a VTK data set; where ``shared``, they are not copied.

    Raises
    ------
    InputError
        An array is not numeric, or has more than two axes.
    """
    from vtkmodules.util.numpy_support import numpy_to_vtk

    for name, values in arrays.items():
        array = np.ascontiguousarray(values)
        if array.dtype.kind not in "biuf" or array.ndim not in (1, 2):
            raise InputError(
                f"{what} {name!r} is {array.dtype} with {array.ndim} axes; VTK files hold numbers with one or two axes"
            )
        vtk = numpy_to_vtk(array.astype(np.uint8) if array.dtype == bool else array, deep=not shared)
        vtk.SetName(name)
        data.AddArray(vtk)


def arrays_of(data: Any) -> dict[str, np.ndarray]:
    """Numeric arrays of point, cell or field data by name, as copies."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    found = {}
    for i in range(data.GetNumberOfArrays()):
        array = data.GetArray(i)
        if array is not None:  # strings are no data arrays
            found[array.GetName() or f"array_{i}"] = np.array(vtk_to_numpy(array))
    return found


def vtk_points(points: np.ndarray, *, shared: bool = False) -> Any:
    """VTK points of an ``(n, 3)`` array, in double precision; where ``shared``, they are not copied."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints

    out = vtkPoints()
    out.SetDataTypeToDouble()
    out.SetData(numpy_to_vtk(np.ascontiguousarray(points, dtype=np.float64), deep=not shared))
    return out


def vtk_cells(blocks: list[np.ndarray]) -> Any:
    """VTK cells of several blocks of node numbers, in their order."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    # Numbers of 32 bits where they suffice: half as much to compress.
    short = sum(block.size for block in blocks) < 2**31
    width = np.int32 if short and max((int(block.max(initial=0)) for block in blocks), default=0) < 2**31 else np.int64
    none = np.empty(0, dtype=width)
    sizes = np.concatenate([[0], *(np.full(len(block), block.shape[1]) for block in blocks)])
    nodes = np.concatenate([none, *(block.ravel().astype(width, copy=False) for block in blocks)])
    out = vtkCellArray()
    # These arrays are nobody else's.
    out.SetData(*(numpy_to_vtk(values, deep=False) for values in (np.cumsum(sizes, dtype=width), nodes)))
    return out


def add_record(dataset: Any, record: Mapping[str, Any]) -> None:
    """Keep a JSON-ready record in the field data of a data set."""
    text = json.dumps(record, sort_keys=True, ensure_ascii=True, default=_plain)
    add_arrays(dataset.GetFieldData(), {RECORD: np.frombuffer(text.encode(), dtype=np.uint8)}, "field data")


def _plain(value: Any) -> Any:
    """Read-only mappings and numpy values as what JSON knows."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise InputError(f"info holds {quoted(value)}, which is no JSON; give numbers, strings, lists and mappings of them")


def record_of(fields: Mapping[str, np.ndarray]) -> dict[str, Any]:
    """The record in the field data of a file of ours; empty for anyone else's."""
    if RECORD not in fields:
        return {}
    found: dict[str, Any] = json.loads(fields[RECORD].astype(np.uint8).tobytes().decode())
    return found


def save(dataset: Any, path: Path) -> None:
    """Write a VTK data set as binary XML, byte for byte the same each time.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    write_dataset(dataset, path)
