"""A file of Gmsh's in; an error where it tells of more nodes than it has bytes: meshio asks for memory for them."""

from __future__ import annotations

import mmap
import re
import struct
from pathlib import Path
from typing import Final

from femprep.errors import FileError

#: Version 4, text or binary, bytes of a count. Earlier versions have one node a line, which ends with the file.
_FORMAT: Final = re.compile(rb"\$MeshFormat\s+4\S*\s+([01])\s+([48])\s")
#: Characters in which the format, and a line of counts, stand.
_HEAD: Final = 200


def require_counts(path: Path) -> None:
    """Check the counts of blocks and nodes against the bytes of a ``.msh`` file of version 4; others are let pass.

    Raises
    ------
    FileError
        They are larger.
    """
    if not path.stat().st_size:
        return
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        found = _FORMAT.search(data[: 20 * _HEAD])
        line = data.find(b"\n", data.find(b"$Nodes")) + 1
        if found is None or not line:
            return
        head = data[line : line + _HEAD]
        if found[1] == b"0":
            counts = [int(word[:20]) for word in head.split()[:2] if word.isdigit()]
        else:
            width = int(found[2])
            counts = list(struct.unpack("=2I" if width == 4 else "=2Q", head[: 2 * width].ljust(2 * width, b"\0")))
        if max(counts, default=0) > len(data):
            raise FileError(f"{str(path)!r} is damaged: it says it has {max(counts)} nodes, in {len(data)} bytes")
