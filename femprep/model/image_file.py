"""The name of an image file as people write it in, the file and the number of its frame out."""

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
