"""The command line: one file per command; this one starts them and turns errors into exit statuses."""

from __future__ import annotations

import atexit
import gc
import logging
import signal
import sys
from difflib import get_close_matches
from types import FrameType
from typing import Any

from femprep.errors import DiskFullError, FemprepError, cannot_write, did_you_mean

#: Exit status after Ctrl-C, as shells have it.
INTERRUPTED = 130
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
    from femprep.cli._app import app
    from femprep.cli._logging import stop_logging

    signal.signal(signal.SIGTERM, _terminate)
    _keep_memory()
    # The system takes all memory back at the end: Python need not look through it for cycles first.
    atexit.register(gc.freeze)
    try:
        status = int(app(args=arguments, prog_name="femprep", standalone_mode=False) or 0)
        return _interrupted() if status == INTERRUPTED else status
    except FemprepError as error:
        logging.getLogger(__name__).debug("what went wrong", exc_info=True)
        print(f"femprep: error: {' '.join(str(error).split())}", file=sys.stderr)  # noqa: T201
        return error.exit_status
    except KeyboardInterrupt:
        return _interrupted()
    except BrokenPipeError:
        return 0
    except OSError as error:  # what is wrong with a file has been said; a disk may be full anywhere
        full = cannot_write("what was to be written", error, "write to another disk")
        if not isinstance(full, DiskFullError):
            raise
        print(f"femprep: error: {full}", file=sys.stderr)  # noqa: T201
        return full.exit_status
    except Exception as error:
        logging.getLogger(__name__).debug("what went wrong", exc_info=True)
        return _usage(error)
    finally:
        stop_logging()


def _usage(error: Exception) -> int:
    """Exit status of an error of the command line's own grammar; anything else is a bug and goes on up."""
    if type(error).__name__ == "Abort":
        return _interrupted()
    show, status = getattr(error, "show", None), int(getattr(error, "exit_code", 2))
    if show is None:
        raise error
    if type(error).__name__ == "NoArgsIsHelpError":  # which shows the help
        show()
        return status
    context: Any = getattr(error, "ctx", None)
    command = "femprep" if context is None else context.command_path
    print(f"femprep: error: {_grammar(error)}; see {command} --help", file=sys.stderr)  # noqa: T201
    return status


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
    print("femprep: interrupted; nothing was written", file=sys.stderr)  # noqa: T201
    return INTERRUPTED


def _terminate(_signal: int, _frame: FrameType | None) -> None:
    """On SIGTERM leave the way Ctrl-C does, so that children and half-made files are cleared away."""
    raise KeyboardInterrupt
