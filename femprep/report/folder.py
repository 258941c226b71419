"""An output folder that is there whole or not at all: written as a hidden neighbour, renamed when done."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from femprep.errors import FemprepError, FileError

#: The file by which a folder is known to be one of ours, and so may be replaced.
MARKER = "run.json"


def require_writable(out: Path) -> None:
    """Make sure, before any work, that an output folder can be made or replaced.

    Raises
    ------
    FileError
        It is a file, holds what femprep did not write, or its parent cannot be written.
    """
    if out.is_symlink() or (out.exists() and not out.is_dir()):
        raise FileError(f"output {str(out)!r} is not a folder; give the name of a new folder with -o")
    if out.is_dir() and any(out.iterdir()) and not (out / MARKER).is_file():
        raise FileError(f"output folder {str(out)!r} holds files that femprep did not write; give another with -o")
    parent = out.absolute().parent
    existing = next(folder for folder in (parent, *parent.parents) if folder.exists())
    if not existing.is_dir():
        raise FileError(f"output {str(out)!r} cannot be made: {str(existing)!r} is a file")
    try:
        probe = tempfile.mkdtemp(prefix=".femprep-", dir=existing)
    except OSError as error:
        raise FileError(
            f"output folder {str(out)!r} cannot be written: {error.strerror}; choose another with -o"
        ) from None
    os.rmdir(probe)


@contextmanager
def whole_folder(out: Path) -> Iterator[Path]:
    """A temporary folder to write into, which takes the name ``out`` when the block ends without an error.

    An earlier folder of that name stays untouched until then, and stays for good where the block fails.
    """
    out = out.absolute()
    require_writable(out)
    out.parent.mkdir(parents=True, exist_ok=True)
    partial = Path(tempfile.mkdtemp(prefix=f".{out.name}.partial-", dir=out.parent))
    partial.chmod(0o777 & ~_umask())
    try:
        yield partial
        if out.exists():
            old = Path(tempfile.mkdtemp(prefix=f".{out.name}.old-", dir=out.parent))
            out.rename(old / "folder")
            try:
                partial.rename(out)
            except OSError:
                (old / "folder").rename(out)
                raise
            finally:
                shutil.rmtree(old, ignore_errors=True)
        else:
            partial.rename(out)
    except FemprepError:
        raise
    except OSError as error:
        raise FileError(f"output folder {str(out)!r} cannot be written: {error.strerror or error}") from error
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def _umask() -> int:
    current = os.umask(0)
    os.umask(current)
    return current
