"""Words of a command in, an error out where a file that it writes would take the place of another that they name."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path

from femprep.errors import OptionError

#: Where the words behind a command's name are kept while it is parsed.
WORDS = "femprep.words"


def require_unnamed(path: Path, option: str, words: Iterable[str]) -> None:
    """Make sure that a file to be written, given by an option, is none that other words of the command name.

    Raises
    ------
    OptionError
        It is.
    """
    if path.exists() and not path.is_file():  # a terminal, a pipe: nothing is lost
        return
    if any(same_file(path, name) for word in _others(option, words) for name in _names(word) if name):
        raise OptionError(f"{option} {str(path)!r} is a file that the command names too; choose another")


def same_file(one: Path | str, other: Path | str) -> bool:
    """Whether two names are one file, there or still to be written."""
    with suppress(OSError, ValueError):  # a word may be no name at all
        if os.path.exists(one) and os.path.exists(other):
            return os.path.samefile(one, other)
        return os.path.realpath(one) == os.path.realpath(other)
    return False


def _others(option: str, words: Iterable[str]) -> Iterator[str]:
    """All words but that option with its value."""
    rest = iter(words)
    for word in rest:
        if word == option:
            next(rest, None)
        elif not word.startswith(f"{option}="):
            yield word


def _names(word: str) -> Iterator[str]:
    """What of a word may be the name of a file: all of it, or as in -oFILE, --out=FILE, NAME=FILE and FILE:FRAME."""
    if word.startswith("-") and not word.startswith("--"):
        yield word[2:]
    while word:
        yield word
        yield word.rpartition(":")[0]
        word = word.partition("=")[2]
