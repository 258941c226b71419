"""Arrays in, lines of text out: fixed, fast and exact as the field width of a deck allows."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

#: Widest number field that CalculiX reads (``f20.0``); what is longer is cut off silently, exponent included.
FIELD = 20


def number(value: float) -> str:
    """Shortest text of a float that reads back as the same float, cut to 20 characters.

    Only values below 0.01, or in scientific notation, can need more than 20; they keep at least 13 digits.
    """
    text = repr(float(value))
    if len(text) <= FIELD:
        return text
    short = text.replace("0.", ".", 1) if text.lstrip("-").startswith("0.") else text
    if len(short) <= FIELD:
        return short
    return next(t for t in (f"{value:.{digits}e}" for digits in range(16, 0, -1)) if len(t) <= FIELD)


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
