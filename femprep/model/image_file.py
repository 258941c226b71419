"""A file as people write it in, the file and the number of its frame or piece out."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple


class ImageFile(NamedTuple):
    """A file, and which of its frames, from 1, where it holds several."""

    path: Path
    frame: int | None = None


def image_file(text: str, folder: Path | None = None) -> ImageFile:
    """``FILE``, or ``FILE:FRAME`` of a file with several frames, counted from 1; relative to a folder if one is given.

    Examples
    --------
    >>> from femprep.model.image_file import image_file
    >>> image_file("cine.nii.gz:12").frame
    12
    """
    name, colon, number = text.rpartition(":")
    frame = int(number) if colon and name and number.isascii() and number.isdigit() else None
    path = Path(text if frame is None else name)
    return ImageFile(path if folder is None else folder / path, frame)


def piece_of(path: str | Path) -> tuple[Path, int | None]:
    """The file of ``FILE#2``, and the number of the piece; None where there is none."""
    file, mark, number = str(path).rpartition("#")
    return (Path(file), int(number)) if mark and number.isdigit() and not Path(path).exists() else (Path(path), None)
