"""A Gmsh file in text, and what meshio read of it, in; its data by the numbers of nodes and elements they are of, out.

meshio looks neither at these numbers nor at rows that are too many: data in another order went to other elements.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from femprep.errors import FileError
from femprep.export.gmsh.counts import format_of
from femprep.model import IntArray

#: Where the head of a data section begins.
_HEADS: Final = re.compile(rb"\$(?:Node|Element)Data[^\n]*\n")
#: What numbers no node: meshio counts those below 1 from the end of its table, and such of twenty digits wrap around.
_NO_NODE: Final = re.compile(rb"\s(?:-|0+(?:\s|$)|\d{19})")


class _Section(NamedTuple):
    name: str
    rows: Sequence[bytes]


class _Data(NamedTuple):
    """Numbers that the rows of a data section are of."""

    name: str
    numbers: IntArray


def by_their_numbers(path: Path, mesh: Any, nodes: npt.NDArray[np.float64] | None) -> None:
    """Put the data of a ``meshio.Mesh`` in the order of its nodes, whose numbers are given, and elements.

    Raises
    ------
    FileError
        A section has more or fewer rows than it says, or data are of other nodes or elements.
    """
    data = path.read_bytes()
    head = format_of(data)
    if nodes is None or head is None or head[3] != b"0":  # of binary ones meshio wants data in order
        return
    sections, version = list(_sections(data)), head[1] + (head[2] or b"")
    elements = [_elements(path, one.rows, version) for one in sections if one.name == "Elements"]
    found = {kind: [_data(path, one) for one in sections if one.name == kind] for kind in ("NodeData", "ElementData")}
    for name, rows in dict(found["NodeData"]).items():  # of one name meshio keeps the last, too
        mesh.point_data[name] = mesh.point_data[name][_order(path, name, rows, nodes)]
    for name, rows in dict(found["ElementData"]).items():
        ends = np.cumsum([len(block) for block in mesh.cell_data[name]])[:-1]
        values = np.concatenate(mesh.cell_data[name])
        mesh.cell_data[name] = np.split(values[_order(path, name, rows, elements[0])], ends)


def require_heads(path: Path) -> None:
    """Check that heads of data sections are not longer than the file: meshio reads on for ever.

    Raises
    ------
    FileError
    """
    data = path.read_bytes()
    for section in _HEADS.finditer(data):
        at = section.end()
        for _ in range(3):  # texts, real numbers, whole numbers
            line, at = data[at : at + 40].split(b"\n", 1)[0].strip(), data.find(b"\n", at) + 1
            if not line.isdigit() or not at:
                break
            if int(line) > len(data):
                said = line.decode()
                raise FileError(f"{str(path)!r} says that its data have {said} tags, in {len(data)} bytes")
            for _ in range(int(line)):
                if at >= len(data):
                    break
                at = data.find(b"\n", at) + 1 or len(data)


def _sections(data: bytes) -> Iterator[_Section]:
    """The sections of a file, up to the first that does not end."""
    start = data.find(b"$")
    while start >= 0:
        line = data.find(b"\n", start)
        name = data[start + 1 : line].strip()
        end = data.find(b"\n$End" + name, line) if line >= 0 else -1
        if end < 0:
            return
        rows = [row for row in data[line + 1 : end].split(b"\n") if row.strip()]
        yield _Section(name.decode("latin-1"), rows)
        start = data.find(b"$", end + len(name) + 5)


def _elements(path: Path, rows: Sequence[bytes], version: bytes) -> IntArray:
    """Numbers of the elements, in their order."""
    if version.startswith(b"2"):
        said, own = int(rows[0]), list(rows[1:])
    else:
        blocks, said = (int(word) for word in rows[0].split()[:2])
        own, at = [], 1
        for _ in range(blocks):
            count = int(rows[at].split()[3])
            own += rows[at + 1 : at + 1 + count]
            at += 1 + count
        own += rows[at:]
    if len(own) != said:
        raise FileError(f"{str(path)!r} says it has {said} elements and lists {len(own)}")
    for row in filter(_NO_NODE.search, own):
        words = row.split()
        nodes = words[3 + int(words[2]) :] if version.startswith(b"2") else words[1:]
        if any(_NO_NODE.match(b" " + word + b" ") for word in nodes):
            raise FileError(f"{str(path)!r} has an element of nodes {b' '.join(nodes).decode('latin-1')[:80]}")
    return _first(own)


def _first(rows: Sequence[bytes]) -> IntArray:
    return np.array([row.split(None, 1)[0] for row in rows]).astype(np.int64)


def _data(path: Path, section: _Section) -> _Data:
    rows = list(section.rows)
    heads: list[list[bytes]] = []
    for _ in range(3):  # texts, real numbers, whole numbers
        count = int(rows[0])
        heads.append(rows[1 : 1 + count])
        rows = rows[1 + count :]
    name, said = heads[0][0].strip().decode().replace('"', ""), int(heads[2][2])
    if len(rows) != said:
        raise FileError(f"{str(path)!r} says that its {name!r} has {said} rows and lists {len(rows)}")
    return _Data(name, _first(rows))


def _order(path: Path, name: str, rows: IntArray, wanted: npt.NDArray[Any]) -> npt.NDArray[np.intp]:
    """Which row is that of each node or element."""
    order = np.argsort(rows, kind="stable")
    place = np.searchsorted(rows[order], wanted)
    if len(rows) != len(wanted) or place.max(initial=-1) >= len(rows) or np.any(rows[order][place] != wanted):
        raise FileError(f"{str(path)!r} has {name!r} of other nodes or elements than its own")
    return order[place]
