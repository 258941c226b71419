"""Colours of structures, facets and regions: the same for the same thing in every picture of a page."""

from __future__ import annotations

from typing import Final

from femprep.model import FACET_TAGS

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


#: Colour of each region of a mesh.
REGIONS: Final = {
    "lv": OTHERS[0],
    "rv": OTHERS[1],
    "septum": OTHERS[2],
    "la": OTHERS[3],
    "ra": OTHERS[4],
    "aorta": OTHERS[5],
    "pulmonary_artery": OTHERS[6],
    "scar": "#3d3d3d",
    "border": "#9a6fb0",
    "fat": "#f2c11f",
    "edema": "#4fa3d1",
    "hypoperfused": "#7d8f3a",
    "no_reflow": "#b0383d",
}
#: Walls among the structures of a label map, and the region of a mesh that each becomes.
_WALLS: Final = {"myo": "lv", "rv_wall": "rv", "la_wall": "la", "ra_wall": "ra"}
#: Share of a colour in its pale form, which fills areas that lines are drawn over.
_PALE: Final = 0.3


def colour(name: str) -> str:
    """Colour of facets by name."""
    return FACETS.get(name) or OTHERS[list(FACET_TAGS).index(name) % len(OTHERS) if name in FACET_TAGS else -1]


def region_colour(name: str) -> str:
    """Colour of a region of a mesh; blood has that of its structure in the labels."""
    return structure_colour(name.removeprefix("blood_")) if name.startswith("blood_") else REGIONS.get(name, OTHERS[-1])


def structure_colour(name: str) -> str:
    """Colour of a structure of a label map: a wall's is that of its region, a cavity's its endocardium's, pale."""
    if name.endswith("_wall") or name in _WALLS:
        return _pale(region_colour(_WALLS.get(name, name.removesuffix("_wall"))))
    return _pale(colour(f"endo_{name}"))


def _pale(shade: str) -> str:
    parts = (int(shade[k : k + 2], 16) for k in (1, 3, 5))
    return "#" + "".join(f"{round(255 - _PALE * (255 - part)):02x}" for part in parts)
