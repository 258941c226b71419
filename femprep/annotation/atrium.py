"""The boundary of an atrium alone in, its names out: endocardium, epicardium, the rims of its valve and its veins.

An atrium is one thin-walled cavity with at least three openings. Its convex hull closes them; the largest one is the
valve's, the others are those of veins and of an appendage that was cut off.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.sparse import coo_array

from femprep.annotation.cavities import looks_at
from femprep.annotation.chambers import wall_thickness
from femprep.annotation.hollows import hollows
from femprep.annotation.reading import CavityOpening, Name, NoReading, Question, Reading
from femprep.annotation.shell import Shell
from femprep.annotation.space import flood
from femprep.annotation.vein_ends import plane_along, vein_rim
from femprep.mesh.topology import components, euler_characteristic
from femprep.model import FACET_TAGS, BoolArray, FloatArray, IntArray

#: The valve of each atrium, and the openings a left one has at least: four veins and the valve.
_VALVES: Final = {"la": "mitral", "ra": "tricuspid"}
_LEFT: Final = 5
#: The wall of an atrium is thinner than this share of the radius of a ball of its cavity's volume.
_THIN: Final = 0.2
#: An opening is at least so large, mm2.
_AREA: Final = 20.0


def by_atrium(shell: Shell, chamber: str | None = None) -> Reading:
    """One atrium with its valve and veins open.

    Parameters
    ----------
    shell : Shell
    chamber : {"la", "ra"}, optional
        Which one it is. Where not given it must have at least three openings and a thin wall, and the left one has at
        least five.

    Raises
    ------
    NoReading
        The boundary is none of an atrium.
    """
    if chamber is None and euler_characteristic(shell.triangles) > -2:
        raise NoReading("fewer than three openings lead through the wall; an atrium has a valve and veins")
    space, seeds, count = hollows(shell)
    if count != 1:
        raise NoReading(f"the convex hull holds {count} cavities; an atrium alone is one")
    looks = looks_at(shell, space, flood(space, np.where(space.outside | (seeds > 1), 2, seeds)))
    inside, outer = looks == 1, looks == 2
    rings = sorted((_ring(shell, pairs, inside) for pairs in _lines(shell, inside)), key=lambda ring: -ring[1])
    rings = [ring for ring in rings if ring[1] > _AREA]
    radius = (0.75 / np.pi * abs(shell.enclosed(inside))) ** (1.0 / 3.0)
    if len(rings) < (2 if chamber else 3) or (
        chamber is None and wall_thickness(shell, inside, outer) > _THIN * radius
    ):
        raise NoReading(f"{len(rings)} openings and the thickness of the wall are not those of an atrium")
    name = chamber or ("la" if len(rings) >= _LEFT else "ra")
    tag = np.where(inside, FACET_TAGS[f"endo_{name}"], FACET_TAGS["epi"]).astype(np.int32)
    openings, valve = [], _VALVES[name]
    for (rows, area, centre, normal), called in zip(rings, (valve, *["veins"] * len(rings))):
        tag[vein_rim(shell, inside, rows, normal)] = FACET_TAGS[called]
        openings.append(CavityOpening(called, name, centre, normal, area))
    ratio = rings[0][1] / rings[1][1]
    names = {
        f"endo_{name}": Name(1.0, "the one surface that looks into a cavity"),
        "epi": Name(0.95, "looks outside"),
        valve: Name(1.0 - 0.5 / ratio**2, f"the largest opening, {ratio:.1f} times the next"),
        "veins": Name(0.85, f"the other {len(rings) - 1} openings"),
    }
    words = f"the mesh is an atrium with {len(rings)} openings: a right one, or a left one with few veins"
    asked = (Question(words, 'anatomy = "right-atrium", or "left-atrium"'),) if chamber is None and name == "ra" else ()
    return Reading("atrium", tag, names, asked, tuple(openings))


def _lines(shell: Shell, inside: BoolArray) -> list[IntArray]:
    """Pairs of facets ``(k, 2)`` along each closed line that parts the inside from the rest."""
    apart = shell.pairs[inside[shell.pairs].sum(axis=1) == 1]
    size = (len(shell), len(shell.points))
    facet = np.repeat(shell.facet_of, 3)
    corner = coo_array((np.ones(facet.size), (facet, shell.triangles.ravel())), shape=size).tocsr() > 0
    row, node = corner[apart[:, 0]].multiply(corner[apart[:, 1]]).nonzero()
    line = components(row, len(apart) + node, len(apart) + size[1])[: len(apart)]
    return [apart[line == k] for k in np.unique(line)]


def _ring(shell: Shell, pairs: IntArray, inside: BoolArray) -> tuple[IntArray, float, FloatArray, FloatArray]:
    """Facets along the line that parts an opening, its area (mm2), centre and normal out of the cavity."""
    at = shell.centre[pairs].mean(axis=1)
    centre = at.mean(axis=0)
    normal = plane_along(at, centre - shell.centre[inside].mean(axis=0))[1]
    radius = np.linalg.norm(np.cross(at - centre, normal), axis=1).mean()
    return pairs.ravel(), float(np.pi * radius**2), centre, normal
