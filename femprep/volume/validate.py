"""A wall and the options in, an error where a mesher must not be run on them; what the run will need, estimated."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.errors import Advice, InputError, OptionError, ResourceError
from femprep.mesh.measures.triangles import areas, edge_lengths
from femprep.mesh.search.closest import ClosestFinder
from femprep.mesh.search.intersection import self_intersections
from femprep.mesh.topology import edge_table, pieces, pinched_vertices, volume
from femprep.model import FloatArray, IntArray, Wall, tag_name
from femprep.options import VolumeOptions
from femprep.volume.refine.plan import THROUGH, levels_for, levels_of, measured_thickness
from femprep.volume.sizing import SizingField

#: Tetrahedra per edge length cubed of wall volume; 9.6 to 10.6 were measured, more where the wall is thin.
TETS_PER_CUBE: Final = 11.0
#: Memory of fTetWild: a fixed part and bytes per tetrahedron (measured: 152,000 in 0.5 GB, 1.17 million in 2.4 GB).
BASE_BYTES: Final = 0.15e9
BYTES_PER_TET: Final = 2.3e3
#: Seconds of fTetWild per tetrahedron (0.14 to 0.33 ms were measured).
SECONDS_PER_TET: Final = 2.5e-4
#: The same of a tetrahedron that a coarser one was cut into, with all that follows to the end of the run (measured:
#: 10.8 million with fibres in 7.1 GB).
BYTES_PER_CHILD: Final = 0.7e3
SECONDS_PER_CHILD: Final = 1.0e-5

#: How far a volume may be off before there is a wall: what is refused is certain. The base cuts away up to a fifth.
ROUGH: Final = 1.5
#: The same of a thickness: 34 walls were .83 to 1.10 times as thick as their voxels with the walls that are assumed,
#: and 19 walls of one or two pixels 1.0 to 1.7 times, for which there is the other term.
ROUGH_THICKNESS: Final = 1.2
ROUGH_PIXELS: Final = 0.8

#: Of what is computed, relative: 1.2 times a thickness of 1 mm is 1.2 mm.
_ROUNDING: Final = 1e-9

#: Facets of a wall may lie this far from the plane they are named after, mm.
PLANE_TOLERANCE: Final = 1e-6


@dataclass(frozen=True)
class Estimate:
    """What a run of the mesher will need, roughly.

    Attributes
    ----------
    elements : int
    gigabytes : float
    seconds : float
    """

    elements: int
    gigabytes: float
    seconds: float


def check_fillable(wall: Wall) -> None:
    """Check that a wall bounds a volume: fTetWild checks nothing, crashes or fills cavities silently.

    Raises
    ------
    InputError
        The wall is empty, not finite, has triangles without area, is open, branches, is inconsistently wound or wound
        the wrong way round, crosses itself, or has triangles without a tag or off the plane they are named after.
    """
    points, triangles = wall.points, wall.triangles
    if len(triangles) == 0:
        raise InputError("the wall has no triangles; build it from surfaces with build_wall")
    if not np.isfinite(points).all():
        row = int(np.argmin(np.isfinite(points).all(axis=1)))
        raise InputError(f"point {row} of the wall is {points[row].tolist()}; every coordinate must be finite")
    longest = edge_lengths(points, triangles).max(axis=1)
    thin = areas(points, triangles) <= 1e-9 * longest**2
    if thin.any():
        raise InputError(
            f"{_count(thin.sum(), 'triangle')} of the wall without area, the first is {int(np.argmax(thin))} "
            f"{_near(points[triangles[np.argmax(thin)]])}; remove or remesh them"
        )
    _check_topology(points, triangles)
    crossing = self_intersections(points, triangles)
    if len(crossing):
        a, b = crossing[0].tolist()
        raise InputError(
            f"the wall crosses itself at {_count(len(crossing), 'pair')} of triangles, the first {a} and {b} "
            f"{_near(points[triangles[a]])}; check that the surfaces lie inside each other"
        )
    _check_shells(points, triangles)
    _check_tags(wall)


def estimate(elements: float, levels: int = 0) -> Estimate:
    """Memory and time for a number of tetrahedra, made by refining coarser ones so many times."""
    coarse = elements / 8.0**levels
    used = max(BYTES_PER_TET * coarse, BYTES_PER_CHILD * elements if levels else 0.0)
    seconds = SECONDS_PER_TET * coarse + (SECONDS_PER_CHILD * elements if levels else 0.0)
    return Estimate(int(min(elements, 1e18)), (BASE_BYTES + used) / 1e9, seconds)


def check_edge_length(wall: Wall, options: VolumeOptions, size: float = 1.0, levels: int | None = None) -> Estimate:
    """Check that elements of the edge length asked for fit into the wall and, with what else is filled, into memory.

    Parameters
    ----------
    wall : Wall
    options : VolumeOptions
    size : float
        Volume of all that is filled over the wall's.
    levels : int, optional
        How often a coarser mesh is refined; as often as the wall bears where not given.

    Raises
    ------
    OptionError
        The edge length is more than 1.2 times as long as the wall is thick.
    ResourceError
        The mesh would need more memory than the limit.
    """
    levels = levels_of(options, measured_thickness(wall)) if levels is None else levels
    check_thickness(mean_thickness(wall), options)
    return check_amount(size * wall.volume, options, levels=levels)


def check_thickness(thickness: float, options: VolumeOptions, slack: float = 1.0) -> None:
    """The same for a wall of a mean thickness, mm, known within a factor.

    Raises
    ------
    OptionError
        As :func:`check_edge_length`, where that is certain.
    """
    if options.edge_length > slack * THROUGH * thickness * (1.0 + _ROUNDING):
        longest = _rounded_down(THROUGH * thickness / min(slack, ROUGH_THICKNESS))  # what the wall itself bears
        words = f"choose at most {longest:g}, better {thickness / 3:.2g} for three elements through the wall"
        raise OptionError(
            f"option 'edge_length' is {options.edge_length:g} mm, but the wall is only {thickness:.3g} mm thick on "
            "average",
            advice=[Advice(words, "volume.edge_length", longest)],
        )


def check_amount(volume: float, options: VolumeOptions, slack: float = 1.0, levels: int = 0) -> Estimate:
    """The same for a volume to be filled, mm3, known within a factor.

    Raises
    ------
    ResourceError
        As :func:`check_edge_length`, where that is certain.
    """
    need = estimate(TETS_PER_CUBE * volume / options.edge_length**3, levels)
    if need.gigabytes > slack * options.memory_limit:
        room = max(options.memory_limit * 1e9 - BASE_BYTES, 0.02e9)
        least = (TETS_PER_CUBE * volume * (BYTES_PER_CHILD if levels else BYTES_PER_TET) / room) ** (1 / 3)
        longer = float(f"{least * 1.005:.3g}")
        raise ResourceError(
            f"an edge length of {options.edge_length:g} mm makes about {need.elements:.2g} elements and needs about "
            f"{need.gigabytes:.3g} GB, more than the {options.memory_limit:g} GB of option memory_limit",
            advice=[
                Advice(f"choose an --edge-length of at least {longer:.3g} mm", "volume.edge_length", longer),
                Advice("give a larger memory_limit", "volume.memory_limit"),
            ],
        )
    return need


def check_roughly(
    tissue: float, side: float, least: float, options: VolumeOptions, filled: float = 0.0, pixel: float = 0.0
) -> float:
    """The same before there is a wall, by a tissue's volume, mm3, the area of its sides, mm2, and what else is filled.

    ``pixel`` is the size of the voxels that volume and area are known from, mm.

    Returns
    -------
    float
        Mean thickness of the wall, mm.

    Raises
    ------
    OptionError, ResourceError
        As :func:`check_edge_length`, where that is certain; or most of the wall would be thickened to ``least``.
    """
    thickness = 2.0 * tissue / side
    if thickness < least:
        thin = float(f"{thickness / 3.0:.1g}")
        raise OptionError(
            f"the wall is only {thickness:.2g} mm thick on average, and most of it would be thickened to option "
            f"minimum_thickness = {least:g} mm",
            advice=[Advice(f"give --minimum-thickness {thin:g}", "wall.minimum_thickness", thin)],
        )
    if options.mesher == "tetwild" and options.sizing is None and options.elements_through_wall is None:
        # The thinnest part of the wall, which decides, is not known yet: as many levels as its mean bears.
        check_thickness(thickness, options, max(ROUGH_THICKNESS, 1.0 + ROUGH_PIXELS * pixel / thickness))
        check_amount(tissue + filled, options, ROUGH, levels_for(options, thickness))
    return thickness


def _rounded_down(value: float) -> float:
    """The value to two digits, not rounded up: what is advised must be accepted."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.floor(value / step * (1.0 + _ROUNDING)) * step:.2g}")


