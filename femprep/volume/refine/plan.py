"""A wall and the edge length asked for in, how coarse the mesher may work and how often its mesh is refined out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.spatial import cKDTree

from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.topology import edge_table
from femprep.model import FloatArray, IntArray, Wall, tag_name
from femprep.options import VolumeOptions
from femprep.volume.sizing import SizingField

#: Edges by the thickness of a wall, at most: a layer of regular tetrahedra is .82 of their edges thick. In a thinner
#: wall elements are flat, and their children inherit a poor shape. A coarse mesh goes by the thickness that most of the
#: wall has, the edges asked for by that in the mean.
THROUGH: Final = 1.2
#: The longest edge of a coarse mesh, mm: on an adult's heart the chord then leaves the surface by a quarter of a mm.
LONGEST: Final = 7.5
#: The share of the wall that may be thinner than the thickness that counts, %: edges are shorter there.
_THIN: Final = 20.0
#: Edges follow the thickness where so much of the wall, %, is thinner than so many edges: one element that reaches from
#: surface to surface there has children of 17 degrees, and where sheets are nearer than the mesher's envelope is wide
#: it may join them.
_THINNEST: Final = 1.0
_LEAST: Final = 0.65
#: The same of a mesh that is not refined: for the mesher alone it is only the sheets that matter.
_LEAST_DIRECT: Final = 0.3
#: Points of a side at most that its thickness is measured at.
_MOST_POINTS: Final = 4000


@dataclass(frozen=True, eq=False)
class WallThickness:
    """How thick a wall is.

    Attributes
    ----------
    points : (n, 3) array
        Vertices of its sides, mm.
    values : (n,) array
        Distance of each from the other sides, mm.
    """

    points: FloatArray
    values: FloatArray

    def of_all_but(self, percent: float) -> float:
        """The thickness that all but some of the wall has, mm; 0 where it has one side alone."""
        return float(np.percentile(self.values, percent)) if len(self.values) else 0.0


def measured_thickness(wall: Wall) -> WallThickness:
    """Measure how thick a wall is, from points of each side to the other sides."""
    points, found = [np.empty((0, 3))], [np.empty(0)]
    for own, others in _sides(wall):
        nodes = np.unique(own)
        nodes = nodes[:: max(1, len(nodes) // _MOST_POINTS)]
        points.append(wall.points[nodes])
        found.append(ClosestFinder(wall.points, others)(wall.points[nodes]).distance)
    return WallThickness(np.concatenate(points), np.concatenate(found))


def nearest_sheets(wall: Wall) -> float:
    """How near the sides of a wall come to one another at middles of edges, mm; infinite where it has one side alone.

    Vertices of a thin wall were pushed apart to a millimetre, edges of 4 mm between them may be nearer.
    """
    found = float("inf")
    for own, others in _sides(wall):
        middles = wall.points[edge_table(own).nodes].mean(axis=1)
        found = min(found, float(ClosestFinder(wall.points, others)(middles).distance.min()))
    return found


def _sides(wall: Wall) -> Iterator[tuple[IntArray, IntArray]]:
    """Triangles of each side, and those of the other ones, where there are any."""
    sides = [t for t in np.unique(wall.facet_tag).tolist() if tag_name(t).startswith(("endo", "epi"))]
    for tag in sides:
        others = wall.triangles[np.isin(wall.facet_tag, [t for t in sides if t != tag])]
        if len(others):
            yield wall.triangles[wall.facet_tag == tag], others


def levels_of(options: VolumeOptions, thickness: WallThickness, field: SizingField | None = None) -> int:
    """How often a coarser mesh of a wall is refined to the edge lengths asked for, of a field or one; 0 for never."""
    if field is None:
        return levels_for(options, thickness.of_all_but(_THIN))
    if not len(thickness.points):
        return 0
    lengths = field.values[cKDTree(field.points).query(thickness.points)[1]]
    return levels_for(options, thickness.values, lengths)


def levels_for(options: VolumeOptions, thickness: float | FloatArray, lengths: FloatArray | None = None) -> int:
    """The same by the thickness that most of the wall has, or that and the edge lengths at places all over it, mm."""
    if options.refinement == "none":
        return 0
    longest = np.minimum(LONGEST, THROUGH * np.asarray(thickness))
    room = float(np.percentile(longest / (options.edge_length if lengths is None else lengths), _THIN))
    # Each element through the wall becomes two: an odd number of them comes of no smaller one.
    through = options.elements_through_wall or 0
    levels = 0
    while 2.0 ** (levels + 1) <= room and through % 2 ** (levels + 1) == 0:
        levels += 1
    return levels


def is_thin(thickness: WallThickness, edge_length: float, levels: int) -> bool:
    """Whether some of a wall is too thin for edges of a length, mm, so that they have to follow it there.

    ``levels`` is how often they are refined.
    """
    return 0.0 < thickness.of_all_but(_THINNEST) < (_LEAST if levels else _LEAST_DIRECT) * edge_length


def has_few_through(thickness: WallThickness, edge_length: float) -> bool:
    """Whether edges of a length, mm, leave few elements through a wall: they are longer than it is thick in the mean.

    Of 29 such hearts 6 missed the mean ratio with what suffices for others, for 10 to 20 s, of 31 others 3, for 5 s.
    """
    return bool(len(thickness.values)) and edge_length > float(thickness.values.mean())
