"""The ways in which the boundary of a mesh is read, in the order they are tried; the first that fits is taken."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

from femprep.annotation.cavities import by_cavities
from femprep.annotation.cups import by_hull
from femprep.annotation.flat import by_closed_sheets, by_creases, by_flat_pieces
from femprep.annotation.reading import Reading
from femprep.annotation.shell import Shell


@dataclass(frozen=True)
class ReadingWay:
    """One way of reading a boundary: its name, what it takes for granted, and what does it."""

    name: str
    takes: str
    read: Callable[[Shell], Reading]


#: From the strictest to the most tolerant: what the first ones find is as good as certain.
READING_WAYS: Final = (
    ReadingWay("closed sheets", "cavities closed all round", by_closed_sheets),
    ReadingWay("flat pieces", "a base, and perhaps an apex, cut flat", by_flat_pieces),
    ReadingWay("creases of 45 degrees", "a base with sharp rims", partial(by_creases, degrees=45.0)),
    ReadingWay("creases of 30 degrees", "a base with rims", partial(by_creases, degrees=30.0)),
    ReadingWay("cavities", "chambers with openings, told by the space between them", by_cavities),
    ReadingWay("convex hull", "one ventricle or two, open at a base that is rounded", by_hull),
)
