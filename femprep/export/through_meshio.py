"""A mesh file in, what meshio reads of it out, or one error."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

from femprep.errors import FileError


def meshio_mesh(path: Path, told: Path | None = None) -> Any:
    """What meshio reads from a file; what it prints is kept off the terminal, and its exits become errors.

    Parameters
    ----------
    path : path
    told : path, optional
        The file that errors name, where ``path`` is a part or a copy of it.

    Raises
    ------
    FileError
        meshio does not know the format, or cannot read the file.
    """
    import meshio
    from meshio._helpers import extension_to_filetypes
    from meshio._mesh import topological_dimension

    topological_dimension.setdefault("wedge15", 3)  # meshio 5.3.5 reads it, then stumbles over its own table
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return meshio.read(path)
    except (Exception, SystemExit) as error:
        reason = str(error) if not isinstance(error, SystemExit) else said.getvalue()
        if not reason or isinstance(error, LookupError):  # of which the text is the key alone
            reason = f"{type(error).__name__} {reason}"
        shown = " ".join(reason.split()).replace(str(path), str(told or path))
        tried = " or ".join(extension_to_filetypes.get(path.suffix.lower(), ()))
        words = f"is damaged or no file of {tried}" if tried else f"has the ending {path.suffix!r} of no known format"
        raise FileError(f"{str(told or path)!r} {words}: {shown}") from error
