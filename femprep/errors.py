"""The errors femprep raises, each also a builtin, and the exit status each one means.

Every message is one line: what is wrong, where, the value found, and what to do about it.
"""

from __future__ import annotations

import errno
from collections.abc import Iterable
from typing import ClassVar, Final, NamedTuple

#: What the system says where no room is left: on the disk, within a quota, within a limit of the size of a file.
_FULL: Final = frozenset({errno.ENOSPC, errno.EFBIG, getattr(errno, "EDQUOT", errno.ENOSPC)})
#: Letters of a value that a message quotes.
_LONGEST: Final = 100


class Advice(NamedTuple):
    """One thing that can be done about an error.

    Attributes
    ----------
    words : str
        A clause that names the option as it is typed: ``"move the base by --base-offset"``.
    option : str
        Path of that option, ``"wall.base_offset"``; empty where the labels or a surface have to change.
    value : object
        The value that the words name; None where the user chooses it.
    """

    words: str
    option: str = ""
    value: object = None


def as_advice(one: Advice | str) -> Advice:
    """Advice of words alone names no option."""
    return Advice(one) if isinstance(one, str) else one


class FemprepError(Exception):
    """Base of all errors of femprep.

    Parameters
    ----------
    *args
        What is wrong, where, and the value found.
    advice : iterable of Advice or str
        What to do about it: alternatives, which the message names at its end.

    Examples
    --------
    >>> try:
    ...     fp.read_segmentation("none.nii.gz")
    ... except fp.FemprepError as error:
    ...     print(error.exit_status)
    2
    """

    exit_status: ClassVar[int] = 3

    def __init__(self, *args: object, advice: Iterable[Advice | str] = ()) -> None:
        super().__init__(*args)
        self.advice = tuple(map(as_advice, advice))

    def __str__(self) -> str:
        return "; ".join(filter(None, (super().__str__(), alternatives(self.advice))))


class FemprepWarning(UserWarning):
    """A result differs from what was asked for: the message says how.

    Examples
    --------
    >>> import warnings
    >>> warnings.simplefilter("error", fp.FemprepWarning)  # doctest: +SKIP
    """


class InputError(FemprepError, ValueError):
    """The data cannot be meshed as it is: an image, a label, a surface or a mesh is wrong.

    Examples
    --------
    >>> seg.object("aorta")
    Traceback (most recent call last):
    femprep.errors.InputError: structure 'aorta' is not defined ...
    """

    exit_status = 2


class OptionError(FemprepError, ValueError):
    """An option is unknown, out of range, or contradicts another.

    Examples
    --------
    >>> fp.fit_surface(cavity, vertice=800)
    Traceback (most recent call last):
    femprep.errors.OptionError: unknown option 'vertice'; did you mean 'vertices'?
    """

    exit_status = 2


class FileError(FemprepError, OSError):
    """A file is missing, damaged, of an unknown format, or cannot be written.

    Examples
    --------
    >>> fp.read_mesh("none.vtu")
    Traceback (most recent call last):
    femprep.errors.FileError: ...
    """

    exit_status = 2


class DiskFullError(FileError):
    """No room is left for what is written: the disk or a quota is full, or a limit of file size is reached.

    Examples
    --------
    >>> fp.DiskFullError.exit_status
    3
    """

    exit_status = 3


class ResourceError(FemprepError, MemoryError):
    """What was asked needs more memory than the stated limit; nothing was computed.

    Examples
    --------
    >>> fp.tetrahedralize(wall, edge_length=0.01)
    Traceback (most recent call last):
    femprep.errors.ResourceError: ...
    """

    exit_status = 2


class MissingDependencyError(FemprepError, ImportError):
    """An optional library is not installed."""

    exit_status = 2


class StageError(FemprepError, RuntimeError):
    """A stage failed on valid input: no convergence, a backend's crash or time limit, a result that is wrong.

    Examples
    --------
    >>> fp.StageError.exit_status
    3
    """

    exit_status = 3


class QualityError(FemprepError, RuntimeError):
    """A finished mesh does not reach the quality asked of it.

    Examples
    --------
    >>> fp.check(mesh, minimum_dihedral=60.0).raise_if_failed()
    Traceback (most recent call last):
    femprep.errors.QualityError: the mesh fails its checks: ...
    """

    exit_status = 1


def alternatives(advice: Iterable[Advice]) -> str:
    """Advice as the end of a line: one thing, or another."""
    *first, last = [one.words for one in advice] or [""]
    return f"{', '.join(first)}, or {last}" if first else last


def did_you_mean(names: list[str]) -> str:
    """A question to add to what is wrong; nothing where no name is near."""
    return f"; did you mean {' or '.join(map(repr, names))}?" if names else ""


def quoted(value: object) -> str:
    """A value as messages have it: on one line, cut where it is long."""
    line = " ".join(repr(value).split())
    return line if len(line) <= _LONGEST else f"{line[: _LONGEST - 3]}..."


def require_kind(value: object, kind: type | tuple[type, ...], source: str) -> None:
    """Refuse an argument of another kind, such as the path of a file, and name the function that one comes from.

    Raises
    ------
    InputError
    """
    if not isinstance(value, kind):
        names = " or a ".join(one.__name__ for one in (kind if isinstance(kind, tuple) else (kind,)))
        raise InputError(f"got {quoted(value)}, expected a {names} (as {source} returns it)")


def cannot_write(what: str, error: OSError, remedy: str) -> FileError:
    """The error to raise where the system refuses to write.

    Parameters
    ----------
    what : str
        What is written, with its name: ``"folder 'out'"``.
    error : OSError
        What the system said.
    remedy : str
        Where else it could be written.
    """
    if isinstance(error, DiskFullError) or error.errno in _FULL:
        said = f" ({error.strerror})" if error.strerror else ""
        return DiskFullError(f"{what} cannot be written whole, no room is left{said}; free some space, or {remedy}")
    return FileError(f"{what} cannot be written: {error.strerror or error}; {remedy}")
