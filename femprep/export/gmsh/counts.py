"""A file of Gmsh's in; an error where its nodes are not as many as it says, or not each numbered once.

meshio asks for memory for as many nodes as a file says it has, and for the largest of their numbers; those that are not
listed stay what was in the memory.
"""

from __future__ import annotations

import mmap
import re
import warnings
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from femprep.errors import FileError

#: Version, text or binary, bytes of a count.
_FORMAT: Final = re.compile(
    rb"\s*(?:\$Comments\b.*?\$EndComments\s*)*\$MeshFormat\s+([24])(\.\d)?\s+([01])\s+([48])\s", re.DOTALL
)
#: Numbers of nodes that are let pass whatever the size of a file: meshio's table for them takes 128 MB.
_NUMBERED: Final = 1 << 24
_NUMERIC: Final = re.compile(rb"[\s\deE.+naifNAIF-]*")
#: A node of version 4.0, binary.
_NODE: Final = np.dtype([("number", "<i4"), ("x", "<f8", 3)])


def format_of(data: bytes | mmap.mmap) -> re.Match[bytes] | None:
    """Version, its digit, text or binary, and bytes of a count, at a file's beginning; comments may come first."""
    return _FORMAT.match(data)


def node_numbers(path: Path) -> npt.NDArray[np.float64] | None:
    """Numbers of the nodes of a ``.msh`` file, held against what it says of them, and its bytes.

    Returns
    -------
    (n,) array, or None
        In their order; None where nothing tells, or meshio wants them to be 1, 2, 3...

    Raises
    ------
    FileError
        There are others, a number is used twice or is none, or far larger than the file.
    """
    if not path.stat().st_size:
        return None
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
        found = format_of(data)
        if found is None:
            raise FileError(
                "it begins with no $MeshFormat of a version that is read (Gmsh 2.2 or 4.1; none of Ansys); convert it "
                f"first: meshio convert {path.name} {path.stem}.vtu"
            )
        start = data.find(b"$Nodes")
        place = data.find(b"\n", start) + 1
        if start < 0 or not place:
            return None
        if found[1] == b"4" and not found[2]:  # as Gmsh 4.0 wrote it, which meshio takes for 4.1
            raise FileError("it is of Gmsh's version 4.0, which is not read; let Gmsh save it as 4.1 or 2.2")
        numbers = _listed(data, place, found)
        if numbers is not None and len(numbers):
            _require_once(numbers, len(data))
        return numbers


def _listed(data: mmap.mmap, place: int, found: re.Match[bytes]) -> npt.NDArray[np.float64] | None:
    """The numbers of nodes that begin at a place, as many as there are to be."""
    size, text, version = len(data), found[3] == b"0", (found[1] + (found[2] or b"")).decode()
    early, count = version.startswith("2"), f"<u{found[4].decode()}"
    if text:
        source: _Source = _Text(data, place, size)
    else:  # of which version 2 has its count as text
        source = _Text(data, place, max(data.find(b"\n", place), place)) if early else _Binary(data, place)
    head = source.take(count, 1 if early else 2 if version == "4.0" else 4)[:2]  # nodes; or blocks, nodes
    if not head.size:
        return None
    if head.max() > size:
        raise FileError(f"it says it has {head.max():.0f} nodes, in {size} bytes")
    if early and not text:  # meshio wants them numbered from 1 on
        return None
    numbers = source.take(_NODE, int(head[0])) if early else _of_blocks(source, head[0], version, count, size)
    if len(numbers) != head[-1]:
        raise FileError(f"it says it has {head[-1]:.0f} nodes and lists {len(numbers)}")
    if source.left():
        raise FileError(f"it lists more than the {head[-1]:.0f} nodes that it says it has")
    return numbers


def _require_once(numbers: npt.NDArray[np.float64], size: int) -> None:
    """Every number is one, and used once."""
    if (wrong := numbers[~(np.isfinite(numbers) & (numbers == np.round(numbers)) & (numbers >= 1))]).size:
        raise FileError(f"it numbers a node {wrong[0]:g}, expected whole numbers from 1 on")
    if numbers.max() > max(size, _NUMBERED):
        raise FileError(f"it numbers a node {numbers.max():.0f}, in {size} bytes; number its nodes anew")
    once, times = np.unique(numbers, return_counts=True)
    if times.max() > 1:
        raise FileError(f"it has {times.max()} nodes {once[np.argmax(times)]:.0f}")


class _Source(Protocol):
    def take(self, form: Any, count: int) -> npt.NDArray[Any]: ...
    def left(self) -> bool: ...


class _Text:
    """Numbers of a text, whatever the lines they stand in, as far as there is nothing else."""

    def __init__(self, data: mmap.mmap, place: int, end: int) -> None:
        found = _NUMERIC.match(data, place, end)
        text = found[0].decode("ascii") if found else ""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # the same as the error, of older numpy
            try:
                self.numbers = np.fromstring(text, dtype=np.float64, sep=" ")
            except ValueError:  # which meshio says
                self.numbers = np.empty(0)
        self.at = 0

    def take(self, form: Any, count: int) -> npt.NDArray[Any]:
        if form == _NODE:
            return self.take(None, 4 * count)[::4]
        self.at += count
        return self.numbers[self.at - count : self.at]

    def left(self) -> bool:
        return self.at < len(self.numbers)


class _Binary:
    """Numbers of a binary file."""

    def __init__(self, data: mmap.mmap, place: int) -> None:
        self.data, self.at = data, place

    def take(self, form: Any, count: int) -> npt.NDArray[Any]:
        size = np.dtype(form).itemsize
        raw = self.data[self.at : self.at + size * count]
        self.at += len(raw)
        found = np.frombuffer(raw[: len(raw) // size * size], form)
        return found["number"] if form == _NODE else found

    def left(self) -> bool:
        return False  # what follows is another section, as far as numbers can tell


def _of_blocks(source: _Source, blocks: float, version: str, count: str, most: int) -> npt.NDArray[np.float64]:
    """Numbers of the nodes in the blocks of version 4, as far as they are there."""
    found = [np.empty(0)]
    for _ in range(int(blocks)):
        source.take("<i4", 3)
        own = source.take(count, 1)
        if not own.size or not 0 <= own[0] <= most:
            break
        found.append(source.take(_NODE if version == "4.0" else count, int(own[0])))
        if version != "4.0":
            source.take("<f8", 3 * int(own[0]))
    return np.concatenate(found).astype(np.float64)
