"""An AVS UCD file in, its mesh out, where no node, cell or row of data is numbered as another one is.

meshio keeps the last node of a number, and leaves what has no row of data as it was in the memory.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from femprep.errors import FileError
from femprep.export.deck.parts import require_once
from femprep.export.foreign import from_meshio
from femprep.export.through_meshio import meshio_mesh
from femprep.model import VolumeMesh


def read(path: Path) -> VolumeMesh:
    """Read a file in which nodes and cells are numbered once each, with one row of data for each of them.

    Raises
    ------
    FileError, InputError
        They are not.
    """
    _require_numbers(path)
    return from_meshio(meshio_mesh(path))


def _require_numbers(path: Path) -> None:
    rows = [words for line in path.read_text("latin-1").splitlines() if (words := line.split("#", 1)[0].split())]
    try:
        found = list(_numbers(rows))
    except (ValueError, IndexError):  # of which meshio says what is wrong
        return
    for what, numbers, wanted in found:
        require_once(numbers, what)
        if wanted is not None and set(numbers) != set(wanted):
            raise FileError(f"{str(path)!r} has a {what} of another number than its nodes or cells")


def _numbers(rows: Sequence[list[str]]) -> Iterator[tuple[str, list[int], list[int] | None]]:
    """What is numbered, its numbers, and those it should have."""
    nodes, cells, node_data, cell_data = map(int, rows[0][:4])
    at = 1
    own = {}
    for what, count in (("node", nodes), ("cell", cells)):
        own[what] = [int(float(row[0])) for row in rows[at : at + count]]
        yield what, own[what], None
        at += count
    for what, there in (("node", node_data), ("cell", cell_data)):
        if there:
            at += 1 + len(rows[at][1:])
            yield f"row of data of {what}", [int(row[0]) for row in rows[at : at + len(own[what])]], own[what]
            at += len(own[what])
