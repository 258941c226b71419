"""A surface in text (.off, .ply, .obj) in; an error where it has not as many vertices and faces as it says.

trimesh takes what is there: a face as a vertex where one is missing, fewer faces where a file is cut short, and the
last point as the corner 0 of an OBJ file, of which it leaves out faces of two corners.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from femprep.errors import FileError

_ELEMENT: Final = re.compile(r"element\s+(\S+)\s+(\d+)")
_NO_CORNER: Final = re.compile(rb"^[ \t]*f\b[^\n]*[ \t]0(?=[/\s]|$)", re.MULTILINE)
_SHORT_FACE: Final = re.compile(rb"^[ \t]*f(?:[ \t]+[^\s#\\]+){0,2}[ \t\r]*(?:#[^\n]*)?$", re.MULTILINE)
_HEAD_END: Final = re.compile(rb"end_header[^\n]*\n")


def require_rows(path: Path) -> None:
    """Check the rows of an OFF file, or a PLY file in text, against its counts, and the corners of an OBJ file.

    Raises
    ------
    FileError
        There are more or fewer, or a face has fewer corners than it says.
    """
    data, ending = path.read_bytes(), path.suffix.lower()
    if ending == ".off":
        found = _off(data.decode("latin-1"))
    elif ending == ".ply" and (end := _HEAD_END.search(data)):
        found = _ply(data[: end.end()].decode("latin-1"), data[end.end() :])
    elif ending == ".obj" and (zero := _NO_CORNER.search(data)):
        raise FileError(f"{str(path)!r} has a face {zero[0].decode('latin-1').strip()[:60]!r}; corners begin with 1")
    elif ending == ".obj" and (short := _SHORT_FACE.search(data)):
        raise FileError(f"{str(path)!r} has a face {short[0].decode('latin-1').strip()[:60]!r}, expected three corners")
    else:
        return
    if found is None:
        return
    said, rows, faces = found
    if len(rows) != said:
        raise FileError(f"{str(path)!r} says it has {said} rows of vertices and faces, and has {len(rows)}")
    for row in faces:
        words = row.split()
        if not words[0].isdigit() or len(words) <= int(words[0]):
            raise FileError(f"{str(path)!r} has a face {row.strip()[:60]!r}, expected {words[0][:20]} corners")


def _rows(text: str) -> list[str]:
    return [row for line in text.splitlines() if (row := line.split("#", 1)[0]).strip()]


def _off(text: str) -> tuple[int, Sequence[str], Sequence[str]] | None:
    """How many rows there should be, those there are, and the faces among them; None where nothing tells."""
    rows = _rows(re.split("OFF", text, maxsplit=1)[-1])
    counts = rows[0].split()[:2] if rows else []
    if len(counts) < 2 or not all(word.isdigit() for word in counts):
        return None
    vertices, faces = int(counts[0][:18]), int(counts[1][:18])
    return vertices + faces, rows[1:], rows[1 + vertices :]


def _ply(head: str, body: bytes) -> tuple[int, Sequence[str], Sequence[str]] | None:
    """The same of a PLY file; of faces that begin with their corners."""
    if not re.search(r"format\s+ascii", head):
        return None
    elements = [(name, int(count[:18])) for name, count in _ELEMENT.findall(head)]
    rows, before = [row for row in body.decode("latin-1").splitlines() if row.strip()], 0
    faces: Sequence[str] = ()
    for name, count in elements:
        if name == "face" and re.search(r"element\s+face\s+\d+\s+property\s+list", head):
            faces = rows[before : before + count]
        before += count
    return before, rows, faces
