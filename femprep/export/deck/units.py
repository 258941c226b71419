"""A unit of length in, the consistent system of units of a deck out."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final


@dataclass(frozen=True)
class Units:
    """A consistent system of units.

    Attributes
    ----------
    length : str
        Unit of length.
    per_mm : float
        How many of them a millimetre is.
    pressure : str
        Unit of pressure and stress.
    per_kpa : float
        How many of them a kilopascal is.
    force, mass, time : str
        The units that go with them.
    """

    length: str
    per_mm: float
    pressure: str
    per_kpa: float
    force: str
    mass: str
    time: str

    @property
    def line(self) -> str:
        """One line that names them all."""
        return (
            f"length {self.length}, force {self.force}, pressure and stress {self.pressure}, "
            f"mass {self.mass}, time {self.time}"
        )


UNITS: Final = {
    "mm": Units("mm", 1.0, "MPa", 1e-3, "N", "t", "s"),
    "cm": Units("cm", 0.1, "dyn/cm2", 1e4, "dyn", "g", "s"),
    "m": Units("m", 1e-3, "Pa", 1e3, "N", "kg", "s"),
    "um": Units("um", 1e3, "kPa", 1.0, "nN", "g", "s"),
}


#: How text files name their unit of length: femprep's own, FEBio's module, LS-DYNA's control card.
_NAMED: Final = re.compile(
    rb"(?:femprep volume mesh; |\*\* Units: )length (\w+),|<units>\s*(\w+)"
    rb"|^\*CONTROL_UNITS[^\n]*\n(?:\$[^\n]*\n)*\s*(\w+)",
    re.MULTILINE | re.IGNORECASE,
)
_HEAD: Final = 20_000


def stated_unit(path: Path) -> str | None:
    """Unit of length that a text file names near its top; None where it names none."""
    with path.open("rb") as file:
        match = _NAMED.search(file.read(_HEAD))
    name = next(filter(None, match.groups())).decode().lower() if match else ""
    return {"si": "m", "cgs": "cm"}.get(name, name if name in UNITS else None)


def units_of(path: Path) -> Units:
    """Units of a text file that names them near its top; millimetres where a file does not."""
    return UNITS[stated_unit(path) or "mm"]
