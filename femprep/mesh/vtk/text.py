"""An XML file of VTK's with arrays in text in; an error where one has other numbers than its points and cells need.

VTK reads as many as it needs and leaves the rest, so that one too many moves all that follow on by one.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final
from xml.parsers import expat

import numpy as np

from femprep.errors import FileError

_POLYGONS: Final = ("Verts", "Lines", "Strips", "Polys")
_SECTIONS: Final = ("FieldData", "PointData", "CellData", "Points", "Cells", *_POLYGONS)


def require_text(path: Path) -> None:
    """Check the number of numbers in each array that stands in a ``.vtu`` or ``.vtp`` file as text.

    Raises
    ------
    FileError
        It is another than that of the points or cells, or of the corners of all cells.
    """
    reader = _Reader()
    try:
        with path.open("rb") as file:
            reader.parser.ParseFile(file)
    except (expat.ExpatError, LookupError, ValueError):  # which VTK says itself
        return
    if reader.wrong:
        raise FileError(f"{str(path)!r} is damaged: {reader.wrong}")


class _Reader:
    """What the tags tell, and how many numbers stand between them."""

    def __init__(self) -> None:
        self.wrong: str | None = None
        self.section = ""
        self.counts: dict[str, int] = {}
        self.corners: dict[str, int] = {}
        self.array: Mapping[str, str] | None = None
        self.parts: list[str] = []
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler, self.parser.EndElementHandler = self._start, self._end

    def _start(self, name: str, found: dict[str, str]) -> None:
        if name == "InformationKey":  # within an array
            self.parser.CharacterDataHandler = None
        elif name == "Piece":
            self.counts = {key: int(value) for key, value in found.items() if key.startswith("NumberOf")}
        elif name in _SECTIONS:
            self.section, self.corners = name, {}
        elif name == "DataArray" and found.get("format") == "ascii":
            self.array, self.parts = found, []
            self.parser.CharacterDataHandler = self.parts.append

    def _end(self, name: str) -> None:
        if name == "InformationKey" and self.array is not None:
            self.parser.CharacterDataHandler = self.parts.append
        elif name == "DataArray" and self.array is not None:
            self._compare(self.array, "".join(self.parts))
            self.parser.CharacterDataHandler, self.array = None, None
        elif name == self.section and len(set(self.corners.values())) > 1:
            self._say(f"its {name} end at corner {self.corners['offsets']} of {self.corners['connectivity']}")

    def _compare(self, array: Mapping[str, str], text: str) -> None:
        # A number begins behind a blank, or at the beginning.
        inside = np.frombuffer(text.encode("ascii", "replace"), np.uint8) > ord(" ")
        count = int(inside[:1].sum() + (inside[1:] & ~inside[:-1]).sum())
        name = array.get("Name", "")
        if self.section in ("Cells", *_POLYGONS) and name == "connectivity":
            self.corners[name] = count
        expected = self._expected(array, name)
        if expected is not None and count != expected:
            self._say(f"its array {name!r} has {count} numbers, expected {expected}")
        elif name == "offsets" and self.section in ("Cells", *_POLYGONS):
            self.corners[name] = int(text.split()[-1]) if count else 0

    def _expected(self, array: Mapping[str, str], name: str) -> int | None:
        """Numbers of an array; None where its section does not tell."""
        components = max(int(array.get("NumberOfComponents", "3" if self.section == "Points" else "1")), 1)
        if self.section in ("PointData", "Points"):
            return components * self.counts.get("NumberOfPoints", 0)
        if self.section == "CellData":
            kinds = [f"NumberOf{kind}" for kind in ("Cells", *_POLYGONS)]
            return components * sum(self.counts.get(kind, 0) for kind in kinds)
        if self.section == "FieldData":
            return components * int(array["NumberOfTuples"]) if "NumberOfTuples" in array else None
        return self.counts.get(f"NumberOf{self.section}", 0) if name in ("offsets", "types") else None

    def _say(self, wrong: str) -> None:
        self.wrong = self.wrong or wrong
