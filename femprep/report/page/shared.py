"""A text in, a file out that is there whole or not at all."""

from __future__ import annotations

import errno
import os
import tempfile
from pathlib import Path

from femprep.errors import cannot_write


def write_page(path: Path, text: str, remedy: str) -> None:
    """Write a text; where that fails, an earlier file of the name stays.

    Raises
    ------
    FileError
        The file cannot be written; ``remedy`` tells what to do.
    DiskFullError
        There is no room.
    """
    try:
        if path.exists() and not path.is_file():  # a pipe, a terminal
            path.write_text(text, encoding="utf-8")
            return
        path = path.resolve()  # where a link leads
        with tempfile.TemporaryDirectory(prefix=".femprep-", dir=path.parent) as folder:
            made = Path(folder) / path.name
            made.write_text(text, encoding="utf-8")
            os.replace(made, path)
    except (OSError, RuntimeError) as error:  # RuntimeError: links that lead to each other (Python 3.11, 3.12)
        error = error if isinstance(error, OSError) else OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        raise cannot_write(f"{str(path)!r}", error, remedy) from None
