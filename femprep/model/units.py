"""Points of a heart in, their unit of length out, guessed from its size."""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError

#: Diagonal of the box around a heart, from a small animal's ventricle to a dilated human heart, mm.
SMALLEST, LARGEST = 8.0, 400.0
#: Diagonal of what may be meshed in a unit that was given, mm: as wide as labels may be, whose unit is given too.
LEAST, MOST = 1.0, 1700.0
#: Diagonals of human hearts and ventricles: of two units that are possible the one that gives such a heart is taken.
_USUAL: Final = (45.0, 300.0)
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


def guess_unit(points: npt.ArrayLike) -> tuple[str, float]:
    """Unit in which points are a heart's, and the diagonal of the box around it, mm.

    Raises
    ------
    InputError
        In no unit are they of a heart's size.
    """
    diagonal = float(np.linalg.norm(np.ptp(np.asarray(points, dtype=np.float64), axis=0)))
    for low, high in (_USUAL, (SMALLEST, LARGEST)):
        for unit, size in MILLIMETRES.items():
            if low <= diagonal * size <= high:
                return unit, diagonal * size
    raise InputError(
        f"the mesh measures {diagonal:.4g} from corner to corner of its box, which is a heart's size in none of "
        f"{', '.join(MILLIMETRES)}; name the unit by --unit"
    )
