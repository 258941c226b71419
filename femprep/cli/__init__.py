"""The command line: one file per command; this one starts them and turns errors into exit statuses."""

from __future__ import annotations

import atexit
import errno
import gc
import logging
import os
import signal
import sys
from contextlib import suppress
from difflib import get_close_matches
from types import FrameType
from typing import Any

from femprep.errors import DiskFullError, FemprepError, OptionError, cannot_write, did_you_mean

#: Exit status after Ctrl-C, as shells have it.
INTERRUPTED = 130
#: What the system says of a name that the user gave, wherever it is met; and how much of one is shown.
_BAD_NAMES = frozenset({errno.ENAMETOOLONG, errno.ELOOP, errno.ENOTDIR, errno.EISDIR, errno.EACCES, errno.EPERM})
_LONGEST_NAME = 100
#: Numbers of three options in glibc's ``malloc.h``.
_TRIM_THRESHOLD, _MMAP_THRESHOLD, _ARENA_MAX = -1, -3, -8
#: New objects after which Python looks for cycles: libraries that are loaded make ever so many, and nearly no cycles.
_NEW_OBJECTS = 50_000


def main(arguments: list[str] | None = None) -> int:
    """Run the command line.

    Returns
    -------
    int
        0 done; 1 done but a check failed; 2 the input or the options are wrong; 3 a stage failed; 130 interrupted.
    """
    gc.set_threshold(_NEW_OBJECTS)
    from femprep.cli._logging import keep_warnings, stop_logging
    from femprep.cli._streams import prepare_streams

    prepare_streams()
    signal.signal(signal.SIGTERM, _terminate)
    _keep_memory()
    # The system takes all memory back at the end: Python need not look through it for cycles first.
    atexit.register(gc.freeze)
    try:
        with keep_warnings():
            return _run(arguments)
    except KeyboardInterrupt:
        return _interrupted()
    except BrokenPipeError:
        _drop_output()
        return 0
    except (Exception, SystemExit) as error:  # libraries leave by themselves, too
        if isinstance(error, SystemExit) and _meant(error):
            return int(error.code or 0)
        if isinstance(error.__context__, BrokenPipeError):
            _drop_output()
            return 0
        logging.getLogger(__name__).debug("what went wrong", exc_info=True)
        return _said(error, sys.argv[1:] if arguments is None else arguments)
    finally:
        stop_logging()


def _run(arguments: list[str] | None) -> int:
    """The command's own status; what it prints is out when this returns."""
    from femprep.cli._app import app

    status = int(app(args=arguments, prog_name="femprep", standalone_mode=False) or 0)
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except OSError as error:
        _drop_output()
        raise cannot_write("what is printed", error, "send it elsewhere") from None
    return _interrupted() if status == INTERRUPTED else status


def _meant(leaving: SystemExit) -> bool:
    """Whether the command line's library leaves because it is done: after completing a word for the shell, for one."""
    return not leaving.code or (isinstance(leaving.code, int) and "_FEMPREP_COMPLETE" in os.environ)


def _said(error: BaseException, arguments: list[str]) -> int:
    """Say in one line what went wrong; the exit status it means."""
    if isinstance(error, OptionError):
        from femprep.cli._fields import as_given

        return _line(as_given(str(error), arguments), error.exit_status)
    if isinstance(error, FemprepError):
        return _line(str(error), error.exit_status)
    if isinstance(error, OSError):  # what is wrong with a file has been said; a disk may be full anywhere
        full = cannot_write("what was to be written", error, "write to another disk")
        if isinstance(full, DiskFullError):
            return _line(str(full), full.exit_status)
        if error.errno in _BAD_NAMES and error.filename is not None:
            name = repr(str(error.filename))
            shown = name if len(name) <= _LONGEST_NAME else f"{name[:_LONGEST_NAME]}..."
            return _line(f"{shown} cannot be used: {error.strerror}; give another file or folder", 2)
    if isinstance(error, MemoryError):
        said = f" ({error})" if str(error) else ""
        return _line(f"memory ran out{said}; choose larger voxels or a larger edge length, or a larger machine", 3)
    if type(error).__name__ == "Abort":
        return _interrupted()
    if hasattr(error, "show"):
        return _usage(error)
    from femprep.cli._crash import write_crash

    path = write_crash(error, arguments)
    where = f"send us {str(path)!r}, which says where" if path else "what is known of it could not be written anywhere"
    return _line(f"{type(error).__name__}: {error}: nobody foresaw this, and nothing was written; {where}", 3)


def _line(words: str, status: int) -> int:
    """One line on standard error, whatever is in the words: a file may be named by control characters."""
    shown = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in " ".join(words.split()))
    with suppress(OSError, ValueError):  # standard error may be closed
        print(f"femprep: error: {shown}", file=sys.stderr)  # noqa: T201
    return status


def _drop_output() -> None:
    """Whoever read the output has gone: let Python's own end not stumble over what is still to be sent."""
    with suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _usage(error: Any) -> int:
    """Exit status of an error of the command line's own grammar."""
    status = int(getattr(error, "exit_code", 2))
    if type(error).__name__ == "NoArgsIsHelpError":  # which shows the help
        error.show()
        return status
    context: Any = getattr(error, "ctx", None)
    command = "femprep" if context is None else context.command_path
    return _line(f"{_grammar(error)}; see {command} --help", 2)


def _grammar(error: Any) -> str:
    """What is wrong in one clause, with the option that was meant."""
    wrong, near = getattr(error, "option_name", None), getattr(error, "possibilities", None)
    if wrong is None or near is None:
        said = " ".join(error.format_message().split()).rstrip(".")
        return f"{said[:1].lower()}{said[1:]}"
    # Those the parser found first, then the one that is most like it.
    return f"no such option {wrong}{did_you_mean(get_close_matches(wrong, near, n=1) or list(near)[:2])}"


def _keep_memory() -> None:
    """Let the C library keep freed memory for the next array of any thread: new pages cost more than to fill them."""
    import ctypes

    try:
        adjust = ctypes.CDLL(None).mallopt
    except (OSError, TypeError, AttributeError):  # not the GNU library: it does as it likes
        return
    for option in (_TRIM_THRESHOLD, _MMAP_THRESHOLD):
        adjust(option, 2**30)
    adjust(_ARENA_MAX, 1)


def _interrupted() -> int:
    print("femprep: interrupted; nothing half-made is left", file=sys.stderr)  # noqa: T201
    return INTERRUPTED


def _terminate(_signal: int, _frame: FrameType | None) -> None:
    """On SIGTERM leave the way Ctrl-C does, so that children and half-made files are cleared away."""
    raise KeyboardInterrupt
