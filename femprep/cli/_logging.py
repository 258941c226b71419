"""``-v`` and ``--log FILE`` of every command: what the library says, on standard error and in a file."""

from __future__ import annotations

import logging
import platform
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any

import typer

from femprep import __version__
from femprep.cli._apart import WORDS, require_unnamed
from femprep.errors import cannot_write

LOGGING = "Messages"
_log = logging.getLogger("femprep")
#: Levels by the number of times ``-v`` is given.
_LEVELS = (logging.INFO, logging.DEBUG)


class _Screen(logging.Handler):
    """Lines to standard error as it is at the time, so that they pass above progress bars."""

    def emit(self, record: logging.LogRecord) -> None:
        typer.echo(self.format(record), err=True)


class _LogFile(logging.FileHandler):
    """A file of messages; one that cannot be written ends the command, as any other output does."""

    def handleError(self, record: logging.LogRecord) -> None:
        error = sys.exc_info()[1]
        if isinstance(error, OSError):
            _log.removeHandler(self)  # which what is said of it would meet again
            raise cannot_write(f"log {self.baseFilename!r}", error, "choose another --log") from None
        super().handleError(record)

    def close(self) -> None:
        with suppress(OSError):  # has been said
            super().close()


def _verbose(count: int) -> int:
    """Show messages: once what is done, twice all the library says."""
    if count:
        screen = _Screen(_LEVELS[min(count, len(_LEVELS)) - 1])
        screen.setFormatter(logging.Formatter("%(levelname)s %(name)s: %(message)s"))
        _add(screen)
    return count


def _file(context: typer.Context, path: Path | None) -> Path | None:
    """Write all messages to a file, whether they are shown or not."""
    if path is None:
        return None
    require_unnamed(path, "--log", context.meta.get(WORDS, ()))
    try:
        file = _LogFile(path, mode="w", encoding="utf-8")
    except OSError as error:
        raise cannot_write(f"log {str(path)!r}", error, "choose another --log") from None
    file.setLevel(logging.DEBUG)
    file.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s"))
    _add(file)
    _log.debug("femprep %s, Python %s, %s", __version__, platform.python_version(), platform.platform())
    _log.debug("command: %s", " ".join(sys.argv[1:]))
    return path


@contextmanager
def keep_warnings() -> Iterator[None]:
    """Send Python's warnings to the log instead of the screen: what concerns the user is said in a line of ours."""
    with warnings.catch_warnings():
        warnings.showwarning = _log_warning  # type: ignore[assignment]
        yield


def _log_warning(message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: object) -> None:
    _log.debug("%s:%d: %s: %s", filename, lineno, category.__name__, message)


def _add(handler: logging.Handler) -> None:
    _log.addHandler(handler)
    _log.setLevel(min(handler.level, _log.level or handler.level))


def stop_logging() -> None:
    """Close what this command opened, so that the next one in the same process starts afresh."""
    for handler in [one for one in _log.handlers if isinstance(one, _Screen | logging.FileHandler)]:
        _log.removeHandler(handler)
        handler.close()
    _log.setLevel(logging.NOTSET)


def _options(
    verbose: Annotated[
        int,
        typer.Option(
            "--verbose",
            "-v",
            count=True,
            metavar="",
            help="Show what is done; twice for more.",
            show_default=False,
            callback=_verbose,
            expose_value=False,
            is_eager=True,
            rich_help_panel=LOGGING,
        ),
    ] = 0,
    log: Annotated[
        Path | None,
        typer.Option(
            help="Write all messages, with times, to this file.",
            metavar="PATH",
            callback=_file,
            expose_value=False,
            is_eager=True,
            rich_help_panel=LOGGING,
        ),
    ] = None,
) -> None:
    """The two options; each command gets them."""


def logging_options() -> list[Any]:
    """Parameters for a command; their callbacks do all there is to do."""
    made = typer.Typer(add_completion=False)
    made.command()(_options)
    return list(typer.main.get_command(made).params)
