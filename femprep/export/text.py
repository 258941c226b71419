"""Arrays in, lines of text out: fixed, fast and exact as the field width of a deck allows."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

#: Widest number field that CalculiX reads (``f20.0``); what is longer is cut off silently, exponent included.
FIELD = 20


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
    """Lines of numbers, one per row: integer and float columns (or blocks of columns) side by side.

    Floats are exact where ``width`` is ``None``, else cut to 20 characters.
    """
    texts: list[list[str]] = []
    for column in columns:
        block = np.asarray(column)
        write = str if block.dtype.kind != "f" else repr if width is None else number
        texts.extend(list(map(write, values.tolist())) for values in (block.T if block.ndim == 2 else [block]))
    return "".join(f"{separator.join(line)}\n" for line in zip(*texts))


def wrapped(values: npt.ArrayLike, per_line: int, separator: str = ", ", end: str = "") -> str:
    """Numbers in lines of at most ``per_line``; ``end`` closes every line but the last."""
    texts = list(map(str, np.asarray(values).tolist()))
    lines = [separator.join(texts[i : i + per_line]) for i in range(0, len(texts), per_line)]
    return f"{end}\n".join(lines) + "\n" if lines else ""
