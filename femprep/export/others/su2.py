"""An SU2 mesh in, its mesh out, where it has as many elements and points as it says; markers keep their names."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import FileError
from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.export.wedges import turned_wedges
from femprep.model import VolumeMesh

#: A keyword with its value, and the rows up to the next one; ``%`` begins a comment.
_LIST: Final = re.compile(r"^[ \t]*(NELEM|NPOIN|MARKER_ELEMS)[ \t]*=[ \t]*(\d+)[^\n]*\n?((?:[^=\n]*\n)*)", re.MULTILINE)
_TAG: Final = re.compile(r"^[ \t]*MARKER_TAG[ \t]*=([^\n]*)", re.MULTILINE)
#: What meshio calls the numbers of markers.
_TAGS: Final = "su2:tag"
#: meshio takes the points of the first zone for those of all.
_ZONES: Final = re.compile(r"^[ \t]*NZONE[ \t]*=[ \t]*(\d+)", re.MULTILINE)


def read(path: Path) -> VolumeMesh:
    """Read a mesh.

    Raises
    ------
    FileError
        A list is shorter or longer than it says: meshio takes what is there of a file that is cut short. Or there are
        several zones, or markers to which meshio gives the same number.
    """
    text = path.read_text("latin-1")
    if (zones := _ZONES.search(text)) and int(zones[1][:18]) > 1:
        raise FileError(f"{str(path)!r} has {zones[1][:18]} zones; write one of them")
    for what, said, rows in _LIST.findall(text + "\n"):
        count = sum(1 for row in rows.splitlines() if row.split("%", 1)[0].strip())
        if count != int(said[:18]):
            raise FileError(f"{str(path)!r} says {what}= {said[:18]} and lists {count}; copy or convert it again")
    numbers = _numbers(path, [word.strip() for word in _TAG.findall(text)])
    mesh = meshio_mesh(path)
    for block in mesh.cells:
        if block.type == "wedge":  # SU2's types are VTK's
            block.data = turned_wedges(block.data, np.asarray(mesh.points))
    for name, number in numbers.items():
        if name != str(number):  # of meshio's choice: below 0 it is none of the file's
            mesh.cell_data[_TAGS] = [np.where(tags == number, -number, tags) for tags in mesh.cell_data[_TAGS]]
            mesh.field_data[name] = np.array([-number, 2])
    return from_meshio(mesh)


def _numbers(path: Path, tags: Sequence[str]) -> dict[str, int]:
    """Numbers of the markers: their own, or what meshio gives to a name, which is one more than the marker before."""
    numbers, last = {}, 0
    for tag in tags:
        last = int(tag) if re.fullmatch(r"[-+]?\d{1,9}", tag) else last + 1
        numbers[tag.split("%", 1)[0].strip()] = last  # a number with a comment behind it is a name to meshio
    if len(set(numbers.values())) < len(tags):
        raise FileError(f"{str(path)!r} has markers {', '.join(tags)[:60]}: twice the same, or numbers and names mixed")
    return numbers
