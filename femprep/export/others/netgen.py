"""A Netgen mesh in, packed by gzip or not, its mesh out, where it unpacks to no more than a mesh can."""

from __future__ import annotations

import gzip
import tempfile
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Final

from femprep.errors import FileError
from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.model import VolumeMesh

#: Rows of numbers are packed to a fifth or so; a file of nothing but blanks to a thousandth.
_DENSEST: Final = 100
#: Sections of one value, and lists that are read, of those that Netgen writes; meshio stops at what it does not know.
_VALUES: Final = ("dimension", "geomtype")
_LISTS: Final = (
    *("surfaceelements", "surfaceelementsgi", "surfaceelementsuv", "volumeelements", "points", "materials", "bcnames"),
)


def read(path: Path) -> VolumeMesh:
    """Read a ``.vol`` or ``.vol.gz``.

    Raises
    ------
    FileError
        It is damaged, or unpacks to more than a hundred times its size.
    """
    text = _unpacked(path) if path.suffix.lower() == ".gz" else path.read_text("latin-1")
    with tempfile.TemporaryDirectory() as folder:
        plain = Path(folder) / "mesh.vol"
        plain.write_text("".join(_wanted(text)), "latin-1")
        return from_meshio(meshio_mesh(plain, path))


def _wanted(text: str) -> Iterator[str]:
    """Lines of the sections that are read."""
    yield "mesh3d\n"
    rows = iter([line for line in text.splitlines(keepends=True) if line.split("#", 1)[0].strip()])
    for row in rows:
        word = row.strip()
        if word in (*_VALUES, *_LISTS, "endmesh"):
            yield row
        if word in _VALUES:
            yield next(rows, "")
        elif word in _LISTS:
            count = next(rows, "")
            yield count
            yield from islice(rows, int(count) if count.strip().isdigit() else 0)


def _unpacked(path: Path) -> str:
    room, parts = _DENSEST * path.stat().st_size, list[bytes]()
    length = 0
    with gzip.open(path, "rb") as stream:
        while block := stream.read(1 << 20):
            parts.append(block)
            length += len(block)
            if length > room:
                raise FileError(f"{str(path)!r} unpacks to more than {_DENSEST} times its size; that is no mesh")
    return b"".join(parts).decode("latin-1")
