"""An SU2 mesh in, its mesh out, where it has as many elements and points as it says."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

from femprep.errors import FileError
from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.model import VolumeMesh

#: A keyword with its value, and the rows up to the next one; ``%`` begins a comment.
_LIST: Final = re.compile(r"^[ \t]*(NELEM|NPOIN|MARKER_ELEMS)[ \t]*=[ \t]*(\d+)[^\n]*\n?((?:[^=\n]*\n)*)", re.MULTILINE)
#: meshio takes the points of the first zone for those of all.
_ZONES: Final = re.compile(r"^[ \t]*NZONE[ \t]*=[ \t]*(\d+)", re.MULTILINE)


def read(path: Path) -> VolumeMesh:
    """Read a mesh.

    Raises
    ------
    FileError
        A list is shorter or longer than it says: meshio takes what is there of a file that is cut short. Or there are
        several zones.
    """
    if (zones := _ZONES.search(path.read_text("latin-1"))) and int(zones[1][:18]) > 1:
        raise FileError(f"{str(path)!r} has {zones[1][:18]} zones; write one of them")
    for what, said, rows in _LIST.findall(path.read_text("latin-1") + "\n"):
        count = sum(1 for row in rows.splitlines() if row.split("%", 1)[0].strip())
        if count != int(said[:18]):
            raise FileError(f"{str(path)!r} says {what}= {said[:18]} and lists {count}; copy or convert it again")
    return from_meshio(meshio_mesh(path))
