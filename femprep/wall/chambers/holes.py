"""A closed wall and openings in, the wall with a round hole for each out."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

import numpy as np

from femprep.errors import InputError
from femprep.mesh.search.closest import ClosestFinder
from femprep.model import FACET_TAGS, FloatArray, Notice, Plane, Wall, noted, tag_name
from femprep.model.functions import sine_cosine
from femprep.model.notice import spot
from femprep.wall.chambers.openings import INNER, REACH, STEP, Opening
from femprep.wall.joining.solid import drill, plane_frame

logger = logging.getLogger(__name__)

#: A hole is made smaller by this factor, so many times, where it would meet another surface.
_SHRINK, _TRIES = 0.85, 4
#: How far a hole reaches beyond the tissue, mm.
_BEYOND: Final = 0.5
#: Least distance of a hole from surfaces it does not open, mm, and why an opening without such a hole is not cut.
_CLEAR: Final = 1.0
_BLOCKED: Final = "there is no straight way from the cavity through its wall that keeps clear of other surfaces"


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
        The wall is not a whole heart's, or an opening that was given by hand cannot be cut.

    Examples
    --------
    >>> fp.open_wall(wall, fp.find_openings(whole))  # doctest: +SKIP
    Wall(... points, ... triangles: endo_lv, ..., mitral, tricuspid, aortic, pulmonary)
    """
    finders = {}
    for name in ("endo_lv", "endo_rv", "endo_la", "endo_ra", "epi"):
        triangles = wall.triangles[wall.facet_tag == FACET_TAGS[name]]
        if not len(triangles):
            have = ", ".join(tag_name(int(tag)) for tag in np.unique(wall.facet_tag)) or "none"
            raise InputError(f"openings are cut into the wall of a whole heart; this wall has no {name}, but {have}")
        # All are turned outward: on endocardia the wall's triangles look into the cavity.
        finders[name] = ClosestFinder(wall.points, triangles if name == "epi" else triangles[:, ::-1])
    holes, records = [], []
    for opening in openings:
        radius, ends = _fit(opening, finders)
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


def _fit(opening: Opening, finders: Mapping[str, ClosestFinder]) -> tuple[float, tuple[float, float] | None]:
    """Radius of the hole and where along the normal it begins and ends, mm; None where no hole fits."""
    inner, outer = finders[f"endo_{opening.cavity}"], finders["epi"]
    target = None if opening.beyond is None else finders[f"endo_{opening.beyond}"]
    others = [finder for name, finder in finders.items() if name.startswith("endo_") and finder not in (inner, target)]
    radius = INNER * opening.radius
    ring = _ring(opening.plane, 16)
    steps = np.arange(-REACH, REACH + STEP, STEP)
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
    ring = plane.point + radius * _ring(plane, max(12, int(np.ceil(2.0 * np.pi * radius / 2.5))))
    return np.stack([ring + end * plane.normal for end in ends])


def _ring(plane: Plane, count: int) -> FloatArray:
    """Unit vectors ``(count, 3)`` all round in a plane."""
    frame = plane_frame(plane)
    sine, cosine = sine_cosine(np.linspace(0.0, 2.0 * np.pi, count, endpoint=False))
    return np.asarray(cosine[:, None] * frame[0] + sine[:, None] * frame[1])
