"""A NRRD's or MetaImage's header in, where its voxels are out; what ITK could not read safely is refused.

ITK copies what a header says into arrays of fixed length and gives the name of numbered files to ``snprintf`` as it
stands: values that are too long, or a ``%n`` in that name, overwrite memory or end the process. Where a MetaImage tells
wrongly where its voxels are, ITK makes labels of what is in the memory, or in the header.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple

from femprep.errors import FileError

REMEDY: Final = "copy or convert the file again"
#: Characters of a line of NRRD that is no ``key:=value``, no comment and no content, and of texts of MetaImage.
_LONGEST_NRRD: Final = 500
_LONGEST_META: Final = 250
#: The texts of MetaImage that go into arrays.
_META_TEXTS: Final = ("Comment", "Name", "ObjectType", "ObjectSubType", "AcquisitionDate")
#: Fields whose values are whole numbers, and how many at most; those that tell where the voxels are, and the last one.
_CHANNELS, _ROOM = "ElementNumberOfChannels", "CompressedDataSize"
_NUMBERS: Final = {"NDims": 1, "DimSize": None, _CHANNELS: 1, _ROOM: 1}
_PLACE: Final = (*_NUMBERS, "ElementType", "CompressedData", "HeaderSize")
_DATA: Final = "ElementDataFile"
#: Axes of an image that ITK reads.
_MOST_AXES: Final = 5
#: Bytes of a voxel by its type; of others one at least.
_BYTES: Final = {
    **dict.fromkeys(("SHORT", "USHORT"), 2),
    **dict.fromkeys(("INT", "UINT", "LONG", "ULONG", "FLOAT"), 4),
    **dict.fromkeys(("LONG_LONG", "ULONG_LONG", "DOUBLE"), 8),
}
#: What no text holds.
_CONTROL: Final = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")
#: Bytes read as one line.
_LINE: Final = 1 << 24


class Voxels(NamedTuple):
    """Where the voxels are.

    Attributes
    ----------
    path : Path
        File that holds them.
    offset : int
        Where they begin in it.
    compressed : bool
    number : int, optional
        How many the header tells of.
    room : int, optional
        Bytes they take in the file, of which nothing else looks at more.
    least : int
        Bytes they are at least once unpacked, where nobody else counts them.
    """

    path: Path
    offset: int
    compressed: bool
    number: int | None
    room: int | None = None
    least: int = 0


def nrrd_voxels(path: Path) -> Voxels:
    """The voxels of a NRRD file.

    Raises
    ------
    FileError
        A line is longer than ITK bears, sizes are no numbers, voxels begin in the header, or the files' name is no
        pattern.
    """
    with open(path, "rb") as file:
        fields = dict(_nrrd_fields(path, file))
        offset = file.tell()
    compressed = fields.get("encoding", "").lower() in ("gzip", "gz")
    count = math.prod(_numbers(path, "sizes", fields["sizes"])) if "sizes" in fields else None
    detached = fields.get("data file") or fields.get("datafile")
    if not detached:
        skipped = fields.get("byte skip", "")
        if skipped.startswith("-") and skipped != "-1":  # from the file's end into the header
            raise FileError(f"{path}: its header has 'byte skip' {skipped[:40]!r}, expected none here; {REMEDY}")
        return Voxels(path, offset, compressed, count)
    _require_pattern(path, detached)
    return Voxels(path.parent / detached, 0, compressed, count)


def _nrrd_fields(path: Path, file: BinaryIO) -> Iterator[tuple[str, str]]:
    """Names and values of the fields up to the first empty line."""
    listed = False
    while (line := file.readline(_LINE)) and line.strip():
        key, _, value = line.decode("latin-1").partition(":")
        key = key.strip().lower()
        free = key.startswith("#") or value.startswith("=") or key == "content"
        if (listed or not free) and len(line) > _LONGEST_NRRD:
            raise FileError(f"{path}: its header has a {key[:40]!r} of {len(line)} characters; {REMEDY}")
        listed |= key in ("data file", "datafile") and value.split()[:1] == ["LIST"]  # nothing but names follows
        if not free:
            yield key, value.strip()


def meta_voxels(path: Path) -> Voxels:
    """The voxels of a MetaImage.

    Raises
    ------
    FileError
        There are no voxels, a field is there twice, a text is longer than ITK bears, their sizes or place are not told
        in a way that ITK understands, or the files' name is no pattern.
    """
    fields: dict[str, str] = {}
    with open(path, "rb") as file:
        for field in _meta_fields(file):
            key, value = _meta_field(path, field)
            if key in fields:
                raise FileError(f"{path}: its header has {key[:40]!r} twice; keep one of them")
            fields[key] = value
            if key == _DATA:
                return _meta_place(path, fields, file.tell())
    raise FileError(f"{path}: its header has no {_DATA}; {REMEDY}")


def _meta_place(path: Path, fields: dict[str, str], offset: int) -> Voxels:
    """Where the voxels are by the fields of a header that ends at an offset."""
    numbers = {key: _numbers(path, key, fields[key], most) for key, most in _NUMBERS.items() if key in fields}
    name, compressed = fields[_DATA], fields.get("CompressedData", "")[:1] in ("T", "t", "1")
    if missing := [key for key in ("NDims", "DimSize") if key not in numbers]:
        raise FileError(f"{path}: its header has no {missing[0]}; {REMEDY}")
    (axes,), sizes, (channels,) = numbers["NDims"], numbers["DimSize"], numbers.get(_CHANNELS, [1])
    if not 0 < axes <= min(len(sizes), _MOST_AXES):  # ITK ends the process from 11 on
        expected = f"{axes} (NDims)" if axes <= _MOST_AXES else f"NDims of at most {_MOST_AXES} in place of {axes}"
        raise FileError(f"{path}: its header has {len(sizes)} sizes, expected {expected}; {REMEDY}")
    count = math.prod(sizes[:axes]) * channels
    least = count * _BYTES.get(fields.get("ElementType", "").removeprefix("MET_"), 1)
    local, skipped = name.upper() == "LOCAL", fields.get("HeaderSize", "0")
    if skipped != "0" and (compressed or (local and skipped != "-1")):  # ITK skips from the file's beginning
        raise FileError(f"{path}: its header has 'HeaderSize' {skipped[:40]!r}, expected none here; {REMEDY}")
    if not local:
        _require_pattern(path, name)
        return Voxels(path.parent / name, 0, compressed, count, None, least)
    (room,) = numbers.get(_ROOM, [0])
    if compressed and not room:
        raise FileError(
            f"{path}: its header has no {_ROOM}, without which ITK makes labels of what is in the memory; "
            f"add {f'{_ROOM} = {path.stat().st_size - offset}'!r}"
        )
    return Voxels(path, offset, compressed, count, room if compressed else None, least)


def _meta_fields(file: BinaryIO) -> Iterator[bytes]:
    """Fields of a header; one that its line leaves without a value has that of the next line, as in ITK."""
    while field := file.readline(_LINE):
        while not re.search(rb"[=:][=:\s]*[^=:\s]", field) and (line := file.readline(_LINE)):
            field += line
        yield field


def _meta_field(path: Path, field: bytes) -> tuple[str, str]:
    """Name and value of a field; of a name its first word, with which ITK is content."""
    text = field.decode("latin-1")
    if _CONTROL.search(field):
        raise FileError(f"{path}: before any {_DATA} its header has {text[:40]!r}, no text; {REMEDY}")
    name, *values = re.split("[=:]", text, maxsplit=1)
    name, value = name.strip(" \t\r\n"), "".join(values).lstrip("=: \t\r\n").rstrip()  # ITK skips every mark
    key = next(iter(re.findall(r"\w+", name)), "")
    if _DATA in value or (_DATA in name and (name != _DATA or not values)):  # ITK may take another one
        raise FileError(f"{path}: its header has {text[:40]!r}, expected '{_DATA} ='; {REMEDY}")
    if name not in _PLACE and (meant := set(re.findall(r"\w+", name)).intersection(_PLACE)):
        raise FileError(f"{path}: its header has {name[:40]!r}, expected '{min(meant)} ='; {REMEDY}")
    if key in _META_TEXTS and len(value) > _LONGEST_META:
        raise FileError(f"{path}: its header has a {key!r} of {len(value)} characters; {REMEDY}")
    return key, value


def _require_pattern(path: Path, name: str) -> None:
    """Check that a file's name has no place for anything but one number in it."""
    if "%" in re.sub(r"%\d{0,2}d", "", name, count=1):
        raise FileError(f"{path}: its header has voxels in {name[:40]!r}, expected a name or a pattern; {REMEDY}")


def _numbers(path: Path, key: str, text: str, most: int | None = None) -> list[int]:
    """Whole numbers of a field; of anything else ITK takes what comes before it, or another line's."""
    words = text.split()
    if not words or len(words) > (most or len(words)) or not all(re.fullmatch("[0-9]{1,18}", word) for word in words):
        raise FileError(f"{path}: its header has {key!r} {text[:40]!r}, expected whole numbers; {REMEDY}")
    return [int(word) for word in words]
