"""A file of VTK's in; an error where it tells of more numbers than its bytes can hold.

VTK believes what a file says of its sizes: it asks for that much memory, and the process ends where there is none. Only
tags and key words are looked at here; whether the numbers themselves are sound is left to VTK.
"""

from __future__ import annotations

import base64
import binascii
import math
import mmap
import re
import struct
from pathlib import Path
from typing import Final
from xml.parsers import expat

from femprep.errors import FileError

#: What deflate shrinks a row of equal bytes to, and somewhat more: one byte of a file holds no more values.
_DENSEST: Final = 1100
#: The same of files that are not compressed: values of a bit.
_PLAIN: Final = 8
#: Attributes of a piece that are numbers of something.
_COUNTS: Final = tuple(f"NumberOf{what}" for what in ("Points", "Cells", "Verts", "Lines", "Strips", "Polys"))
#: Characters of an array's beginning, in which its head is.
_HEAD: Final = 32
#: Bytes that are read at a time.
_READ: Final = 1 << 20
#: Lines of legacy files with one number or more.
_LINE: Final = re.compile(
    rb"\n[ \t]*(?:(?:POINTS|VERTICES|LINES|POLYGONS|TRIANGLE_STRIPS|CELLS|CELL_TYPES|POINT_DATA|CELL_DATA|OFFSETS"
    rb"|CONNECTIVITY|FIELD|LOOKUP_TABLE|SCALARS|COLOR_SCALARS|TENSORS|TEXTURE_COORDINATES|GLOBAL_IDS)\b([^\r\n]*)"
    rb"|[^ \t\r\n]+((?:[ \t]+[-+]?\d+){2})[ \t]+[a-z_]+)[ \t]*\r?(?=\n)",
    re.IGNORECASE,
)
_NUMBER: Final = re.compile(rb"(?<![^ \t])[-+]?\d+(?![^ \t\r])")


def require_sizes(path: Path) -> None:
    """Check what a ``.vtu``, ``.vtp``, ``.vti`` or legacy ``.vtk`` file says of its sizes against the bytes it has.

    Raises
    ------
    FileError
        It tells of more values than it can hold, or a number of something is none.
    OSError
        It cannot be read.
    """
    with path.open("rb") as file:
        if not path.stat().st_size:
            return
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            wrong = _legacy(data) if path.suffix.lower() == ".vtk" else _Tags(data).wrong()
    if wrong:
        raise FileError(f"{str(path)!r} is damaged: {wrong}; copy or convert it again")


def _legacy(data: mmap.mmap) -> str | None:
    most = _PLAIN * len(data)
    for match in _LINE.finditer(data):
        product = 1
        for text in _NUMBER.findall(match[1] or match[2]):
            number = int(text[:20])
            product *= max(number, 1)
            if not 0 <= number <= most or (product > max(most, number) and match[2]):
                said = b" ".join(match[0].split())[:60].decode("latin-1")
                return f"it says {said!r} and has {len(data)} bytes"
    return None


class _EnoughError(Exception):
    """All tags have been read, or one is wrong: ``reason`` says how."""

    def __init__(self, reason: str | None = None) -> None:
        super().__init__()
        self.reason = reason


