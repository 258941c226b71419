"""A TetGen mesh in, its mesh out, where its two files are as long as their first lines say."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Final

from femprep.errors import FileError
from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.model import VolumeMesh

#: What the rows of a file are, by its ending.
_ROWS: Final = {".node": "nodes", ".ele": "tetrahedra"}


def read(path: Path) -> VolumeMesh:
    """Read a ``.node`` and the ``.ele`` of the same name, whichever is named.

    Raises
    ------
    FileError
        A file is damaged, or its first line counts more than it can hold: meshio asks for memory for it, and makes an
        array of every attribute, also of no rows. Or its tetrahedra have ten nodes.
    """
    with tempfile.TemporaryDirectory() as folder:
        for ending in _ROWS:
            _require_room(file := path.with_suffix(ending))
            text = file.read_text(encoding="utf-8", errors="replace")
            # meshio takes blanks alone for what parts numbers
            (Path(folder) / f"{path.stem}{ending}").write_text(text.replace("\t", " "), encoding="utf-8")
        return from_meshio(meshio_mesh(Path(folder) / path.name, path))


def _require_room(file: Path) -> None:
    """Check a file's first line against its size; one that does not count is meshio's to tell."""
    if not file.is_file():
        raise FileError(
            f"{str(file)!r} is missing; TetGen's nodes are in a .node, its elements in an .ele of that name"
        )
    with file.open(encoding="utf-8", errors="replace") as lines:
        head = next((words for words in map(str.split, lines) if words and not words[0].startswith("#")), [])
    if not head:  # for which meshio waits for ever
        raise FileError(f"{str(file)!r} holds no {_ROWS[file.suffix]}; copy or convert it again")
    if "BIN" in head:
        raise FileError(f"{str(file)!r} is binary, as Chaste writes it; write it as text")
    try:
        rows, *columns = map(int, head)
    except ValueError:
        return
    what, size = _ROWS[file.suffix], file.stat().st_size
    if file.suffix == ".ele" and columns[:1] == [10]:
        raise FileError(f"{str(file)!r} has tetrahedra of ten nodes, which are not read; run TetGen without -o2")
    if rows < 1 or min(columns, default=0) < 0:
        raise FileError(f"{str(file)!r} lists no {what}, by its first line: {' '.join(head)[:80]}")
    if 2 * rows * (1 + sum(columns)) > size + 1:  # a digit and a blank
        raise FileError(f"{str(file)!r} says it has {rows} {what} of {sum(columns)} numbers, in {size} bytes")