def check_sizing(
    field: SizingField, options: VolumeOptions, size: float = 1.0, slack: float = 1.0, levels: int = 0
) -> Estimate:
    """Check that elements of edge lengths that vary fit into memory.

    ``size`` is as for :func:`check_edge_length`, ``slack`` and ``levels`` as for :func:`check_amount`.

    Raises
    ------
    ResourceError
        The mesh would need more memory than the limit.
    """
    need = estimate(TETS_PER_CUBE * size * field.elements, levels)
    if need.gigabytes > slack * options.memory_limit:
        raise ResourceError(
            f"edge lengths from {field.finest:.3g} to {field.coarsest:.3g} mm make about {need.elements:.2g} elements "
            f"and need about {need.gigabytes:.3g} GB, more than the {options.memory_limit:g} GB of option "
            "memory_limit; ask for fewer elements through the wall, larger edges, or a larger memory_limit"
        )
    return need


def mean_thickness(wall: Wall) -> float:
    """Mean thickness of a wall, mm: twice its volume by the area of its facets other than those in planes."""
    flat = np.isin(wall.facet_tag, [tag for name, tag in _tags(wall).items() if name in wall.planes])
    area = areas(wall.points, wall.triangles)
    side = float(area[~flat].sum())
    return 2.0 * wall.volume / (side if side > 0 else float(area.sum()))


