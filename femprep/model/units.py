"""Size of a mesh or surface in, the unit of length in which it is a heart's out."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError

#: Diagonal of the box around a heart, mm: from a mouse's left ventricle, 5 mm long, to a dilated human heart with its
#: great vessels. Its tissue and blood have at most this volume, mL.
SMALLEST, LARGEST, LARGEST_ML = 6.0, 330.0, 1000.0
#: Diagonal of what may be meshed in a unit that was given, mm: as wide as labels may be, whose unit is given too.
LEAST, MOST = 1.0, 1700.0
#: Whose heart it is, by the largest diagonal, mm.
_KINDS: Final = ((30.0, "a mouse's or rat's"), (75.0, "a rabbit's or an infant's"), (np.inf, "a human's"))
#: Millimetres in one of each unit.
MILLIMETRES: Final = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 1e-3}


def check_size(what: str, diagonal: float, unit: str) -> None:
    """Refuse a unit that was given where no heart is of such a size.

    Parameters
    ----------
    what : str
        What is measured: ``"the mesh"``.
    diagonal : float
        Of the box around it, in that unit.
    unit : str

    Raises
    ------
    InputError
    """
    across = diagonal * MILLIMETRES[unit]
    if not LEAST <= across <= MOST:
        raise InputError(
            f"{what} measures {diagonal:.4g} from corner to corner of its box, {across:.3g} mm in the unit {unit!r} "
            "given, which is no heart's size; give another by --unit, or leave it out"
        )


def plausible_units(diagonal: float, volume: float = 0.0) -> list[str]:
    """Units in which a box of this diagonal holds a heart, and this volume is not larger than a heart's.

    Examples
    --------
    >>> plausible_units(0.12), plausible_units(15.4)
    (['m'], ['mm', 'cm'])
    """
    return [
        unit
        for unit, size in MILLIMETRES.items()
        if SMALLEST <= diagonal * size <= LARGEST and volume * size**3 <= 1e3 * LARGEST_ML
    ]


def unit_question(what: str, diagonal: float, volume: float = 0.0) -> str:
    """What is unclear about the unit of a mesh or surface of this size, and which option decides."""
    size = f"{what} measures {diagonal:.4g} from corner to corner of its box"
    fits = [(unit, diagonal * MILLIMETRES[unit]) for unit in plausible_units(diagonal, volume)]
    if fits:
        ways = (f"--unit {u} ({mm:.3g} mm: {next(k for top, k in _KINDS if mm < top)} heart)" for u, mm in fits)
        return f"{size}, a heart's size in more than one unit: choose {' or '.join(ways)}"
    also = f" and has a volume of {volume:.4g}" if volume else ""
    return f"{size}{also}, which is a heart's size in none of {', '.join(MILLIMETRES)}; name the unit by --unit"


def guess_unit(points: npt.ArrayLike, what: str) -> tuple[str, float]:
    """Unit in which points are a heart's, and the diagonal of the box around it, mm.

    Raises
    ------
    InputError
        They are of a heart's size in no unit, or in more than one.
    """
    diagonal = float(np.linalg.norm(np.ptp(np.asarray(points, dtype=np.float64), axis=0)))
    fits = plausible_units(diagonal)
    if len(fits) != 1:
        raise InputError(unit_question(what, diagonal))
    return fits[0], diagonal * MILLIMETRES[fits[0]]
