"""openCARP's binary pair ``.bpts .belem`` and its ``.blon``: arrays in, files out, and back.

Each begins with 1,024 bytes of text (how many, order of bytes, a word of MeshTool's), then come 32-bit numbers: as
MeshTool 1.3 writes and reads them (https://bitbucket.org/aneic/meshtool).
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.errors import FileError
from femprep.model import FloatArray, IntArray

_HEADER: Final = 1024
#: MeshTool's word for "this is a mesh", and for little-endian numbers.
_WORD, _LITTLE = 666, 0
#: Element types in the order of MeshTool's numbers, and how many nodes they have.
_TYPES: Final = (("Tt", 4), ("Hx", 8), ("Oc", 6), ("Py", 5), ("Pr", 6), ("Qd", 4), ("Tr", 3), ("Ln", 2))
_NUMBERS: Final = {word: number for number, (word, _) in enumerate(_TYPES)}
#: Bits of each number of an element.
_BITS: Final = 32
_ROWS: Final = 1_000_000


def write_points(path: Path, points: FloatArray) -> None:
    """Write points ``(n, 3)``, single precision."""
    _write(path, f"{len(points)} {_LITTLE} {_WORD}", [points])


def write_directions(path: Path, axes: Sequence[FloatArray]) -> None:
    """Write one or two directions of each element, ``(m, 3)`` each, single precision."""
    _write(path, f"{len(axes)} {len(axes[0])} {_LITTLE} {_WORD}", axes)


def _write(path: Path, header: str, columns: Sequence[FloatArray]) -> None:
    with path.open("wb") as file:
        file.write(header.encode().ljust(_HEADER, b"\0"))
        for start in range(0, len(columns[0]), _ROWS):
            part = [column[start : start + _ROWS] for column in columns]
            file.write(np.concatenate(part, axis=1).astype("<f4").tobytes())


def write_elements(path: Path, blocks: Sequence[tuple[str, IntArray, npt.NDArray[np.integer]]]) -> None:
    """Write elements: openCARP's word for their type, nodes ``(m, k)`` in its order, tags ``(m,)``, block by block."""
    count = [sum(len(nodes) for word, nodes, _ in blocks if word == name) for name, _ in _TYPES]
    with path.open("wb") as file:
        numbers = " ".join(map(str, (sum(count), _LITTLE, _BITS, *count)))
        file.write(numbers.encode().ljust(_HEADER, b"\0"))
        for word, nodes, tag in blocks:
            for start in range(0, len(nodes), _ROWS):
                own = slice(start, start + _ROWS)
                rows = np.column_stack([np.full(len(nodes[own]), _NUMBERS[word]), nodes[own], tag[own]])
                file.write(rows.astype("<i4").tobytes())


def read_points(path: Path) -> FloatArray:
    """Points ``(n, 3)``."""
    (count, *_), data = _read(path, "points", 3)
    return _floats(path, data, (count, 3))


def read_directions(path: Path) -> FloatArray:
    """Directions of each element, ``(m, 3)`` or ``(m, 6)``."""
    (axes, count, *_), data = _read(path, "directions", 4)
    return _floats(path, data, (count, 3 * axes))


def read_elements(path: Path) -> list[tuple[str, IntArray, IntArray]]:
    """Elements as blocks in their order: type, nodes ``(m, k)`` in openCARP's order, tags ``(m,)``."""
    (count, *_), data = _read(path, "elements", 2)
    numbers = np.frombuffer(data[: len(data) // 4 * 4], dtype="<i4")
    found, at, left = [], 0, count
    while left > 0:
        number = int(numbers[at]) if at < len(numbers) else -1
        if not 0 <= number < len(_TYPES):
            break
        word, nodes = _TYPES[number]
        rows = numbers[at : at + left * (nodes + 2)]
        rows = rows[: len(rows) // (nodes + 2) * (nodes + 2)].reshape(-1, nodes + 2)
        other = np.flatnonzero(rows[:, 0] != number)
        rows = rows[: other[0]] if len(other) else rows
        if len(rows) == 0:
            break
        found.append((word, rows[:, 1:-1].astype(np.int64), rows[:, -1].astype(np.int64)))
        at, left = at + rows.size, left - len(rows)
    if left > 0 or 4 * at != len(data):
        raise FileError(f"{str(path)!r} says {count} elements and holds {count - left}, in {len(data)} bytes")
    return found


def _read(path: Path, what: str, fields: int) -> tuple[list[int], bytes]:
    """The numbers of the header, and what follows it."""
    if not path.is_file():
        raise FileError(f"{str(path)!r} does not exist; the {what} of a binary openCARP mesh stand in it")
    data = path.read_bytes()
    words = data[:_HEADER].split(b"\0", 1)[0].split()
    if len(data) < _HEADER or len(words) < fields or not all(word.isdigit() for word in words):
        raise FileError(f"{str(path)!r} does not begin with the header of a binary openCARP file")
    numbers = [int(word) for word in words]
    if numbers[1 if what != "directions" else 2] != _LITTLE:
        raise FileError(f"{str(path)!r} has big-endian numbers; write it on another machine, or as text")
    return numbers, data[_HEADER:]


def _floats(path: Path, data: bytes, shape: tuple[int, int]) -> FloatArray:
    if len(data) != 4 * shape[0] * shape[1]:
        raise FileError(f"{str(path)!r} says {shape[0]} rows of {shape[1]} numbers and holds {len(data)} bytes")
    return np.frombuffer(data, dtype="<f4").reshape(shape).astype(np.float64)
