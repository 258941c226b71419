"""A deck and the name of a file it takes in, in; that file, which has to lie beside the deck, out."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from femprep.errors import FileError

#: Files that take in files double with each step: a few kilobytes of them would be read for ever.
MOST_FILES: Final = 1000


@dataclass(frozen=True)
class OpenedFile:
    """A deck, or a file that it takes in.

    Attributes
    ----------
    path : path
        Where it is.
    by : OpenedFile or None
        What takes it in; None for the deck itself.
    taken : list of path
        All files that the deck has taken in so far, as often as it did.
    """

    path: Path
    by: OpenedFile | None = None
    taken: list[Path] = field(default_factory=list)

    def take_in(self, name: str) -> OpenedFile:
        """The file of this name, which is relative to the deck.

        Raises
        ------
        FileError
            It is missing, lies outside of the deck's folder, takes itself in, or is one of too many.
        """
        reached_by = self._chain()
        folder = reached_by[-1].parent.resolve()
        words = name.strip().strip("\"'").replace("\\", "/")
        found = folder / words
        told = f"{str(self.path)!r} takes in the file {words!r}, which"
        if not words or not found.resolve().is_relative_to(folder):
            raise FileError(f"{told} lies elsewhere; put it into the folder of the deck and name it there")
        if not found.is_file():
            raise FileError(f"{told} is not in its folder; put it there")
        if found.resolve() in [path.resolve() for path in reached_by]:
            raise FileError(f"{told} is being read already; a file cannot take in itself")
        self.taken.append(found)
        if len(self.taken) > MOST_FILES:
            raise FileError(f"{told} is one more than the {MOST_FILES} that a deck may take in; write them as one")
        return OpenedFile(found, self, self.taken)

    def _chain(self) -> list[Path]:
        """This file, what takes it in, and so on to the deck."""
        return [self.path, *(self.by._chain() if self.by else ())]
