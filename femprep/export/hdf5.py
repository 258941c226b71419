"""An HDF5 file in; an error where it leads to other files, or XDMF names other numbers than it holds."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

from femprep.errors import FileError

_SIGNATURE: Final = b"\x89HDF\r\n\x1a\n"
#: Endings of the XML that tells where in HDF5 files an XDMF mesh is.
XDMF: Final = (".xdmf", ".xmf")


def require_hdf5(path: Path) -> None:
    """Check a mesh file that is HDF5, or XDMF with HDF5 beside it; any other is let pass.

    Raises
    ------
    FileError
        It holds links to other files, or an array whose numbers lie in one; or XDMF names something that is no file, or
        says another number of numbers.
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
            return
    import h5py

    def link(name: str, found: Any) -> str | None:
        return f"leads to {found.filename!r} by its {name!r}" if isinstance(found, h5py.ExternalLink) else None

    def item(name: str, found: Any) -> str | None:
        outside = isinstance(found, h5py.Dataset) and (found.external or found.is_virtual)
        return f"keeps its {name!r} in other files" if outside else None

    try:
        with h5py.File(path, "r") as store:
            wrong = store.visititems_links(link) or store.visititems(item)  # which end with the first that says a word
    except (OSError, RuntimeError, KeyError, ValueError, TypeError) as error:
        raise FileError(f"{str(path)!r} is damaged: {' '.join(str(error).split())}") from error
    if wrong:
        raise FileError(f"{str(path)!r} {wrong}; give a file that holds it all")
