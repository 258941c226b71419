"""The ways in which the boundary of a mesh is read, in the order they are tried; the first that fits is taken."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from femprep.annotation.atrium import by_atrium
from femprep.annotation.cavities import by_cavities
from femprep.annotation.cups import by_hull
from femprep.annotation.flat import by_closed_sheets, by_creases, by_flat_pieces
from femprep.annotation.reading import Reading
from femprep.annotation.shell import Shell

#: One way of reading a boundary.
ReadingWay = Callable[[Shell], Reading]
#: From the strictest to the most tolerant: what the first ones find is as good as certain.
READING_WAYS: Final[Mapping[str, ReadingWay]] = {
    "closed sheets": by_closed_sheets,  # cavities closed all round
    "atrium": by_atrium,  # an atrium alone, with its valve and veins open
    "flat pieces": by_flat_pieces,  # a base, and perhaps an apex, cut flat
    "creases of 45 degrees": partial(by_creases, degrees=45.0),  # a base with sharp rims
    "creases of 30 degrees": partial(by_creases, degrees=30.0),  # a base with rims
    "cavities": by_cavities,  # chambers with openings, told by the space between them
    "convex hull": by_hull,  # one ventricle or two, open at a base that is rounded
}
