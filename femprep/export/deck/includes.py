"""A deck and the name of a file it takes in, in; the path of that file, which has to lie beside the deck, out."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from femprep.errors import FileError


def included(opened: Sequence[Path], name: str) -> Path:
    """The file that a deck takes in.

    Parameters
    ----------
    opened : sequence of path
        The deck, and the files it is reached by, the last one naming this one.
    name : str
        As the deck has it, relative to the deck.

    Raises
    ------
    FileError
        It is missing, lies outside of the deck's folder, or takes itself in.
    """
    deck, folder = opened[-1], opened[0].parent.resolve()
    words = name.strip().strip("\"'").replace("\\", "/")
    found = folder / words
    told = f"{str(deck)!r} takes in the file {words!r}, which"
    if not words or not found.resolve().is_relative_to(folder):
        raise FileError(f"{told} lies elsewhere; put it into the folder of the deck and name it there")
    if not found.is_file():
        raise FileError(f"{told} is not in its folder; put it there")
    if found.resolve() in [path.resolve() for path in opened]:
        raise FileError(f"{told} is being read already; a file cannot take in itself")
    return found
