"""A file of VTK's read once in a process of its own: its readers end the process on some damaged files.

Those are legacy files, and XML files that are not compressed: VTK asks for as many corners as the last of a list of
cells says. Compressed ones have a check sum, which random damage does not pass.

Run as a script it is that process; from the package, :func:`require_readable` starts it.
"""

from __future__ import annotations

import mmap
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from femprep.errors import FileError

#: Endings of VTK's files that are HDF5; those of ``.h5`` may be of others.
HDF = (".vtkhdf", ".hdf", ".h5")
#: How XML says that arrays are compressed, within so many bytes; and that one is text all the same.
_COMPRESSED, _HEAD = b"compressor=", 4096
_TEXT = re.compile(rb"""format\s*=\s*["']ascii""")
#: Address space of the trial, bytes: of the libraries, and for each byte of the file, in which a number of eight bytes
#: takes two at least and is copied.
_LIBRARIES, _FOR_EACH_BYTE = 2 << 30, 32
#: Seconds the trial may take, and for each megabyte.
_SECONDS, _SECONDS_PER_MEGABYTE = 30.0, 1.0


def legacy_reader(path: Path) -> Any:
    """VTK's reader of a legacy file, told to read all of its data."""
    from vtkmodules.vtkIOLegacy import vtkDataSetReader

    reader = vtkDataSetReader()
    reader.SetFileName(str(path))
    reader.ReadAllScalarsOn()
    reader.ReadAllVectorsOn()
    reader.ReadAllFieldsOn()
    return reader


def reader_of(path: Path) -> Any:
    """VTK's reader of a file, by its ending."""
    from vtkmodules import vtkIOXML

    ending = path.suffix.lower()
    if ending == ".vtk":
        return legacy_reader(path)
    if ending in HDF:
        from vtkmodules.vtkIOHDF import vtkHDFReader

        reader = vtkHDFReader()
    else:
        kinds = {".vtu": "UnstructuredGrid", ".vtp": "PolyData", ".vti": "ImageData", ".vtm": "MultiBlockData"}
        reader = getattr(vtkIOXML, f"vtkXML{kinds[ending]}Reader")()
    reader.SetFileName(str(path))
    return reader


def may_end_the_process(path: Path) -> bool:
    """Whether VTK believes numbers of a file that no check sum goes with."""
    if path.suffix.lower() == ".vtk" or not path.stat().st_size:
        return path.suffix.lower() == ".vtk"
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        return _COMPRESSED not in data[:_HEAD] or _TEXT.search(data) is not None


def require_readable(path: Path) -> None:
    """Make sure that a file does not end the process that reads it.

    Raises
    ------
    FileError
        It does, or is not read in time.
    """
    limit = _SECONDS + _SECONDS_PER_MEGABYTE * path.stat().st_size / 1e6
    nothing = subprocess.DEVNULL
    try:
        done = subprocess.run(
            [sys.executable, "-m", __name__, str(path)], stdin=nothing, stdout=nothing, stderr=nothing, timeout=limit
        )
    except subprocess.TimeoutExpired as error:
        raise FileError(f"{str(path)!r} is damaged: VTK's reader is not done with it after {limit:.0f} s") from error
    if done.returncode:
        raise FileError(f"{str(path)!r} is damaged: VTK's reader breaks down on it (status {done.returncode})")


def _limit_memory(path: Path) -> None:
    """Have this process end where VTK asks for far more than the file can hold, though a machine may lend it."""
    try:
        import resource
    except ImportError:  # Windows
        return
    most = _LIBRARIES + _FOR_EACH_BYTE * path.stat().st_size
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))


def read_within_limits(path: Path) -> None:
    """Read a file with the memory of a trial: what that process does, and it may end it."""
    _limit_memory(path)
    reader_of(path).Update()


if __name__ == "__main__":
    read_within_limits(Path(sys.argv[1]))
