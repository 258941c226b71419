"""A wall and the edge length asked for in, how coarse the mesher may work and how often its mesh is refined out."""

from __future__ import annotations

from typing import Final

import numpy as np

from femprep.mesh.closest import ClosestFinder
from femprep.model import Wall, tag_name
from femprep.options import VolumeOptions

#: Edges of a coarse mesh by the thickness that all but a twentieth of the wall has: below it, more than half of an
#: element's corners lie on surfaces, and its children inherit a poor shape.
THROUGH: Final = 1.2
#: The longest edge of a coarse mesh, mm: on an adult's heart the chord then leaves the surface by a quarter of a mm.
LONGEST: Final = 6.5
#: The share of the wall that may be thinner than the thickness that counts, %.
_THIN: Final = 5.0
#: Points of a side at most that its thickness is measured at.
_MOST_POINTS: Final = 4000


def levels_of(options: VolumeOptions, wall: Wall) -> int:
    """How often a coarser mesh of a wall is refined to the edge length asked for; 0 for never."""
    return levels_for(options, thin_thickness(wall)) if _refines(options) else 0


def levels_for(options: VolumeOptions, thickness: float) -> int:
    """The same by the wall's thickness, mm."""
    if not _refines(options):
        return 0
    limit = min(LONGEST, THROUGH * thickness)
    levels = 0
    while options.edge_length * 2.0 ** (levels + 1) <= limit:
        levels += 1
    return levels


def _refines(options: VolumeOptions) -> bool:
    return options.refinement == "auto" and options.sizing is None and options.elements_through_wall is None


def thin_thickness(wall: Wall) -> float:
    """The thickness that all but a twentieth of a wall has, mm: from each point of a side to the other sides."""
    sides = [t for t in np.unique(wall.facet_tag).tolist() if tag_name(t).startswith(("endo", "epi"))]
    found = []
    for tag in sides:
        others = wall.triangles[np.isin(wall.facet_tag, [t for t in sides if t != tag])]
        if not len(others):
            continue
        nodes = np.unique(wall.triangles[wall.facet_tag == tag])
        nodes = nodes[:: max(1, len(nodes) // _MOST_POINTS)]
        found.append(ClosestFinder(wall.points, others)(wall.points[nodes]).distance)
    return float(np.percentile(np.concatenate(found), _THIN)) if found else 0.0
