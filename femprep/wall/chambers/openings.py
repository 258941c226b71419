"""Label map in, openings of its chambers out: valves and vessels, where cavities meet each other or the outside.

Fitted surfaces are closed. Where the labels of two cavities touch over an area there is no tissue between them, which
is how label maps show mitral and tricuspid valve; where a cavity is open to the outside, they touch the background.
Maps that leave the leaflets out show such a valve as two openings to the background that face each other.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy.ndimage import label

from femprep.errors import InputError
from femprep.mesh.closest import ClosestFinder
from femprep.model import FACET_TAGS, FloatArray, Notice, Plane, Wall, noted
from femprep.model.functions import sine_cosine
from femprep.model.notice import spot
from femprep.model.products import length
from femprep.wall.joining.solid import drill, plane_frame

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation

logger = logging.getLogger(__name__)

#: What an opening is called, by the cavity and what lies beyond it; None is the outside.
NAMES: Final[Mapping[tuple[str, str | None], str]] = {
    ("lv", "la"): "mitral",
    ("rv", "ra"): "tricuspid",
    ("lv", None): "aortic",
    ("rv", None): "pulmonary",
    ("la", None): "veins",
    ("ra", None): "veins",
}
#: An opening is taken from labels where they touch over at least this area, mm2, that fills at least this share of its
#: circle and lies within this share of its radius (root mean square) of a plane.
_AREA, _FULL, _FLAT = 60.0, 0.5, 0.35
#: Slices farther apart than this, mm, do not tell an opening to the outside from a thin wall.
_THICK: Final = 3.0
#: Openings to the background face each other across a valve's leaflets where the cosine between their normals is below
#: this and their centres are nearer than this share of the smaller radius.
_FACING, _NEAR = -0.7, 0.7
#: A hole has this share of the radius of the opening, and is made smaller by this factor, so many times, where it would
#: meet another surface.
_INNER, _SHRINK, _TRIES = 0.85, 0.85, 4
#: How far from its plane the tissue of an opening is looked for, at which steps, how far a hole reaches beyond it, mm.
_REACH, _STEP, _BEYOND = 15.0, 0.25, 0.5
#: Least distance of a hole from surfaces it does not open, mm, and why an opening without such a hole is not cut.
_CLEAR: Final = 1.0
_BLOCKED: Final = "there is no straight way from the cavity through its wall that keeps clear of other surfaces"


@dataclass(frozen=True)
class Opening:
    """A round opening of a cavity.

    Attributes
    ----------
    name : str
        Facet name of the ring of tissue around it: ``mitral``, ``tricuspid``, ``aortic``, ``pulmonary``, ``veins``.
    cavity : str
    beyond : str or None
        The cavity on its other side; None for the outside.
    plane : Plane
        Through its centre, its normal out of the cavity.
    radius : float
        mm.
    """

    name: str
    cavity: str
    beyond: str | None
    plane: Plane
    radius: float


def find_openings(seg: Segmentation) -> list[Opening]:
    """The openings that the labels of a whole heart show.

    Parameters
    ----------
    seg : Segmentation
        With the structures ``lv``, ``rv``, ``la``, ``ra``.

    Returns
    -------
    list of Opening
        The larger first for each pair; several for veins.

    Examples
    --------
    >>> fp.find_openings(whole)  # doctest: +SKIP
    [Opening(name='mitral', ...), ...]
    """
    found: dict[tuple[str, str | None], list[Opening]] = {}
    labels = np.asarray(seg.labels)
    for (cavity, beyond), name in NAMES.items():
        inside, other = (
            np.isin(labels, (0,) if part is None else seg.structures.get(part, ())) for part in (cavity, beyond)
        )
        own = found[cavity, beyond] = []
        for centres, normals, areas in _contacts(seg, inside, other):
            opening = _opening(name, cavity, beyond, centres, normals, areas)
            if opening is None:
                continue
            # Between thick slices a thin wall is missed, so that every chamber seems open at the ends of a stack.
            across = np.abs(opening.plane.normal @ np.asarray(seg.grid.direction)) * np.asarray(seg.grid.spacing)
            if beyond is not None or np.linalg.norm(across) <= _THICK:
                own.append(opening)
        own.sort(key=lambda opening: -opening.radius)
    for ventricle, atrium in (("lv", "la"), ("rv", "ra")):
        if not found[ventricle, atrium]:
            found[ventricle, atrium] = _across_leaflets(found[ventricle, None], found[atrium, None])
    return [opening for own in found.values() for opening in (own if own and own[0].name == "veins" else own[:1])]


def _across_leaflets(ventricle: list[Opening], atrium: list[Opening]) -> list[Opening]:
    """The valve between two chambers whose labels leave out its leaflets, so that both are open to the background.

    Two openings to the outside that look at each other are one valve; they are taken out of the lists.
    """
    for below in ventricle:
        for above in atrium:
            radius, between = min(below.radius, above.radius), above.plane.point - below.plane.point
            if below.plane.normal @ above.plane.normal > _FACING or np.linalg.norm(between) > _NEAR * radius:
                continue
            ventricle.remove(below)
            atrium.remove(above)
            middle = below.plane.point + 0.5 * between
            plane = Plane(middle, below.plane.normal - above.plane.normal, "labels")
            return [Opening(NAMES[below.cavity, above.cavity], below.cavity, above.cavity, plane, radius)]
    return []


def _contacts(seg: Segmentation, inside: Any, other: Any) -> list[tuple[FloatArray, FloatArray, FloatArray]]:
    """Voxel faces between two masks by connected patch: centres and normals out of the first ``(f, 3)``, areas."""
    spacing, direction = np.asarray(seg.grid.spacing), np.asarray(seg.grid.direction)
    index, way, patch = [], [], np.zeros(inside.shape, dtype=bool)
    for axis in range(3):
        for sign in (1, -1):
            beyond = np.zeros_like(other)
            low, high = [slice(None)] * 3, [slice(None)] * 3
            low[axis], high[axis] = (slice(None, -1), slice(1, None)) if sign > 0 else (slice(1, None), slice(None, -1))
            beyond[tuple(low)] = other[tuple(high)]
            touching = inside & beyond
            patch |= touching
            at = np.argwhere(touching)
            index.append(at)
            way.append(np.full(len(at), axis + 3 * (sign < 0)))
    at, kind = np.concatenate(index), np.concatenate(way)
    pieces: Any = label(patch, np.ones((3, 3, 3)))
    number = pieces[0][tuple(at.T)]
    side, sense = kind % 3, np.where(kind < 3, 1.0, -1.0)
    offset = np.zeros(at.shape)
    offset[np.arange(len(at)), side] = 0.5 * sense
    centres = seg.grid.to_world(at + offset)
    normals = sense[:, None] * (direction / np.linalg.norm(direction, axis=0)).T[side]
    areas = np.prod(spacing) / spacing[side]
    return [(centres[number == k], normals[number == k], areas[number == k]) for k in np.unique(number)]


def _opening(
    name: str, cavity: str, beyond: str | None, centres: FloatArray, normals: FloatArray, areas: FloatArray
) -> Opening | None:
    """A patch of voxel faces as a round opening; None where it is too small, too ragged or too bent for one."""
    flow = (areas[:, None] * normals).sum(axis=0)
    area = length(flow)  # the area across the normal
    if area < _AREA:
        return None
    middle = np.average(centres, axis=0, weights=areas)
    plane = Plane(middle, flow, "labels")
    radius = float(np.sqrt(area / np.pi))
    off = plane.signed_distance(centres)
    along = np.linalg.norm(centres - middle - off[:, None] * plane.normal, axis=1)
    rough = float(np.sqrt(np.average(off**2, weights=areas)))
    if (radius / max(float(np.percentile(along, 98)), radius)) ** 2 < _FULL or rough > _FLAT * radius:
        return None
    return Opening(name, cavity, beyond, plane, radius)


def given_openings(planes: Mapping[str, tuple[float, ...]]) -> list[Opening]:
    """Openings as they are given: by name, centre (x, y, z), normal out of the ventricle or atrium, radius; mm LPS.

    Raises
    ------
    InputError
        A name is unknown, or there are not seven numbers.
    """
    found = []
    for key, numbers in planes.items():
        name, _, cavity = key.partition("_")
        pairs = [pair for pair, own in NAMES.items() if own == name and (not cavity or pair[0] == cavity)]
        if len(pairs) != 1:
            raise InputError(
                f"opening {key!r} is not known; known are mitral, tricuspid, aortic, pulmonary, veins_la and veins_ra"
            )
        if len(numbers) != 7 or not numbers[6] > 0:
            raise InputError(
                f"opening {key!r} is {list(numbers)}, expected centre x, y, z, normal x, y, z, and radius, mm"
            )
        plane = Plane(np.array(numbers[:3]), np.array(numbers[3:6]), "given")
        found.append(Opening(name, *pairs[0], plane, float(numbers[6]) / _INNER))
    return found


def check_openings(seg: Segmentation, openings: list[Opening]) -> None:
    """Refuse openings given by hand that the labels contradict: not a matter of a few millimetres.

    The line along an opening's normal through its centre has to lead, within the reach of a hole, out of the labels of
    its cavity into those of what lies beyond.

    Raises
    ------
    InputError
        It does not.
    """
    labels = np.asarray(seg.labels)
    steps = np.arange(-_REACH, _REACH + _STEP, _STEP)
    for opening in openings:
        if opening.plane.source != "given":
            continue
        line = opening.plane.point + steps[:, None] * opening.plane.normal
        index = np.round(seg.grid.to_index(line)).astype(int)
        inside = np.all((index >= 0) & (index < labels.shape), axis=1)
        met = np.zeros(len(steps), dtype=labels.dtype)
        met[inside] = labels[tuple(index[inside].T)]
        within, beyond = (
            np.isin(met, (0,) if part is None else seg.structures.get(part, ()))
            for part in (opening.cavity, opening.beyond)
        )
        if not (within.any() and beyond[int(np.argmax(within)) :].any()):
            raise InputError(
                f"the {opening.name} opening given at {spot(opening.plane.point)} leads from no voxel of "
                f"{opening.cavity!r} to {'the outside' if opening.beyond is None else repr(opening.beyond)} within "
                f"{_REACH:g} mm along its normal; give centre and normal, out of the chamber, in mm LPS"
            )


def open_wall(wall: Wall, openings: list[Opening]) -> Wall:
    """Cut openings into the closed wall of a whole heart.

    Each is a round hole along its normal, from the cavity through the tissue into what lies beyond. It is as large as
    the opening less a margin, for the surfaces were fitted as if closed; smaller where it would meet another surface.

    Parameters
    ----------
    wall : Wall
        With facets tagged ``endo_lv``, ``endo_rv``, ``endo_la``, ``endo_ra`` and ``epi``, all closed.
    openings : list of Opening

    Returns
    -------
    Wall
        The sides of each hole are tagged by its name. ``info["openings"]`` tells what was cut, and what was not, why.

    Raises
    ------
    InputError
        An opening that was given by hand cannot be cut.

    Examples
    --------
    >>> fp.open_wall(wall, fp.find_openings(whole))  # doctest: +SKIP
    Wall(... points, ... triangles: endo_lv, ..., mitral, tricuspid, aortic, pulmonary)
    """
    sheets = {}
    for name in ("endo_lv", "endo_rv", "endo_la", "endo_ra", "epi"):
        triangles = wall.triangles[wall.facet_tag == FACET_TAGS[name]]
        # All are turned outward: on endocardia the wall's triangles look into the cavity.
        sheets[name] = ClosestFinder(wall.points, triangles if name == "epi" else triangles[:, ::-1])
    holes, records = [], []
    for opening in openings:
        radius, ends = _fit(opening, sheets)
        record: dict[str, Any] = {
            "name": opening.name,
            "between": [opening.cavity, opening.beyond or "outside"],
            "source": opening.plane.source,
            "centre_mm": [round(float(x), 3) for x in opening.plane.point],
            "normal": [round(float(x), 4) for x in opening.plane.normal],
            "opening_radius_mm": round(opening.radius, 3),
        }
        if ends is None:
            line = f"the {opening.name} opening near {spot(opening.plane.point)} is not cut: {_BLOCKED}"
            if opening.plane.source == "given":
                raise InputError(line)
            logger.warning(line)
            record["left_closed"] = line
        else:
            record |= {"radius_mm": round(radius, 3), "length_mm": round(ends[1] - ends[0], 3)}
            holes.append((opening.name, _prism(opening.plane, radius, ends)))
        record = noted(record, _notice(opening, radius, ends is not None))
        records.append(record)
    opened = drill(wall, holes) if holes else wall
    return replace(opened, info={**wall.info, "openings": records})


def _notice(opening: Opening, radius: float, cut: bool) -> Notice:
    """What was made of an opening, and how it differs from the labels'."""
    what = (
        f"the {opening.name} opening between {opening.cavity} and {opening.beyond or 'the outside'} near {{place}} is"
    )
    place = opening.plane.point
    if not cut:
        return Notice.of("left out", f"{what} left closed: {_BLOCKED}", place=place)
    words = f"{what} cut as a round hole with a radius of {{amount}}"
    if opening.plane.source == "labels":
        words += f", in the labels {opening.radius:.1f} mm"
    return Notice.of("assumed", words, amount=radius, unit="mm", place=place)


