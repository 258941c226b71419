"""An error that nobody foresaw in, a file that can be sent to us out: traceback, options, versions, hash of the input.

It goes into the working folder, else into that for temporary files: an output folder is there whole or not at all.
"""

from __future__ import annotations

import contextlib
import os
import platform
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

_HEAD: Final = """\
femprep met an error that it does not know. Please send this file to the developers, after a look at it: it holds the
command with names of files and folders, and of files no more than their size and hash, but configuration files whole.
"""
#: Libraries whose versions may matter.
_LIBRARIES: Final = (
    *("numpy", "scipy", "numba", "SimpleITK", "vtk", "pyvista", "meshio", "h5py", "trimesh", "manifold3d"),
    *("pytetwild", "pydantic", "typer", "rich", "threadpoolctl"),
)
#: Larger files are named by their size alone, bytes.
_LARGEST: Final = 2**31
#: Configuration files are written out up to this size, bytes.
_SHOWN: Final = 2**16
#: Lines of a traceback kept at each end: of a recursion there are thousands.
_KEPT: Final = 200


def write_crash(error: BaseException, arguments: Sequence[str]) -> Path | None:
    """Write what is known of an error into a new file.

    Parameters
    ----------
    error : exception
    arguments : sequence of str
        Those of the command line.

    Returns
    -------
    Path or None
        The file; None where nothing can be written anywhere.
    """
    text = "\n\n".join(_parts(error, arguments)) + "\n"
    name = time.strftime("femprep-crash-%Y%m%d-%H%M%S") + f"-{os.getpid()}.txt"
    for folder in (Path.cwd, lambda: Path(tempfile.gettempdir())):
        with contextlib.suppress(OSError):  # the working folder may be gone, read-only or full
            path = folder() / name
            try:
                with path.open("x", encoding="utf-8", errors="backslashreplace") as file:
                    file.write(text)
            except FileExistsError:
                continue
            except OSError:
                path.unlink(missing_ok=True)
                raise
            return path
    return None


def _parts(error: BaseException, arguments: Sequence[str]) -> Iterator[str]:
    yield _HEAD
    yield "command: femprep " + " ".join(map(repr, arguments))
    yield "versions:\n" + "\n".join(_versions())
    yield "files:\n" + ("\n".join(_files(arguments)) or "none")
    lines = "".join(traceback.format_exception(error)).splitlines()
    if len(lines) > 2 * _KEPT:
        lines = [*lines[:_KEPT], f"... {len(lines) - 2 * _KEPT} lines", *lines[-_KEPT:]]
    yield "\n".join(lines)


def _versions() -> Iterator[str]:
    from importlib.metadata import PackageNotFoundError, version

    from femprep import __version__

    yield f"femprep {__version__}"
    yield f"Python {sys.version.split()[0]}"
    yield platform.platform()
    for name in _LIBRARIES:
        with contextlib.suppress(PackageNotFoundError):
            yield f"{name} {version(name)}"


def _files(arguments: Sequence[str]) -> Iterator[str]:
    """Files named in the command: size and hash of each; text of configurations."""
    for argument in arguments:
        path = Path(argument.partition("=")[2] if argument.startswith("--") else argument)
        try:
            if not path.is_file():
                continue
            size = path.stat().st_size
            yield f"{path.name}: {size} bytes, sha256 {_sha256(path) if size <= _LARGEST else 'not taken'}"
            if path.suffix == ".toml" and size <= _SHOWN:
                yield path.read_text(encoding="utf-8", errors="backslashreplace")
        except (OSError, ValueError) as error:  # ValueError: a null in a name
            yield f"{argument}: {error}"


def _sha256(path: Path) -> str:
    import hashlib

    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
