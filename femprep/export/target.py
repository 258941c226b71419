"""A path and the name of a format in, where a mesh goes out; refused where it would go elsewhere than the path says."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import NamedTuple

from femprep.errors import FileError, OptionError
from femprep.export.files import require_folder
from femprep.export.format import Format
from femprep.export.reading import ENDINGS
from femprep.export.table import FORMATS, format_of, require_formats


class Target(NamedTuple):
    """Where a mesh goes.

    Attributes
    ----------
    format : Format
    folder : Path
        What its files stand in.
    stem : str
        What their names begin with.
    """

    format: Format
    folder: Path
    stem: str

    @property
    def file(self) -> Path:
        """The file that is there with every mesh of the format, and is written anew with each."""
        kind = self.format
        return self.folder / (kind.beside[0] if kind.folder else f"{self.stem}{_endings(kind)[0]}")


def target_of(path: str | Path, format: str | None = None) -> Target:
    """Where a mesh of a format goes, the format by its name or by the ending of the path.

    A name without an ending, or with one that no format has (``patient.007``), gets that of the format.

    Raises
    ------
    OptionError
        The format is unknown, or the ending is another's.
    FileError
        No file can have that name: it is a folder's, a device's, or none; the folder it would be in is not there.
    """
    path = Path(path)
    kind = format_of(path) if format is None else require_formats([format])[0]
    if not kind.folder:
        require_file(path)
    elif path.name in ("", "..", "-"):
        raise FileError(f"{str(path)!r} names no folder; give it a name of its own")
    own, ending = _endings(kind), path.suffix
    if ending not in own and ending.lower() in ENDINGS.union(*(one.endings for one in FORMATS.values())):
        right = path.with_suffix(own[0]).name
        raise OptionError(f"the ending {ending!r} of {str(path)!r} is not that of {kind.name}; name it {right!r}")
    path = path.absolute()
    require_folder(path.parent)
    return Target(kind, path if kind.folder else path.parent, path.stem if ending in own else path.name)


def _endings(kind: Format) -> list[str]:
    """Endings of the files of a mesh that have its name and no more: the first is that of the path."""
    if kind.folder:
        return [""]
    home = PurePosixPath(kind.filename)
    return [home.suffix, *(Path(name).suffix for name in kind.beside if Path(name).stem == home.stem)]


def require_file(path: Path) -> None:
    """Make sure that a file can have that name.

    Raises
    ------
    FileError
        It is a folder's, a device's or a pipe's, or none.
    """
    if path.name in ("", "..") or path.is_dir():
        raise FileError(f"{str(path)!r} is a folder, not a file; name a file in it")
    if path.name == "-" or (path.exists() and not path.is_file()):
        raise FileError(f"{str(path)!r} is no regular file; choose another name")
