"""A Netgen mesh packed by gzip in, its mesh out, where it unpacks to no more than a mesh can."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Final

from femprep.errors import FileError
from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.model import VolumeMesh

#: Rows of numbers are packed to a fifth or so; a file of nothing but blanks to a thousandth.
_DENSEST: Final = 100


def read(path: Path) -> VolumeMesh:
    """Read a ``.vol.gz``.

    Raises
    ------
    FileError
        It unpacks to more than a hundred times its size, which meshio would read into memory.
    """
    room, length = _DENSEST * path.stat().st_size, 0
    with gzip.open(path, "rb") as stream:
        while block := stream.read(1 << 20):
            length += len(block)
            if length > room:
                raise FileError(f"{str(path)!r} unpacks to more than {_DENSEST} times its size; that is no mesh")
    return from_meshio(meshio_mesh(path))
