"""The errors femprep raises, each also a builtin, and the exit status each one means.

Every message is one line: what is wrong, where, the value found, and what to do about it.
"""

from __future__ import annotations

from typing import ClassVar


class FemprepError(Exception):
    """Base of all errors of femprep."""

    exit_status: ClassVar[int] = 3


class InputError(FemprepError, ValueError):
    """The data cannot be meshed as it is: an image, a label, a surface or a mesh is wrong."""

    exit_status = 2


class OptionError(FemprepError, ValueError):
    """An option is unknown, out of range, or contradicts another."""

    exit_status = 2


class FileError(FemprepError, OSError):
    """A file is missing, damaged, of an unknown format, or cannot be written."""

    exit_status = 2


class ResourceError(FemprepError, MemoryError):
    """What was asked needs more memory than the stated limit; nothing was computed."""

    exit_status = 2


class MissingDependencyError(FemprepError, ImportError):
    """An optional library is not installed."""

    exit_status = 2


class StageError(FemprepError, RuntimeError):
    """A stage failed on valid input: no convergence, a backend's crash or time limit, a result that is wrong."""

    exit_status = 3


class QualityError(FemprepError, RuntimeError):
    """A finished mesh does not reach the quality asked of it."""

    exit_status = 1
