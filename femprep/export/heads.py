"""The first bytes of a mesh file in; an error where by them it is packed, or text in letters that no reader takes."""

from __future__ import annotations

import codecs
from pathlib import Path
from typing import Final

from femprep.errors import FileError

#: How a file begins that gzip has packed.
_GZIP: Final = b"\x1f\x8b"
#: Readers that are not femprep's, by endings, which do not pass over the mark at the beginning of a text.
_STRICT: Final = (".msh", ".mesh", ".vtk")


def require_head(path: Path, xml: bool) -> None:
    """Check what a file begins with.

    Parameters
    ----------
    path : path
    xml : bool
        Whether it is XML, which tells its letters itself.

    Raises
    ------
    FileError
        It is packed where it should not be, or the other way round; or a text in UTF-16, or with a mark in front that
        its reader does not take.
    """
    with path.open("rb") as file:
        head = file.read(4)
    ending = path.suffix.lower()
    if head.startswith(_GZIP) and ending != ".gz":
        raise FileError(f"{str(path)!r} is packed by gzip; unpack it (gunzip) and keep its ending")
    if ending == ".gz" and not head.startswith(_GZIP):
        raise FileError(f"{str(path)!r} is not packed by gzip; give it the ending of its format")
    if not xml and head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise FileError(f"{str(path)!r} is text in UTF-16; save it in UTF-8")
    if ending in _STRICT and head.startswith(codecs.BOM_UTF8):
        raise FileError(f"{str(path)!r} begins with a byte order mark; save it in UTF-8 without one")
