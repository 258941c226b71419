"""Colours of structures, facets and regions: the same for the same thing in every picture of a page."""

from __future__ import annotations

from typing import Final

#: Colour of each facet tag's name; a name with a chamber behind it has that of the chamber, or of the stem.
FACETS: Final = {
    "endo": "#b3202a",
    "endo_lv": "#b3202a",
    "endo_rv": "#7a4b14",
    "endo_la": "#d9622b",
    "endo_ra": "#5c2a7a",
    "epi": "#14508c",
    "base": "#1d7a3a",
    "apex": "#8a8a1f",
}
#: For names that are not in a table, in turn; ColorBrewer's Set2.
OTHERS: Final = ("#66c2a5", "#fc8d62", "#8da0cb", "#e78ac3", "#a6d854", "#ffd92f", "#e5c494", "#b3b3b3")
#: Seventeen segments: a hue for each wall, darker towards the base.
SEGMENTS: Final = (
    *("#1f5fa8", "#2f8f4e", "#b0a020", "#b5651d", "#a8323a", "#6a3d9a"),
    *("#5b93cf", "#6cbf84", "#d8cb55", "#dd9a5c", "#d1747a", "#9c78c4"),
    *("#a3c4e8", "#e9df97", "#e8adb1", "#c9b3e0", "#d0d0d0"),
)
#: Ends of a scale of figures, and between: viridis, which is read in grey and by the colour-blind too.
SCALE: Final = ("#440154", "#414487", "#2a788e", "#22a884", "#7ad151", "#fde725")


def colour(name: str, number: int = 0) -> str:
    """Colour of facets by name; of others, by their number."""
    return FACETS.get(name, OTHERS[number % len(OTHERS)])
