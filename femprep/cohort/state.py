"""A cohort's own folder ``.cohort`` within its output: the lock, and a note for each subject that was begun.

A note outlives the worker that wrote it, which is how the next one knows what became of the last.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from femprep.errors import FileError, cannot_write
from femprep.report.folder.swap import alone, held, recover

STATE: Final = ".cohort"
_REMEDY: Final = "choose another folder with -o"


@dataclass(frozen=True)
class Note:
    """What is known of a subject that was begun.

    Attributes
    ----------
    run : str
        Of the cohort's run it belongs to; notes of others count for nothing.
    attempts : int
        How often it was begun.
    reason, words : str
        Why its worker ended itself.
    """

    run: str
    attempts: int = 0
    reason: str = ""
    words: str = ""


def read_note(out: Path, name: str, run: str) -> Note:
    """The note of a subject in this run; an empty one where there is none."""
    try:
        note = Note(**json.loads((out / STATE / f"{name}.json").read_bytes()))
    except (OSError, ValueError, TypeError):
        return Note(run)
    return note if note.run == run else Note(run)


def write_note(out: Path, name: str, note: Note) -> None:
    """Write a note so that it is there whole, and on the disk, when this returns."""
    replace_file(out, f"{STATE}/{name}.json", json.dumps(note.__dict__))


def remove_note(out: Path, name: str) -> None:
    """The subject is done with."""
    (out / STATE / f"{name}.json").unlink(missing_ok=True)


def replace_file(out: Path, name: str, text: str) -> None:
    """Write a file of a cohort's folder; where that fails, or this process is killed, the earlier one stays.

    Raises
    ------
    FileError, DiskFullError
        It cannot be written.
    """
    new = out / STATE / f"{name.replace('/', '-')}.{os.getpid()}.new"
    try:
        try:
            with new.open("w", encoding="utf-8", newline="\n") as file:
                file.write(text)
                file.flush()
                os.fsync(file.fileno())
            os.replace(new, out / name)
        finally:
            new.unlink(missing_ok=True)
    except OSError as error:
        raise cannot_write(f"{str(out / name)!r}", error, _REMEDY) from error


@contextmanager
def only_one(out: Path) -> Iterator[None]:
    """A cohort's folder, made where it is not there, that no other cohort is at work in.

    Where the block fails before it wrote anything into it, what was made goes again.

    Raises
    ------
    FileError
        Another one is, or the folder cannot be used: it holds what no cohort wrote, or cannot be written.
    """
    state = out / STATE
    try:
        if out.exists() and not out.is_dir():
            raise FileError(f"output {str(out)!r} is not a folder; give the name of a new folder with -o")
        if out.is_dir() and not state.is_dir() and any(out.iterdir()):
            raise FileError(f"output folder {str(out)!r} holds files that no cohort wrote; give another with -o")
        made = [folder for folder in (state, *state.parents) if not folder.exists()]
        state.mkdir(parents=True, exist_ok=True)
        lock = state / "lock"
        lock.touch()
    except FileError:
        raise
    except OSError as error:
        raise cannot_write(f"output folder {str(out)!r}", error, _REMEDY) from None
    with held(lock, wait=False) as free:
        if not free:
            raise FileError(f"another femprep cohort is at work in {str(out)!r}; wait until it is done, or {_REMEDY}")
        _clear(state)
        clear_leftovers(out)
        try:
            yield
        except BaseException:
            if state in made and list(out.iterdir()) == [state]:
                with suppress(OSError):
                    lock.unlink()
                    for folder in made:
                        folder.rmdir()
            raise


def _clear(state: Path) -> None:
    """Remove notes and unfinished files of runs that are over."""
    for path in state.iterdir():
        if path.name != "lock":
            with suppress(OSError):
                path.unlink()


def clear_leftovers(out: Path) -> None:
    """Put in order what killed workers have left: half-made folders go, whole ones have their names."""
    left = re.compile(r"\.(.+)\.(?:partial|old)-[a-z0-9_]{8}")
    names = {match[1] for path in out.iterdir() if (match := left.fullmatch(path.name))}
    for name in sorted(names):
        with alone(out):
            recover(out / name)


def write_failure(out: Path, name: str, text: str) -> None:
    """Keep what is known of an error that nobody foresaw."""
    folder = out / "failures"
    with suppress(OSError):
        folder.mkdir(exist_ok=True)
        (folder / f"{name}.txt").write_text(text, encoding="utf-8", errors="backslashreplace")


def remove_failure(out: Path, name: str) -> None:
    """What was known of an earlier error is known no more."""
    folder = out / "failures"
    with suppress(OSError):  # among them that of a folder with others in it
        (folder / f"{name}.txt").unlink(missing_ok=True)
        folder.rmdir()
