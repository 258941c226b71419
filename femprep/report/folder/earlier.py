"""An output folder in, what stands in it out: files an earlier run wrote, those changed since, and those of others.

``run.json`` tells the files of a run and their hashes. It is not trusted further than that: a name that leads out of
the folder is refused, and a link is never followed.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePath

from femprep.errors import FileError
from femprep.report.manifest import file_sha256

#: The file by which a folder is known to be one of ours.
MARKER = "run.json"
_REMEDY = "give another folder with -o"
#: So many names are told of files that are too many to tell.
_TOLD = 5


@dataclass(frozen=True)
class Earlier:
    """What ``run.json`` of an earlier run tells.

    Attributes
    ----------
    files : frozenset of str
        Names of its files, relative, with ``/``; among them ``run.json``.
    hashes : mapping of str to str
        SHA-256 of those whose hash was kept.
    """

    files: frozenset[str] = frozenset()
    hashes: Mapping[str, str] = field(default_factory=dict)

    def changed(self, folder: Path) -> list[str]:
        """Which of them stand in a folder as something else than was written."""
        return [name for name in sorted(self.files) if self._changed(folder / name, name)]

    def _changed(self, path: Path, name: str) -> bool:
        if not os.path.lexists(path):
            return False
        if path.is_symlink() or not path.is_file():
            return True
        if name not in self.hashes:  # a record without any hash is an older one, or the record itself
            return bool(self.hashes) and name != MARKER
        return file_sha256(path) != self.hashes[name]


def read_earlier(folder: Path) -> Earlier:
    """What the ``run.json`` of a folder tells; nothing where there is none.

    Raises
    ------
    FileError
        It cannot be read, is no record of ours, or names a file outside the folder.
    """
    path = folder / MARKER
    if not os.path.lexists(path):
        return Earlier()
    try:
        if path.is_symlink() or not path.is_file():
            raise ValueError("it is no file")
        record = json.loads(path.read_bytes())
        files, hashes = record["files"], record.get("sha256", {})
        if not all(isinstance(name, str) for name in [*files, *hashes, *hashes.values()]):
            raise ValueError("its files have no names")
    except OSError as error:
        raise FileError(f"{str(path)!r} cannot be read: {error.strerror}; {_REMEDY}") from None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        reason = f"it has no {error}" if isinstance(error, KeyError) else str(error)
        raise FileError(
            f"{str(path)!r} is no record of a run ({reason}), which files here femprep wrote is not known; {_REMEDY}"
        ) from None
    for name in files:
        parts = PurePath(name).parts
        if not parts or PurePath(name).is_absolute() or ".." in parts or "\0" in name:
            raise FileError(f"{str(path)!r} lists {name!r}, which lies outside its folder; {_REMEDY}")
    known = {PurePath(name).as_posix(): digest for name, digest in hashes.items()}
    return Earlier(frozenset(PurePath(name).as_posix() for name in files) | {MARKER}, known)


def others(folder: Path, shared: Iterable[str] = (), *names: Iterable[str]) -> Iterator[tuple[str, os.DirEntry[str]]]:
    """Whatever a folder holds that none of ``shared`` names; of a subfolder in which none of them lies, itself alone.

    Parameters
    ----------
    folder : Path
    shared : iterable of str
        Names of files that are not looked for, relative, with ``/``.
    *names : iterable of str
        Names of files that are, whose subfolders are looked into all the same.
    """
    skipped = set(shared)
    entered = {parent for known in (skipped, *names) for name in known for parent in _parents(name)}
    stack = [(folder, "")]
    while stack:
        where, prefix = stack.pop()
        with os.scandir(where) as entries:
            for entry in sorted(entries, key=lambda entry: entry.name):
                name = prefix + entry.name
                if entry.is_dir(follow_symlinks=False) and name in entered:
                    stack.append((Path(entry.path), f"{name}/"))
                elif name not in skipped or not entry.is_file(follow_symlinks=False):
                    yield name, entry


def _parents(name: str) -> Iterator[str]:
    while "/" in name:
        name = name.rpartition("/")[0]
        yield name


def require_kept(folder: Path, earlier: Earlier, names: Iterable[str]) -> None:
    """Make sure that a run which writes files of those names takes nothing of the user's away.

    Raises
    ------
    FileError
        A file of the earlier run was changed since, or what femprep did not write has a name that is needed.
    """
    changed = earlier.changed(folder)
    if changed:
        raise FileError(
            f"output folder {str(folder)!r} holds {_listed(changed)}, changed since an earlier run wrote "
            f"{'it' if len(changed) == 1 else 'them'}; move what you want to keep elsewhere and delete the rest, or "
            f"{_REMEDY}"
        )
    wanted = set(names)
    needed = {parent for name in wanted for parent in _parents(name)}
    clash = [
        name
        for name, entry in others(folder, earlier.files, wanted)
        if name in wanted
        or not wanted.isdisjoint(_parents(name))
        or (name in needed and not entry.is_dir(follow_symlinks=False))
    ]
    if clash:
        raise FileError(
            f"output folder {str(folder)!r} holds {_listed(sorted(clash))}, which femprep did not write and a new run "
            f"would replace; move or rename {'it' if len(clash) == 1 else 'them'}, or {_REMEDY}"
        )


def _listed(names: list[str]) -> str:
    more = len(names) - _TOLD
    return ", ".join(map(repr, names[:_TOLD])) + (f" and {more} more" if more > 0 else "")
