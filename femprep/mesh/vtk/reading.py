"""A file of VTK's in, its data set out, or one line that says what is wrong with it.

VTK reports a damaged file to its output window alone, and returns what it has read so far, or nothing. It believes
what a file says of the numbers of points and ends the process where a filter meets one that is not there.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np

from femprep.errors import FileError
from femprep.mesh.vtk.trial import may_end_the_process, reader_of, require_readable

#: Where the cells of the two kinds of data sets are.
_CELLS: Final = {"vtkPolyData": ("GetVerts", "GetLines", "GetPolys", "GetStrips"), "vtkUnstructuredGrid": ("GetCells",)}
#: What VTK says, beside an address in memory, of a legacy file whose kind of data set it does not find.
_NO_KIND: Final = "did not create output"


def load(path: Path) -> Any:
    """Read a VTK data set from a ``.vtu``, ``.vtp``, ``.vti``, ``.vtm``, ``.vtkhdf`` or legacy ``.vtk`` file.

    The blocks of a file of several become one unstructured grid.

    Raises
    ------
    FileError
        The file has a path that is no UTF-8, is damaged, its cells name points that it does not hold, or
        VTK's reader breaks down on it.
    """
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow

    try:
        str(path).encode()
    except UnicodeEncodeError:
        raise FileError(
            f"{str(path)!r} has letters in its path that are no UTF-8, which VTK needs; rename it"
        ) from None
    if may_end_the_process(path):
        require_readable(path)
    reader = reader_of(path)
    window, before = vtkStringOutputWindow(), vtkOutputWindow.GetInstance()
    verbosity = vtkLogger.GetCurrentVerbosityCutoff()
    vtkOutputWindow.SetInstance(window)
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        reader.Update()
        dataset = reader.GetOutput()
    finally:
        vtkLogger.SetStderrVerbosity(verbosity)
        vtkOutputWindow.SetInstance(before)
    reason = _damage(window.GetOutput())
    if reason and _NO_KIND in reason:
        raise FileError(
            f"{str(path)!r} holds no data set that VTK knows: its DATASET line is missing or of another kind"
        )
    if reason or dataset is None:
        raise FileError(f"{str(path)!r} is damaged: {reason or 'unreadable'}")
    if dataset.IsA("vtkCompositeDataSet"):
        import pyvista

        blocks = pyvista.wrap(dataset)
        for block in blocks.recursive_iterator(skip_none=True):
            _require_cells(block, path)
        dataset = blocks.combine()
    _require_cells(dataset, path)
    return dataset


def _damage(said: str) -> str | None:
    """The first line that tells of a damaged file, without its place in VTK's source; None where none does."""
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    if not any("ERR" in line or line.startswith("Error") for line in lines):
        return None
    told = (line.split("):", 1)[1].strip() for line in lines if "):" in line)
    return next((line for line in told if line), next((line for line in lines if line.startswith("Error")), lines[-1]))


def _require_cells(dataset: Any, path: Path) -> None:
    """Every cell's corners are points of the data set."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    count = dataset.GetNumberOfPoints()
    for name in _CELLS.get(dataset.GetClassName(), ()):
        cells = getattr(dataset, name)()
        if cells is None or not cells.GetNumberOfCells():
            continue
        first, corner = (vtk_to_numpy(array()) for array in (cells.GetOffsetsArray, cells.GetConnectivityArray))
        # Not by differences, which of numbers so large begin anew.
        if first[0] != 0 or first[-1] > len(corner) or np.any(first[1:] < first[:-1]):
            raise FileError(f"{str(path)!r} is damaged: its list of cells contradicts itself")
        wrong = np.flatnonzero((corner < 0) | (corner >= count))
        if wrong.size:
            raise FileError(
                f"{str(path)!r} is damaged: a cell names point {corner[wrong[0]]}, and it holds {count} points"
            )