def _tags(wall: Wall) -> dict[str, int]:
    return {tag_name(int(t)): int(t) for t in np.unique(wall.facet_tag)}


def _check_topology(points: FloatArray, triangles: IntArray) -> None:
    table = edge_table(triangles)
    for wrong, what, remedy in (
        (table.count == 1, "is open", "close it"),
        (table.count > 2, "branches", "make it a closed surface with two triangles at every edge"),
        (table.forward != 1, "is not consistently wound", "wind every triangle out of the tissue"),
    ):
        if wrong.any():
            raise InputError(
                f"the wall {what} at {_count(wrong.sum(), 'edge')}, the first between points "
                f"{table.nodes[np.argmax(wrong)].tolist()} {_near(points[table.nodes[np.argmax(wrong)]])}; {remedy}"
            )
    pinched = pinched_vertices(triangles)
    if len(pinched):
        raise InputError(
            f"the wall touches itself at {_count(len(pinched), 'point')}, the first is {pinched[0]} "
            f"{_near(points[pinched[:1]])}; separate the sheets that meet there"
        )


def _check_shells(points: FloatArray, triangles: IntArray) -> None:
    """Outer shells enclose tissue, shells inside them are cavities and are wound the other way round."""
    label = pieces(triangles)
    shells = [triangles[label == k] for k in range(int(label.max()) + 1)]
    sizes = [volume(points, shell) for shell in shells]
    outer = int(np.argmax(np.abs(sizes)))
    if sizes[outer] <= 0:
        raise InputError(
            f"the wall is wound inside out: its volume is {sum(sizes):.4g} mm3; wind every triangle out of the tissue"
        )
    for k, shell in enumerate(shells):
        start = points[shell[0, :1]]
        depth = sum(
            bool(ClosestFinder(points, other).signed(start)[0] * np.sign(sizes[j]) < 0)
            for j, other in enumerate(shells)
            if j != k
        )
        inward = depth % 2 == 1
        if inward != (sizes[k] < 0):
            raise InputError(
                f"shell {k} of the wall ({_count(len(shell), 'triangle')}, {_near(start)[1:-1]}) "
                + (
                    f"lies inside another one and bounds a cavity, but its volume is {sizes[k]:.4g} mm3; it has to be "
                    "wound towards the cavity, else the cavity would be filled"
                    if inward
                    else f"lies outside the others, but its volume is {sizes[k]:.4g} mm3; wind it outward"
                )
            )


def _check_tags(wall: Wall) -> None:
    if (wall.facet_tag <= 0).any():
        row = int(np.argmax(wall.facet_tag <= 0))
        raise InputError(
            f"{_count((wall.facet_tag <= 0).sum(), 'triangle')} of the wall without a tag, the first is {row} "
            f"{_near(wall.points[wall.triangles[row]])}; tag every facet with a number of FACET_TAGS"
        )
    tags = _tags(wall)
    for name, plane in wall.planes.items():
        if name not in tags:
            raise InputError(f"the wall has a plane {name!r} but no facets tagged {name!r}; tag them or drop the plane")
        nodes = np.unique(wall.triangles[wall.facet_tag == tags[name]])
        off = np.abs(plane.signed_distance(wall.points[nodes]))
        if off.max() > PLANE_TOLERANCE:
            raise InputError(
                f"point {nodes[np.argmax(off)]} of the facets tagged {name!r} lies {off.max():.2g} mm off their plane; "
                "cut the wall by that plane"
            )


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def _near(corners: FloatArray) -> str:
    return "(near x y z = " + " ".join(f"{value:.1f}" for value in corners.mean(axis=0)) + ")"
