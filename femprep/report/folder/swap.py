"""A finished folder takes the name of an earlier one, at one instant; what is the user's goes along.

Beside a folder ``OUT`` there are, for a moment, ``.OUT.partial-*``, which is being made, and ``.OUT.old-*``, which
gives way. Whenever the process is killed, ``OUT`` is the earlier folder or the new one, whole:

- killed while the new one is made: ``OUT`` is the earlier one, the partial one is swept away by the next run;
- killed between the two: where the system swaps two names at once (Linux) there is nothing between them. Elsewhere
  ``OUT`` is missing until the next run gives the name back to the earlier folder;
- killed afterwards: ``OUT`` is the new folder. Files of the user's are in it by a second name (a hard link) since
  before the swap; a folder of the user's, whose own identity a program at work in it may need, is moved just after
  the swap, by this run or the next.
"""

from __future__ import annotations

import ctypes
import errno
import logging
import os
import re
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from femprep.errors import FileError
from femprep.report.folder.earlier import MARKER, Earlier, others, read_earlier

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

_log = logging.getLogger(__name__)

_PARTIAL, _OLD = "partial-", "old-"
#: Where folders cannot be locked, a partial one is given up when nothing was written into it for so long, s.
_PATIENCE = 86400.0
#: Constants of Linux: paths are relative to the current folder; two names are exchanged.
_AT_FDCWD, _RENAME_EXCHANGE = -100, 2


def partial_prefix(out: Path) -> str:
    """How the name of a folder that is being made begins."""
    return f".{out.name}.{_PARTIAL}"


def swap(partial: Path, out: Path, earlier: Earlier) -> None:
    """Give the name ``out`` to a finished folder and keep in it what the earlier one holds besides files of its own.

    Raises
    ------
    OSError
        The names could not be changed; the earlier folder has its name.
    """
    if not out.exists():
        partial.rename(out)
        return
    shutil.copymode(out, partial)
    _link(partial, out, earlier)
    old = partial.with_name(f".{out.name}.{_OLD}{partial.name.rpartition('-')[2]}")
    try:
        partial.rename(old)
        if not _exchange(old, out):
            old.rename(partial)
            out.rename(old)
            try:
                partial.rename(out)
            except OSError:
                old.rename(out)
                raise
    finally:
        recover(out)


def recover(out: Path) -> None:
    """Put in order what runs that were killed have left beside a folder; to be called within :func:`alone`."""
    for old in _left(out, _OLD):
        if os.path.lexists(out):
            _clear_away(old, out)
        elif (old / MARKER).is_file():
            old.rename(out)
    for partial in _left(out, _PARTIAL):
        with held(partial, wait=False) as free:
            if free:
                shutil.rmtree(partial, ignore_errors=True)


@contextmanager
def alone(folder: Path) -> Iterator[None]:
    """No two runs change names in one folder at a time."""
    with held(folder, wait=True):
        yield


@contextmanager
def at_work(partial: Path) -> Iterator[None]:
    """Let other runs see that a folder is being made; the system takes the sign away when this process ends."""
    with held(partial, wait=False):
        yield


def _left(out: Path, kind: str) -> list[Path]:
    """Folders of one kind beside ``out``, the newest first."""
    pattern = re.compile(re.escape(f".{out.name}.{kind}") + r"[a-z0-9_]{8}")
    found: list[os.DirEntry[str]] = []
    with suppress(OSError), os.scandir(out.parent) as entries:
        found = [entry for entry in entries if pattern.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False)]
    return [Path(entry.path) for entry in sorted(found, key=_age)]


def _age(entry: os.DirEntry[str]) -> float:
    try:
        return time.time() - entry.stat().st_mtime
    except OSError:  # another run has just put its own away
        return 0.0


def _link(partial: Path, out: Path, earlier: Earlier) -> None:
    """Give the user's files in ``out`` a second name in the folder that will replace it, where the disk can do that."""
    made = [path.relative_to(partial).as_posix() for path in partial.rglob("*") if path.is_file()]
    for name, entry in others(out, earlier.files, made):
        if not entry.is_dir(follow_symlinks=False):
            (partial / name).parent.mkdir(parents=True, exist_ok=True)
            try:
                os.link(entry.path, partial / name, follow_symlinks=False)
            except FileExistsError:
                raise FileError(f"{name!r} in output folder {str(out)!r} is in the way; move it elsewhere") from None
            except (OSError, NotImplementedError):
                continue  # it is moved after the swap


def _clear_away(old: Path, out: Path) -> None:
    """Move what is the user's from a folder that gave way into the one in its place, and delete the rest.

    Deleted is what the old folder's own ``run.json`` lists, and names of files that have another in ``out``.
    """
    try:
        files = read_earlier(old).files
    except FileError:
        files = frozenset()
    for name, entry in list(others(old, files)):
        with suppress(OSError):
            _bring(Path(entry.path), out / name)
    for where, _, found in os.walk(old, topdown=False):  # follows no links; the record of what is whose goes last
        for path in (Path(where, name) for name in found):
            if path.relative_to(old).as_posix() in files and not path.is_symlink():
                path.unlink()
        with suppress(OSError):  # something is left in it
            os.rmdir(where)
    if old.exists():
        _log.warning("files of the earlier %s could not be moved and are in %s", out, old)


def _bring(here: Path, there: Path) -> None:
    """Move a file or folder to its place; a folder that has one there already, file by file."""
    if not os.path.lexists(there):
        there.parent.mkdir(parents=True, exist_ok=True)
        here.rename(there)
    elif here.is_symlink() or not here.is_dir():
        if os.path.samestat(here.lstat(), there.lstat()):
            here.unlink()
    elif there.is_dir() and not there.is_symlink():
        for child in list(here.iterdir()):
            _bring(child, there / child.name)


def _exchange(one: Path, two: Path) -> bool:
    """Exchange the names of two folders at one instant; whether the system can (Linux, on most of its disks)."""
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, TypeError, AttributeError):
        return False
    if rename(_AT_FDCWD, os.fsencode(one), _AT_FDCWD, os.fsencode(two), _RENAME_EXCHANGE) == 0:
        return True
    number = ctypes.get_errno()
    if number in (errno.EINVAL, errno.ENOSYS, errno.EOPNOTSUPP):
        return False
    raise OSError(number, os.strerror(number), str(two))


@contextmanager
def held(folder: Path, wait: bool) -> Iterator[bool]:
    """Hold the lock of a folder or file, which ends with this process at the latest; whether nobody else holds it."""
    try:
        handle = os.open(folder, os.O_RDONLY)
    except OSError:  # Windows opens no folders
        handle = None
    try:
        free = False
        try:
            if fcntl is None or handle is None:
                raise OSError(errno.ENOLCK, "no locks")
            fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            free = True
        except BlockingIOError:
            pass
        except OSError:  # some network disks lock nothing
            with suppress(OSError):
                free = time.time() - folder.stat().st_mtime > _PATIENCE
        yield free
    finally:
        if handle is not None:
            os.close(handle)
