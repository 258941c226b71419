"""An output folder that is there whole or not at all: written as a hidden neighbour, renamed when done.

A later run into the same folder replaces the files that the earlier one wrote, and those alone.
"""

from __future__ import annotations

import os
import shutil
import signal
import tempfile
import threading
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Final

from femprep.errors import DiskFullError, FemprepError, FileError, cannot_write
from femprep.report.folder.earlier import MARKER, Earlier, read_earlier, require_kept
from femprep.report.folder.swap import alone, at_work, partial_prefix, recover, swap

__all__ = ["MARKER", "require_writable", "whole_folder"]

#: No output is smaller, bytes.
_LEAST: Final = 2**17
_REMEDY: Final = "choose another folder with -o"


def require_writable(out: Path, names: Iterable[str] = ()) -> None:
    """Make sure, before any work, that an output folder can be made or replaced.

    What a run that was killed has left beside it is put in order first.

    Parameters
    ----------
    out : path
    names : iterable of str
        Files that will be written into it, as far as they are known.

    Raises
    ------
    FileError
        It is no folder, is read-only, its parent cannot be written, it holds no run of ours, files of one that were
        changed since, or files of others in the way of ``names``.
    DiskFullError
        There is no room at all.
    """
    out = _absolute(out)
    if out.parent.is_dir():
        with alone(out.parent):
            recover(out)
    _require(out, names)
    existing = next(folder for folder in out.parents if folder.exists())
    what = f"output folder {str(out)!r}"
    try:
        with alone(existing), _undisturbed():
            os.rmdir(tempfile.mkdtemp(prefix=partial_prefix(out), dir=existing))
        room = shutil.disk_usage(existing).free
    except OSError as error:
        raise cannot_write(what, error, _REMEDY) from None
    if room < _LEAST:
        raise DiskFullError(
            f"{what} cannot be written, {room / 1000:.0f} kB of room are left; free some space, or {_REMEDY}"
        )


def _require(out: Path, names: Iterable[str]) -> Earlier:
    """What an output folder holds of an earlier run, if a new one can take its place."""
    if out.is_symlink():
        raise FileError(
            f"output {str(out)!r} is a symbolic link to {os.readlink(out)!r}, not a folder; give that itself with -o"
        )
    if out.exists() and not out.is_dir():
        raise FileError(f"output {str(out)!r} is not a folder; give the name of a new folder with -o")
    existing = next(folder for folder in out.parents if folder.exists())
    if not existing.is_dir():
        raise FileError(f"output {str(out)!r} cannot be made: {str(existing)!r} is a file")
    if not out.exists():
        return Earlier()
    if os.path.ismount(out):
        raise FileError(f"output folder {str(out)!r} is a disk of its own; give a folder in it with -o")
    if not os.access(out, os.R_OK | os.W_OK | os.X_OK):
        raise FileError(f"output folder {str(out)!r} is read-only; {_REMEDY}")
    if any(out.iterdir()) and not os.path.lexists(out / MARKER):
        raise FileError(f"output folder {str(out)!r} holds files that femprep did not write; give another with -o")
    try:
        earlier = read_earlier(out)
        require_kept(out, earlier, names)
    except FemprepError:
        raise
    except OSError as error:
        where = error.filename or str(out)
        raise FileError(f"{str(where)!r} cannot be read: {error.strerror}; {_REMEDY}") from None
    return earlier


@contextmanager
def whole_folder(out: Path) -> Iterator[Path]:
    """A temporary folder to write into, which takes the name ``out`` when the block ends without an error.

    An earlier folder of that name stays untouched until then, and stays for good where the block fails. Of what it
    holds, files that its ``run.json`` lists are replaced or go; everything else stays where it is.

    Raises
    ------
    FileError
        As for :func:`require_writable`, before the block, and after it where the folder has changed meanwhile.
    DiskFullError
        There is no room; nothing new is left.
    """
    out = _absolute(out)
    require_writable(out)
    what = f"output folder {str(out)!r}"
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            with alone(out.parent), _undisturbed():
                partial = Path(tempfile.mkdtemp(prefix=partial_prefix(out), dir=out.parent))
                stack.callback(shutil.rmtree, partial, ignore_errors=True)
                stack.enter_context(at_work(partial))
            partial.chmod(0o777 & ~_umask())
            yield partial
            made = [path.relative_to(partial).as_posix() for path in partial.rglob("*") if path.is_file()]
            with alone(out.parent):
                swap(partial, out, _require(out, made))
    except DiskFullError as error:  # it speaks of the folder that is gone
        cause = error.__cause__
        raise cannot_write(what, cause if isinstance(cause, OSError) else error, _REMEDY) from error
    except FemprepError:
        raise
    except OSError as error:
        raise cannot_write(what, error, _REMEDY) from error


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let signals that end this process wait until the block is over, so that what it makes is cleared away."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    seen: list[int] = []
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        for number in before:
            signal.signal(number, lambda caught, _: seen.append(caught))
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
        for caught in seen:
            signal.raise_signal(caught)


def _absolute(out: Path) -> Path:
    """The path of a folder by its own name, so that it has neighbours."""
    return out.absolute() if out.name not in ("", "..") else out.resolve()


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
