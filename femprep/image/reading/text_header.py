"""A NRRD's or MetaImage's header in, where its voxels are out; what ITK could not read safely is refused.

ITK copies what a header says into arrays of fixed length and gives the name of numbered files to ``snprintf`` as it
stands: values that are too long, or a ``%n`` in that name, overwrite memory or end the process.
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
#: The field after which there are voxels or nothing.
_DATA: Final = "ElementDataFile"
#: Bytes read as one line.
_LINE: Final = 1 << 24


class Voxels(NamedTuple):
    """File that holds the voxels, where they begin, whether they are compressed, and how many the header tells of."""

    path: Path
    offset: int
    compressed: bool
    number: int | None


def nrrd_voxels(path: Path) -> Voxels:
    """The voxels of a NRRD file.

    Raises
    ------
    FileError
        A line is longer than ITK bears, or the files' name is no pattern.
    """
    with open(path, "rb") as file:
        fields = dict(_nrrd_fields(path, file))
        offset = file.tell()
    compressed = fields.get("encoding", "").lower() in ("gzip", "gz")
    count = _product(fields.get("sizes", ""))
    detached = fields.get("data file") or fields.get("datafile")
    if not detached:
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
        There are no voxels, a text is longer than ITK bears, or the files' name is no pattern.
    """
    compressed, count, channels = False, None, 1
    with open(path, "rb") as file:
        for field in _meta_fields(file):
            key, value = _meta_field(path, field)
            if key == "NDims" and not re.fullmatch("[0-9]{1,2}", value):
                raise FileError(f"{path}: its header has NDims {value[:40]!r}, expected a number of axes; {REMEDY}")
            if key == "CompressedData":
                compressed = value.lower() == "true"
            elif key == "DimSize":
                count = _product(value)
            elif key == "ElementNumberOfChannels":
                channels = _product(value) or 1
            elif key == _DATA:
                count = None if count is None else count * channels
                if value.upper() == "LOCAL":
                    return Voxels(path, file.tell(), compressed, count)
                _require_pattern(path, value)
                return Voxels(path.parent / value, 0, compressed, count)
    raise FileError(f"{path}: its header has no {_DATA}; {REMEDY}")


def _meta_fields(file: BinaryIO) -> Iterator[bytes]:
    """Fields of a header; one that its line leaves without a value has that of the next line, as in ITK."""
    while field := file.readline(_LINE):
        while not re.search(rb"[=:][=:\s]*[^=:\s]", field) and (line := file.readline(_LINE)):
            field += line
        yield field


def _meta_field(path: Path, field: bytes) -> tuple[str, str]:
    """Name and value of a field; of a name its first word, with which ITK is content."""
    name, *values = re.split("[=:]", field.decode("latin-1"), maxsplit=1)
    name, value = name.strip(" \t\r\n"), "".join(values).strip()
    key = next(iter(re.findall(r"\w+", name)), "")
    if _DATA in value or (_DATA in name and (name != _DATA or not values)):  # ITK may take another one
        raise FileError(f"{path}: its header has {field.decode('latin-1')[:40]!r}, expected '{_DATA} ='; {REMEDY}")
    if key in _META_TEXTS and len(value) > _LONGEST_META:
        raise FileError(f"{path}: its header has a {key!r} of {len(value)} characters; {REMEDY}")
    return key, value


def _require_pattern(path: Path, name: str) -> None:
    """Check that a file's name has no place for anything but one number in it."""
    if "%" in re.sub(r"%\d{0,2}d", "", name, count=1):
        raise FileError(f"{path}: its header has voxels in {name[:40]!r}, expected a name or a pattern; {REMEDY}")


def _product(text: str) -> int | None:
    """The product of whole numbers; None where a text is something else."""
    words = text.split()
    return math.prod(map(int, words)) if words and all(re.fullmatch("[0-9]{1,18}", word) for word in words) else None
