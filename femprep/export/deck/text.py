"""Arrays in, lines of text out: fixed, fast and exact as the field width of a deck allows."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import numpy.typing as npt
from pydantic_core import to_json

from femprep.mesh.compiled import compiled
from femprep.model import IntArray

#: Widest number field that CalculiX reads (``f20.0``); what is longer is cut off silently, exponent included.
FIELD = 20
#: Sizes between which the shortest text that reads back as the same float is no longer than that: seventeen digits,
#: sign and point fit, zeros after the point and exponents need not.
_SHORT = (0.1, 1e16)
#: From this size on Python and JSON write floats alike.
_PLAIN = 1e-4
#: Rows that are put into words at once: their numbers and words are held in memory.
_ROWS: Final = 100_000


def number(value: float, width: int = FIELD) -> str:
    """Shortest text of a float that reads back as the same float, or the nearest to it in so many characters."""
    text = repr(float(value))
    if len(text) <= width:
        return text
    size, room = abs(value), width - (value < 0)
    for less in (0, 1):  # one digit less where rounding, or a long exponent, makes the number longer
        if 1e-4 <= size < 10.0 ** (room - 2):
            whole = len(str(int(size))) if size >= 1 else 0
            text = f"{value:.{room - 1 - whole - less}f}"
            text = text.replace("0.", ".", 1) if size < 1 else text
        else:
            text = f"{value:.{room - 6 - less}e}"
        if len(text) <= width:
            break
    return text


def rows(*columns: npt.ArrayLike, separator: str = ", ", width: int | None = FIELD) -> str:
    """Lines of numbers, one per row: integer and float columns (or blocks of columns) and plain words side by side.

    Floats are exact where ``width`` is ``None``, else cut to 20 characters.
    """
    blocks = [np.asarray(column) for column in columns]
    if all(block.dtype.kind in "iu" for block in blocks):
        table = np.column_stack(blocks)
        return _integers(table.ravel(), table.shape[1], separator, "")
    if len(blocks[0]) == 0:
        return ""
    lists = [_texts(column, width) for block in blocks for column in block.reshape(len(block), -1).T]
    # Compiled code puts nested lists into the words of JSON: each float is the shortest text that reads back as it.
    text = to_json(list(zip(*lists)))[2:-2].replace(b'"', b"").replace(b"],[", b"\n")
    return text.replace(b",", separator.encode()).decode() + "\n"


def lines(*columns: npt.ArrayLike, separator: str = ", ", width: int | None = FIELD, before: str = "") -> Iterator[str]:
    """The same lines some at a time, for tables of any length; ``before`` is put at the beginning of each."""
    blocks = [np.asarray(column) for column in columns]
    for first in range(0, len(blocks[0]), _ROWS):
        text = rows(*(block[first : first + _ROWS] for block in blocks), separator=separator, width=width)
        yield before + text[:-1].replace("\n", "\n" + before) + "\n" if before else text


def _texts(column: npt.NDArray[Any], width: int | None) -> list[Any]:
    """The numbers of a column; as text where JSON's words for them are too long, or not those of Python."""
    if column.dtype.kind == "U":
        return list(column.tolist())
    if column.dtype.kind != "f":
        return list(column.astype(np.int64).tolist())
    values: list[Any] = column.tolist()
    size = np.abs(column)
    least, most = (_PLAIN, np.inf) if width is None else _SHORT
    for row in np.flatnonzero((size < least) & (size > 0.0) | ~(size < most)).tolist():
        values[row] = repr(values[row]) if width is None else number(values[row], width)
    return values


def wrapped(values: npt.ArrayLike, per_line: int, separator: str = ", ", end: str = "") -> str:
    """Whole numbers in lines of at most ``per_line``; ``end`` closes every line but the last."""
    return _integers(np.asarray(values), per_line, separator, end)


def _integers(values: IntArray, per_line: int, separator: str, end: str) -> str:
    between, close = (np.frombuffer(text.encode("ascii"), dtype=np.uint8) for text in (separator, end + "\n"))
    room = np.empty(len(values) * (FIELD + max(len(between), len(close))) + 1, dtype=np.uint8)
    used = _print(np.ascontiguousarray(values, dtype=np.int64), per_line, between, close, room)
    return room[:used].tobytes().decode("ascii") + ("\n" if len(values) else "")


@compiled()
def _print(
    values: IntArray,
    per_line: int,
    between: npt.NDArray[np.uint8],
    close: npt.NDArray[np.uint8],
    out: npt.NDArray[np.uint8],
) -> int:
    """Write numbers as text, ``between`` or ``close`` after each but the last; the number of characters."""
    at = 0
    for i in range(len(values)):
        if i > 0:
            mark = close if i % per_line == 0 else between
            for k in range(len(mark)):
                out[at] = mark[k]
                at += 1
        # Digits are taken from the negative number: the least of all has no positive one.
        rest = values[i] if values[i] < 0 else -values[i]
        size, more = 1, rest
        while more <= -10:
            more = (more + 9) // 10
            size += 1
        if values[i] < 0:
            out[at] = 45
            at += 1
        for k in range(at + size - 1, at - 1, -1):
            tens = (rest + 9) // 10
            out[k] = 48 + (10 * tens - rest)
            rest = tens
        at += size
    return at
