"""Numbers as decks write them in, floats out: exponents after ``D``, or after nothing but a sign, are Fortran's."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.model import FloatArray

_FORTRAN: Final = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+))(?:[dD]([-+]?\d+)|([-+]\d+))\s*")


def real(text: str, row: str, *, fortran: bool = True) -> float:
    """One number of a row.

    Parameters
    ----------
    text, row : str
        The number, and the row it stands in, which an error names.
    fortran : bool
        Whether the program that reads such files takes ``1.0D+01`` and ``1.0+1``.

    Raises
    ------
    InputError
        It is none.
    """
    try:
        return float(text)
    except ValueError:
        match = _FORTRAN.fullmatch(text) if fortran else None
        if match is None:
            raise InputError(
                f"{text.strip()!r} in the row {row.strip()[:80]!r} is no number; write it as 10.5 or 1.05E+01"
            ) from None
        return float(f"{match[1]}e{match[2] or match[3]}")


def reals(rows: Sequence[Sequence[str]], *, fortran: bool = True) -> FloatArray:
    """A table of numbers.

    Raises
    ------
    InputError
        One is none.
    """
    try:
        return np.array(rows, dtype=np.float64)
    except ValueError:
        return np.array([[real(text, ",".join(row), fortran=fortran) for text in row] for row in rows])
