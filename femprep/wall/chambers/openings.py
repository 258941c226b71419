"""Label map in, openings of its chambers out: valves and vessels, where cavities meet each other or the outside.

Fitted surfaces are closed. Where the labels of two cavities touch over an area there is no tissue between them, which
is how label maps show mitral and tricuspid valve; where a cavity is open to the outside, they touch the background.
Maps that leave the leaflets out show such a valve as two openings to the background that face each other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy.ndimage import label

from femprep.errors import InputError
from femprep.model import FloatArray, Plane
from femprep.model.notice import spot
from femprep.model.products import length

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation

#: What an opening is called, by the cavity and what lies beyond it; None is the outside.
NAMES: Final[Mapping[tuple[str, str | None], str]] = {
    ("lv", "la"): "mitral",
    ("rv", "ra"): "tricuspid",
    ("lv", None): "aortic",
    ("rv", None): "pulmonary",
    ("la", None): "veins",
    ("ra", None): "veins",
}
#: Structures outside a cavity, beside the background, that its opening leads into: cavities of vessels.
_VESSELS: Final = {"lv": "aorta", "rv": "pulmonary_artery"}
#: An opening is taken from labels where they touch over at least this area, mm2, that fills at least this share of its
#: circle and lies within this share of its radius (root mean square) of a plane.
_AREA, _FULL, _FLAT = 60.0, 0.5, 0.35
#: Slices farther apart than this, mm, do not tell an opening to the outside from a thin wall.
_THICK: Final = 3.0
#: Openings to the background face each other across a valve's leaflets where the cosine between their normals is below
#: this and their centres are nearer than this share of the smaller radius.
_FACING, _NEAR = -0.7, 0.7
#: A hole has this share of the radius of the opening.
INNER: Final = 0.85
#: How far from its plane the tissue of an opening is looked for, at which steps, mm.
REACH, STEP = 15.0, 0.25


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
        inside, other = (np.isin(labels, _numbers(seg, cavity, part)) for part in (cavity, beyond))
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


def _numbers(seg: Segmentation, cavity: str, part: str | None) -> tuple[int, ...]:
    """Labels of a structure; of the outside of a cavity those of the vessel behind its opening, too."""
    vessel = seg.structures.get(_VESSELS.get(cavity, ""), ())
    return (0, *vessel) if part is None else seg.structures.get(part, ())


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
        found.append(Opening(name, *pairs[0], plane, float(numbers[6]) / INNER))
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
    steps = np.arange(-REACH, REACH + STEP, STEP)
    for opening in openings:
        if opening.plane.source != "given":
            continue
        line = opening.plane.point + steps[:, None] * opening.plane.normal
        index = np.round(seg.grid.to_index(line)).astype(int)
        inside = np.all((index >= 0) & (index < labels.shape), axis=1)
        met = np.zeros(len(steps), dtype=labels.dtype)
        met[inside] = labels[tuple(index[inside].T)]
        within, beyond = (
            np.isin(met, _numbers(seg, opening.cavity, part)) for part in (opening.cavity, opening.beyond)
        )
        if not (within.any() and beyond[int(np.argmax(within)) :].any()):
            raise InputError(
                f"the {opening.name} opening given at {spot(opening.plane.point)} leads from no voxel of "
                f"{opening.cavity!r} to {'the outside' if opening.beyond is None else repr(opening.beyond)} within "
                f"{REACH:g} mm along its normal; give centre and normal, out of the chamber, in mm LPS"
            )
