"""Templates in and out of a folder on disk: made once, read ever after, safe against damage and other processes."""

from __future__ import annotations

import logging
import os
import sys
import tempfile
import zipfile
import zlib
from pathlib import Path

import numpy as np

from femprep.errors import InputError
from femprep.template.sphere import Template

_log = logging.getLogger(__name__)

#: Part of every file name: raise it when templates are made differently.
VERSION = 2


def folder() -> Path:
    """Folder templates are kept in: ``FEMPREP_CACHE``, else ``femprep`` in the platform's cache folder."""
    given = os.environ.get("FEMPREP_CACHE")
    if given:
        return Path(given)
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or str(Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = str(Path.home() / "Library" / "Caches")
    else:
        base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "femprep"


def _path(kind: str, count: int) -> Path:
    return folder() / f"{kind}-v{VERSION}-{count}.npz"


def load(kind: str, count: int, cells: int) -> Template | None:
    """The kept template of a kind, or None where there is none or its file is damaged.

    Parameters
    ----------
    kind : str
        How it is made: ``"charges"``...
    count, cells : int
        Numbers of vertices and of cells it has to have.
    """
    try:
        with np.load(_path(kind, count), allow_pickle=False) as file:
            template = Template(file["directions"], file["cells"])
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, EOFError, InputError, RuntimeError, zipfile.BadZipFile, zlib.error) as error:
        _log.warning("kept template %s is damaged and made anew: %s", _path(kind, count), error)
        return None
    d, c = template.directions, template.cells
    sound = (
        len(d) == count
        and len(c) == cells
        and bool(np.all(np.abs((d * d).sum(axis=1) - 1.0) < 1e-9))
        and bool(c.min(initial=0) >= 0)
        and bool(c.max(initial=0) < count)
    )
    if not sound:
        _log.warning("kept template %s is not one of %d vertices and is made anew", _path(kind, count), count)
        return None
    return template


def save(kind: str, count: int, template: Template) -> None:
    """Keep a template; where the folder cannot be written it is only said in the log.

    The file is written under another name and renamed when whole: another process sees it complete or not at all,
    and two that make the same template write the same bytes.
    """
    path = _path(kind, count)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=path.stem, suffix=".part", dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                np.savez(file, directions=template.directions, cells=template.cells)
            # mkstemp files are private; a shared folder serves everybody.
            os.chmod(name, 0o644)
            os.replace(name, path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
    except OSError as error:
        _log.warning("template of %d vertices cannot be kept in %s: %s", count, path.parent, error)
