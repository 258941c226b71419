"""An HDF5 file in; an error where it leads to other files, or tells of more numbers than its bytes can hold."""

from __future__ import annotations

import math
import mmap
import re
import struct
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np

from femprep.errors import FileError

_SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"
#: What deflate shrinks equal bytes to, and somewhat more; arrays of fewer bytes are let pass, whatever is stored.
_DENSEST: Final = 1100
_SMALL: Final = 2**20
#: Where the names of a group's members begin: signature, version, three bytes of none; three numbers follow, the size
#: of the names and their free room, where in them the first free block is, and where they are in the file.
_HEAP: Final = re.compile(b"HEAP" + bytes(4))
_HEAP_HEAD: Final = 8
#: Where texts of any length begin: signature, version, three bytes of none; their size follows.
_TEXTS: Final = re.compile(b"GCOL\x01" + bytes(3))
#: Where the first block, of version 0 or 1, names a driver.
_DRIVER: Final = (48, 52)
#: What stands where the next free block would be named, after the last one.
_LAST: Final = 1
_NUMBERS, _NUMBER = struct.Struct("<3Q"), struct.Struct("<Q")
#: How many nodes, elements or names something of MED has: a list is made so long.
_COUNT: Final = "NBR"
#: Endings of the XML that tells where in HDF5 files an XDMF mesh is.
XDMF: Final = (".xdmf", ".xmf")


def require_hdf5(path: Path) -> None:
    """Check a mesh file that is HDF5, or XDMF with HDF5 beside it; any other is let pass.

    Raises
    ------
    FileError
        It holds links to other files, an array whose numbers lie in one, or an array larger than what is stored of it
        can be; or XDMF names something that is no file, or says another number of numbers.
    """
    if path.suffix.lower() in XDMF:
        items = _items(path)
        for store in _named(path, items):
            if not store.is_file():
                raise FileError(f"{str(path)!r} names {store.name!r}, which is no file; keep the files together")
            _require(store)
        _require_dimensions(path, items)
    elif path.is_file():
        _require(path)


def _items(path: Path) -> list[ElementTree.Element]:
    """What XDMF says of its numbers."""
    try:
        return list(ElementTree.parse(path).iter("DataItem"))
    except ElementTree.ParseError as error:
        raise FileError(f"{str(path)!r} is damaged: {error}") from error


def _require_dimensions(path: Path, items: list[ElementTree.Element]) -> None:
    """Check that HDF5 holds as many numbers as XDMF says."""
    import h5py

    for item in items:
        store, _, place = (item.text or "").strip().partition(":")
        if _format(item) != "hdf" or not place or "Dimensions" not in item.attrib:
            continue
        with h5py.File(path.parent / store, "r") as file:
            found = file.get(place)
            size = found.size if isinstance(found, h5py.Dataset) else None
        said = item.attrib["Dimensions"]
        if size is not None and size != math.prod(int(word) for word in said.split()):
            raise FileError(f"{str(path)!r} says that {place!r} is {said}, and {store!r} has {size} numbers there")


def _named(path: Path, items: list[ElementTree.Element]) -> list[Path]:
    """Files that XDMF names: HDF5 with a place in it, or bytes."""
    stores = {(item.text or "").strip().partition(":")[0] for item in items if _format(item) == "hdf"}
    # meshio looks for these in the working folder.
    bytes_ = {(item.text or "").strip() for item in items if _format(item) == "binary"}
    return [path.parent / name for name in sorted(stores)] + [Path(name) for name in sorted(bytes_)]


def _format(item: ElementTree.Element) -> str:
    """How the numbers of an item are kept; those of others are those of the items within them."""
    return "" if len(item) or "Reference" in item.attrib else item.get("Format", "XML").strip().lower()


