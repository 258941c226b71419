"""A folder for temporary files in, how much room it has, and the words for where it has too little."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Final

from femprep.errors import DiskFullError

#: Where temporary files can go instead.
REMEDY: Final = "set TMPDIR to a folder with more room"
#: A disk with less room than this is full, bytes.
_FULL: Final = 2**16


def require_room(folder: Path, least: float) -> None:
    """Make sure that a folder can take so many bytes.

    Raises
    ------
    DiskFullError
        It cannot.
    """
    room = shutil.disk_usage(folder).free
    if room < least:
        raise DiskFullError(
            f"{temporary(folder)} has {room / 1e6:.1f} MB left, the mesher needs {least / 1e6:.1f} MB or more; "
            f"free some space, or {REMEDY}"
        )


def is_full(folder: Path) -> bool:
    """Whether a folder can take next to nothing."""
    return shutil.disk_usage(folder).free < _FULL


def temporary(folder: Path) -> str:
    """Words for the place in which a temporary folder was made."""
    return f"the folder for temporary files, {str(folder.parent)!r},"
