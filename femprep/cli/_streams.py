"""Standard streams as the shell gave them in; streams that take whatever is written to them, without a word, out."""

from __future__ import annotations

import codecs
import io
import os
import sys
from typing import Final

#: Name of the way in which characters are sent that an encoding does not have.
_AS_FAR_AS_IT_GOES: Final = "femprep"


def prepare_streams() -> None:
    """Put the null device where a stream is closed, and let standard output show ``?`` for what it cannot encode.

    A closed stream is ``None`` in Python, and its number would go to the next file that is opened, into which libraries
    then write their messages. Bytes of file names that are no text are sent as they are, as ``ls`` does.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            stream = open(os.devnull, mode, encoding="utf-8")  # noqa: SIM115
            os.set_inheritable(stream.fileno(), True)
            setattr(sys, name, stream)
    codecs.register_error(_AS_FAR_AS_IT_GOES, _sent)
    if isinstance(sys.stdout, io.TextIOWrapper):  # not one that a program put in its place
        sys.stdout.reconfigure(errors=_AS_FAR_AS_IT_GOES)


def _sent(error: UnicodeError) -> tuple[str | bytes, int]:
    """What goes in the place of characters that cannot be encoded, and where to go on."""
    try:
        return codecs.lookup_error("surrogateescape")(error)
    except UnicodeError:
        return codecs.lookup_error("replace")(error)