def _require(path: Path) -> None:
    with path.open("rb") as file:
        if file.read(len(_SIGNATURE)) != _SIGNATURE:
            _require_no_user_block(path)
            return
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            if _has_driver(data):
                raise FileError(f"{str(path)!r} is damaged: its first block tells of a driver")
            if any(_is_endless(data, heap.start()) for heap in _HEAP.finditer(data)):
                raise FileError(f"{str(path)!r} is damaged: free room in one of its heaps never ends")
            if any(_is_too_large(data, heap.end()) for heap in _TEXTS.finditer(data)):
                raise FileError(f"{str(path)!r} is damaged: one of its heaps is larger than the file")
    import h5py

    def link(name: str, found: Any) -> str | None:
        return f"leads to {found.filename!r} by its {name!r}" if isinstance(found, h5py.ExternalLink) else None

    def item(name: str, found: Any) -> str | None:
        count, bytes_ = int(np.max(found.attrs.get(_COUNT, 0))), path.stat().st_size
        if count > bytes_:
            return f"says that its {name!r} has {count} parts, in {bytes_} bytes"
        if not isinstance(found, h5py.Dataset):
            return None
        if found.chunks is not None and len(found.chunks) != found.ndim:
            return f"says that its {name!r} has {found.ndim} dimensions, and keeps it in {len(found.chunks)}"
        if found.external or found.is_virtual:
            return f"keeps its {name!r} in other files"
        size = found.size * found.dtype.itemsize if found.size else 0
        stored = min(found.id.get_storage_size(), bytes_)  # which the file says, too
        if size > max(_SMALL, _DENSEST * stored):
            return f"says that its {name!r} has {size} bytes, and {stored} are stored"
        return None

    try:
        with h5py.File(path, "r") as store:
            wrong = store.visititems_links(link) or store.visititems(item)  # which end with the first that says a word
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        raise FileError(f"{str(path)!r} is damaged: {' '.join(str(error).split())}") from error
    if wrong:
        raise FileError(f"{str(path)!r} {wrong}; give a file that holds it all")


def _require_no_user_block(path: Path) -> None:
    """HDF5 looks for a file behind 512, 1024, 2048... bytes of anything, too."""
    with path.open("rb") as file:
        size, place = path.stat().st_size, 512
        while place < size:
            file.seek(place)
            if file.read(len(_SIGNATURE)) == _SIGNATURE:
                raise FileError(f"{str(path)!r} is HDF5 behind {place} bytes of something else; give HDF5 alone")
            place *= 2


def _has_driver(data: mmap.mmap) -> bool:
    """Whether the first block, where it is of an early version, names a driver, or numbers that are not of eight bytes.

    HDF5 asks for as much memory as is told at that place; a driver keeps data in other files.
    """
    version = data[len(_SIGNATURE)] if len(data) > _DRIVER[1] + _NUMBER.size else 2
    if version > 1:
        return False
    place = _DRIVER[version]
    return data[13:15] != b"\x08\x08" or data[place : place + _NUMBER.size] != b"\xff" * _NUMBER.size


def _is_too_large(data: mmap.mmap, place: int) -> bool:
    """Whether the size at a place is more than the file has: HDF5 asks for as much memory."""
    head = data[place : place + _NUMBER.size]
    return len(head) == _NUMBER.size and _NUMBER.unpack(head)[0] > len(data)


def _is_endless(data: mmap.mmap, start: int) -> bool:
    """Whether the free blocks of a heap, each of which names the next one, form a ring: HDF5 follows it for ever.

    All numbers are of eight bytes, as everyone writes them.
    """
    head = data[start + _HEAP_HEAD : start + _HEAP_HEAD + _NUMBERS.size]
    if len(head) < _NUMBERS.size:
        return False
    size, block, place = _NUMBERS.unpack(head)
    seen: set[int] = set()
    while block != _LAST and block < size and place + block + 8 <= len(data):
        if block in seen:
            return True
        seen.add(block)
        (block,) = _NUMBER.unpack(data[place + block : place + block + _NUMBER.size])
    return False
