"""Files written whole or not at all: made in a hidden neighbouring folder, renamed when done."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from femprep.errors import FemprepError, FileError


@contextmanager
def whole_files(parent: Path) -> Iterator[tuple[Path, list[Path]]]:
    """A temporary folder, and a list that names what was in it, moved to ``parent``, once the block has ended well.

    Files and folders of the same name in ``parent`` are replaced; on an error nothing there is touched.

    Raises
    ------
    FileError
        The folder does not exist or cannot be written.
    """
    moved: list[Path] = []
    if not parent.is_dir():
        raise FileError(f"folder {str(parent)!r} does not exist; make it, or write elsewhere")
    try:
        partial = Path(tempfile.mkdtemp(prefix=".femprep-", dir=parent))
    except OSError as error:
        raise FileError(f"folder {str(parent)!r} cannot be written: {error.strerror}; choose another") from None
    try:
        yield partial, moved
        for path in sorted(partial.iterdir()):
            target = parent / path.name
            _replace(path, target)
            moved.append(target)
    except FemprepError:
        raise
    except OSError as error:
        raise FileError(f"writing into {str(parent)!r} failed: {error.strerror or error}") from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def _replace(path: Path, target: Path) -> None:
    if path.is_dir():
        if target.is_dir() and not target.is_symlink():
            shutil.rmtree(target)
        path.rename(target)
        return
    if target.is_dir():
        raise FileError(f"{str(target)!r} is a folder, not a file; choose another name")
    os.replace(path, target)
