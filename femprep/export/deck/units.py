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
}


def units_of(path: Path) -> Units:
    """Units of a text file of ours, which names them near its top; millimetres where a file does not."""
    with path.open("rb") as file:
        match = re.search(rb"femprep volume mesh; length (\w+),", file.read(1000))
    return UNITS.get(match[1].decode() if match else "mm", UNITS["mm"])
