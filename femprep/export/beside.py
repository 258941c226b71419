"""The files of a mesh that is to be written in, those of an earlier one that go out; others' in the way are refused.

A format of several files may leave some of an earlier mesh of the same path, which its readers would take for parts of
the new one. Files of others are neither replaced nor deleted.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from glob import escape
from pathlib import Path
from typing import Final

from femprep.errors import FileError
from femprep.export.target import Target

#: So many names are told of files that are too many to tell.
_TOLD: Final = 5
#: Bytes at the beginning of a file in which its mark stands.
_HEAD: Final = 2**16


def leftovers(target: Target, made: Path) -> list[Path]:
    """Files of an earlier mesh of the same path that a new one, which stands whole in ``made``, does not have.

    Raises
    ------
    FileError
        What no earlier mesh of femprep's of that path has brought would be replaced, or read as a part of the new one.
    """
    new = {path.relative_to(made).as_posix() for path in made.rglob("*") if not path.is_dir()}
    known = _there(target, target.format.optional_of(target.stem))
    there = _there(target, target.format.parts) | known | {name for name in new if _exists(target.folder / name)}
    asked = set() if target.format.folder else {target.file.name}
    others = there - asked - (new | known if _is_ours(target) else set())
    if others:
        shown, more = sorted(others)[:_TOLD], len(others) - _TOLD
        listed = ", ".join(map(repr, shown)) + (f" and {more} more" if more > 0 else "")
        raise FileError(
            f"folder {str(target.folder)!r} holds {listed}, not from an earlier {target.file.name} of femprep's: the "
            "mesh would replace them or be read with them; write into a folder of its own, or move them"
        )
    return [target.folder / name for name in sorted(known - new)]


def clear(files: Iterable[Path]) -> None:
    """Delete files, and the folders that are empty then."""
    for file in files:
        file.unlink(missing_ok=True)
        with suppress(OSError):  # something else is in it
            file.parent.rmdir()


def _there(target: Target, patterns: Iterable[str]) -> set[str]:
    """Names of files that are there, relative to their folder."""
    found = (target.folder.glob(pattern.format(stem=escape(target.stem))) for pattern in patterns)
    return {path.relative_to(target.folder).as_posix() for paths in found for path in paths}


def _is_ours(target: Target) -> bool:
    """Whether the mesh of that path was written by femprep, and its other files with it."""
    name, words = target.format.mark
    path = target.folder / name.format(stem=target.stem)
    if not (name and target.file.is_file() and path.is_file()):
        return False
    with path.open("rb") as file:
        return words.encode() in file.read(_HEAD)


def _exists(path: Path) -> bool:
    return path.exists() or path.is_symlink()
