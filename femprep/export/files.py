"""Files written whole or not at all: made in a hidden neighbouring folder, renamed when done."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from femprep.errors import FemprepError, FileError, cannot_write


@contextmanager
def whole_files(parent: Path) -> Iterator[tuple[Path, list[Path]]]:
    """A temporary folder, and a list that names what was in it, moved to ``parent``, once the block has ended well.

    Files of the same name in ``parent`` are replaced; what else a folder of the same name holds stays. On an error
    nothing there is touched.

    Raises
    ------
    FileError
        The folder does not exist or cannot be written, or a folder, a device or a pipe is where a file should go, or a
        file where a folder.
    DiskFullError
        There is no room.
    """
    moved: list[Path] = []
    require_folder(parent)
    what, remedy = f"folder {str(parent)!r}", "choose another"
    try:
        partial = Path(tempfile.mkdtemp(prefix=".femprep-", dir=parent))
    except OSError as error:
        raise cannot_write(what, error, remedy) from None
    try:
        yield partial, moved
        paths = sorted(partial.iterdir())
        for path in paths:
            _require_room(path, parent / path.name)
        for path in paths:
            _replace(path, parent / path.name)
            moved.append(parent / path.name)
    except FemprepError:
        raise
    except OSError as error:
        raise cannot_write(what, error, remedy) from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def require_folder(folder: Path) -> None:
    """Refuse to write into a folder that is not there, which whoever computes first asks for before.

    Raises
    ------
    FileError
    """
    if not folder.is_dir():
        raise FileError(f"folder {str(folder)!r} does not exist; make it, or write elsewhere")


def _require_room(path: Path, target: Path) -> None:
    """Make sure that a file or folder can take a name: before anything is replaced."""
    folder = target.is_dir() and not target.is_symlink()
    if path.is_dir():
        if folder:
            for child in path.iterdir():
                _require_room(child, target / child.name)
        elif os.path.lexists(target):
            raise FileError(f"{str(target)!r} is a file, not a folder; choose another name")
    elif folder:
        raise FileError(f"{str(target)!r} is a folder, not a file; choose another name")
    elif target.exists() and not target.is_file():  # a device or a pipe would be a file afterwards
        raise FileError(f"{str(target)!r} is no regular file; choose another name")


def _replace(path: Path, target: Path) -> None:
    if path.is_dir() and target.is_dir():
        for child in path.iterdir():
            _replace(child, target / child.name)
    else:
        os.replace(path, target)
