"""A FLAC3D grid in, its mesh out, where meshio's table of its elements fits; its groups only where they are right."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Final

from femprep.errors import FileError
from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.model import VolumeMesh
from femprep.model.notice import Notice, noted

#: Numbers of elements and faces of nine digits and more; what is let pass whatever the size of a file.
_LONG: Final = re.compile(rb"^[ \t]*[ZF]\s+\w+\s+\+?(\d{9,})\s", re.MULTILINE)
_NUMBERED: Final = 1 << 27
#: What meshio makes of a ``W6`` is inside out: FLAC3D's first triangle has its normal outward.
_WEDGE: Final = [0, 2, 1, 3, 5, 4]


def read(path: Path) -> VolumeMesh:
    """Read a grid, without groups where there are several types of elements or faces.

    meshio 5.3.5 numbers the members of a group from the first block on, and means those of each. It asks for memory
    for the largest number of an element.

    Raises
    ------
    FileError
        An element is numbered far beyond the bytes of the file.
    """
    data = path.read_bytes()
    most = max((int(match[1][:20]) for match in _LONG.finditer(data)), default=0)
    if most > max(len(data), _NUMBERED):
        raise FileError(f"{str(path)!r} numbers an element {most}, in {len(data)} bytes; number them anew")
    mesh = meshio_mesh(path)
    for block in mesh.cells:
        if block.type == "wedge":
            block.data = block.data[:, _WEDGE]
    if len(mesh.cells) < 2 or not mesh.cell_sets:
        return from_meshio(mesh)
    words = f"groups {', '.join(mesh.cell_sets)} are left out: meshio mistakes them where there are several types"
    mesh.cell_sets = {}
    found = from_meshio(mesh)
    return replace(found, info=noted(found.info, Notice.of("left out", words)))