def _fit(opening: Opening, sheets: Mapping[str, ClosestFinder]) -> tuple[float, tuple[float, float] | None]:
    """Radius of the hole and where along the normal it begins and ends, mm; None where no hole fits."""
    inner, outer = sheets[f"endo_{opening.cavity}"], sheets["epi"]
    target = None if opening.beyond is None else sheets[f"endo_{opening.beyond}"]
    others = [finder for name, finder in sheets.items() if name.startswith("endo_") and finder not in (inner, target)]
    radius = _INNER * opening.radius
    frame = plane_frame(opening.plane)
    turn = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    sine, cosine = sine_cosine(turn)
    ring = cosine[:, None] * frame[0] + sine[:, None] * frame[1]
    steps = np.arange(-_REACH, _REACH + _STEP, _STEP)
    for _ in range(_TRIES):
        disc = opening.plane.point + np.concatenate([np.zeros((1, 3)), 0.5 * radius * ring, radius * ring])
        lines = disc[:, None] + steps[:, None] * opening.plane.normal
        shape, flat = lines.shape[:2], lines.reshape(-1, 3)
        within = inner.signed(flat).reshape(shape) < -_BEYOND
        there = (outer.signed(flat) > _BEYOND if target is None else target.signed(flat) < -_BEYOND).reshape(shape)
        clear = np.all([finder.signed(flat) > _CLEAR for finder in others], axis=0).reshape(shape)
        if target is not None:
            clear &= outer.signed(flat).reshape(shape) < -_CLEAR
        ends = _ends(within.all(axis=0), there.all(axis=0), clear.all(axis=0), steps)
        if ends is not None:
            return radius, ends
        radius *= _SHRINK
    return radius, None


def _ends(within: Any, there: Any, clear: Any, steps: FloatArray) -> tuple[float, float] | None:
    """The shortest way from steps at which the whole disc is in the cavity to such at which all of it is beyond."""
    best = None
    for start in np.flatnonzero(within):
        beyond = np.flatnonzero(there & (np.arange(len(steps)) > start))
        if len(beyond) and clear[start : beyond[0] + 1].all():
            length = steps[beyond[0]] - steps[start]
            if best is None or length < best[1] - best[0]:
                best = (float(steps[start]), float(steps[beyond[0]]))
    return best


def _prism(plane: Plane, radius: float, ends: tuple[float, float]) -> FloatArray:
    """Corners ``(2, n, 3)`` of a prism about the normal of a plane: those of its begin, then those of its end."""
    count = max(12, int(np.ceil(2.0 * np.pi * radius / 2.5)))
    frame = plane_frame(plane)
    turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    sine, cosine = sine_cosine(turn)
    ring = plane.point + radius * (cosine[:, None] * frame[0] + sine[:, None] * frame[1])
    return np.stack([ring + end * plane.normal for end in ends])
