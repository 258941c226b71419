"""A legacy file of VTK's read once in a process of its own: its reader ends the process on some damaged files.

Run as a script it is that process; from the package, :func:`require_readable` starts it.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

from femprep.errors import FileError

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


def require_readable(path: Path) -> None:
    """Make sure that a legacy file does not end the process that reads it.

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


if __name__ == "__main__":
    legacy_reader(Path(sys.argv[1])).Update()
