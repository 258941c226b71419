"""A NRRD's or MetaImage's header in, where its voxels are out: ITK makes up voxels that a compressed file lacks."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Final, NamedTuple

from femprep.errors import FileError

REMEDY: Final = "copy or convert the file again"
_DATA, _ROOM = "ElementDataFile", "CompressedDataSize"
#: Bytes of a voxel by its type; of others one at least.
_BYTES: Final = {
    **dict.fromkeys(("SHORT", "USHORT"), 2),
    **dict.fromkeys(("INT", "UINT", "LONG", "ULONG", "FLOAT"), 4),
    **dict.fromkeys(("LONG_LONG", "ULONG_LONG", "DOUBLE"), 8),
}
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
        Sizes are no numbers, or the files' name is no pattern.
    """
    fields: dict[str, str] = {}
    with open(path, "rb") as file:
        while (line := file.readline(_LINE)) and line.strip():
            key, _, value = line.decode("latin-1").partition(":")
            if not value.startswith("="):
                fields[key.strip().lower()] = value.strip()
        offset = file.tell()
    compressed = fields.get("encoding", "").lower() in ("gzip", "gz")
    count = math.prod(_numbers(path, "sizes", fields["sizes"])) if "sizes" in fields else None
    detached = fields.get("data file") or fields.get("datafile")
    if not detached:
        return Voxels(path, offset, compressed, count)
    _require_pattern(path, detached)
    return Voxels(path.parent / detached, 0, compressed, count)


def meta_voxels(path: Path) -> Voxels:
    """The voxels of a MetaImage.

    Raises
    ------
    FileError
        There are no voxels, their sizes are no numbers or not as many as axes, their bytes are not stated where they
        are compressed, or the files' name is no pattern.
    """
    fields: dict[str, str] = {}
    with open(path, "rb") as file:
        while _DATA not in fields:
            if not (line := file.readline(_LINE)):
                raise FileError(f"{path}: its header has no {_DATA}; {REMEDY}")
            key, *value = re.split("[=:]", line.decode("latin-1"), maxsplit=1)
            fields[key.strip()] = "".join(value).strip()
        offset = file.tell()
    name, compressed = fields[_DATA], fields.get("CompressedData", "")[:1] in ("T", "t", "1")
    sizes = _numbers(path, "DimSize", fields.get("DimSize", ""))
    if (axes := _numbers(path, "NDims", fields.get("NDims", ""))[0]) != len(sizes):
        raise FileError(f"{path}: its header has {len(sizes)} sizes, expected {axes} (NDims); {REMEDY}")
    count = math.prod(sizes)
    count *= math.prod(_numbers(path, "ElementNumberOfChannels", fields.get("ElementNumberOfChannels", "1")))
    least = count * _BYTES.get(fields.get("ElementType", "").removeprefix("MET_"), 1)
    if name.upper() != "LOCAL":
        _require_pattern(path, name)
        return Voxels(path.parent / name, 0, compressed, count, None, least)
    (room, *_) = _numbers(path, _ROOM, fields.get(_ROOM, "0"))
    if compressed and not room:
        raise FileError(
            f"{path}: its header has no {_ROOM}, without which ITK makes labels of what is in the memory; "
            f"add {f'{_ROOM} = {path.stat().st_size - offset}'!r}"
        )
    return Voxels(path, offset, compressed, count, room if compressed else None, least)


def _require_pattern(path: Path, name: str) -> None:
    """Check that a file's name, which ITK gives to ``snprintf``, has no place for anything but one number in it."""
    if "%" in re.sub(r"%\d{0,2}d", "", name, count=1):
        raise FileError(f"{path}: its header has voxels in {name[:40]!r}, expected a name or a pattern; {REMEDY}")


def _numbers(path: Path, key: str, text: str) -> list[int]:
    """Whole numbers of a field."""
    words = text.split()
    if not words or not all(re.fullmatch("[0-9]{1,18}", word) for word in words):
        raise FileError(f"{path}: its header has {key!r} {text[:40]!r}, expected whole numbers; {REMEDY}")
    return [int(word) for word in words]