class _Tags:
    """What the tags of an XML file tell, each held against the bytes of the file as it comes."""

    def __init__(self, data: mmap.mmap) -> None:
        self.data, self.most = data, _DENSEST * len(data)
        self.form, self.packed = "<I", False
        self.rows = 1
        self.appended: list[str] = []
        self.text = b""
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._tag

    def wrong(self) -> str | None:
        """What is wrong; None where nothing is, or what VTK says itself."""
        try:
            for start in range(0, len(self.data), _READ):
                self.parser.Parse(self.data[start : start + _READ], start + _READ >= len(self.data))
        except _EnoughError as enough:
            return enough.reason
        except (expat.ExpatError, LookupError, ValueError):
            return None
        return None

    def _tag(self, name: str, found: dict[str, str]) -> None:
        if name == "VTKFile":
            order = ">" if found.get("byte_order") == "BigEndian" else "<"
            self.form = order + ("Q" if found.get("header_type") == "UInt64" else "I")
            self.packed = "compressor" in found
        elif "WholeExtent" in found:
            self.rows = self._extent(found)
        elif name == "Piece":
            self.rows = max([self._count(found, each) for each in _COUNTS if each in found], default=self.rows)
        elif name == "AppendedData":
            raise _EnoughError(self._appended(found.get("encoding") == "base64"))
        elif name in ("DataArray", "Array"):
            rows = max(self._count(found, "NumberOfTuples") if "NumberOfTuples" in found else self.rows, 1)
            if rows * self._count(found, "NumberOfComponents") > self.most:
                self._refuse(found, "NumberOfComponents")
            if found.get("format") == "appended":
                self.appended.append(found.get("offset", "").strip())
            elif found.get("format") == "binary":
                self.text = b""
                self.parser.CharacterDataHandler, self.parser.EndElementHandler = self._characters, self._ended

    def _characters(self, text: str) -> None:
        self.text += "".join(text.split()).encode("ascii", "replace")
        if len(self.text) >= _HEAD:
            self._ended()

    def _ended(self, _: str = "") -> None:
        """The head of an array is here, or all of the array."""
        self.parser.CharacterDataHandler = self.parser.EndElementHandler = None
        if reason := self.head(self.text, True):
            raise _EnoughError(reason)

    def _count(self, found: dict[str, str], name: str) -> int:
        text = found.get(name, "").strip() or "0"
        if not re.fullmatch("[0-9]{1,18}", text) or int(text) > self.most:
            self._refuse(found, name)
        return int(text)

    def _extent(self, found: dict[str, str]) -> int:
        """Points of an image."""
        words = found["WholeExtent"].split()
        if len(words) != 6 or not all(re.fullmatch("-?[0-9]{1,9}", word) for word in words):
            self._refuse(found, "WholeExtent")
        ends = [int(word) for word in words]
        points = math.prod(max(b - a + 1, 1) for a, b in zip(ends[::2], ends[1::2]))
        if points > self.most:
            self._refuse(found, "WholeExtent")
        return points

    def _refuse(self, found: dict[str, str], name: str) -> None:
        raise _EnoughError(f"it says {name}={found[name][:40]!r} and has {len(self.data)} bytes")

    def _appended(self, encoded: bool) -> str | None:
        """The heads of arrays behind all tags, each at its own place."""
        first = self.data.find(b"_", self.parser.CurrentByteIndex) + 1
        for text in self.appended:
            if not re.fullmatch("[0-9]{1,18}", text) or first == 0 or first + int(text) >= len(self.data):
                return f"an array begins at {text[:40]!r}, where the file has nothing"
            place = first + int(text)
            if reason := self.head(self.data[place : place + _HEAD], encoded):
                return reason
        return None

    def head(self, text: bytes, encoded: bool) -> str | None:
        """What the head of an array says: its bytes, or how many blocks of how many bytes, the last of how many."""
        count = 3 if self.packed else 1
        size = struct.calcsize(self.form)
        try:
            head = base64.b64decode(text[: 4 * -(-count * size // 3)], validate=True) if encoded else text
            numbers = [int(struct.unpack_from(self.form, head, size * k)[0]) for k in range(count)]
        except binascii.Error:  # VTK reads something into it, such as 10 GB
            return f"an array begins with {text[:40].decode('latin-1')!r}, which is no base 64"
        except struct.error:
            return None  # VTK's to say
        if self.packed and (numbers[2] > numbers[1] * min(numbers[0], 1) or (numbers[0] and not numbers[1])):
            # VTK divides by the size of blocks, and writes the last one where there is room for so many.
            return f"an array says that it has {numbers[0]} blocks of {numbers[1]} bytes, the last of {numbers[2]}"
        total, most = math.prod(numbers[:2]), self.most if self.packed else len(self.data)
        if total > most or numbers[0] * (size if self.packed else 1) > len(self.data):
            return f"an array says that it has {total} bytes, and the file has {len(self.data)}"
        return None
