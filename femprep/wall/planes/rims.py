"""Rims of open surfaces in, the base plane that opens all of them out; what is wrong with a rim, where."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.mesh.plane_sections import plane_sections
from femprep.mesh.topology import border_loops
from femprep.model import FloatArray, Notice, Plane, Surface
from femprep.model.notice import spot
from femprep.options.advice import GIVE_BASE

#: Rims whose corners lie this near to one plane lie in it, mm: surfaces are continued beyond them by as much.
_FLAT: Final = 0.3
#: Most of the heart's length that may be cut away where rims lie in no plane: where all rims are taken for the base's,
#: as those of several valves, and where the longest of each surface are alone.
_ALL_DEEP: Final = 0.12
_DEEP: Final = 0.3
#: So far below the base a rim may lie, mm.
_BELOW: Final = 0.5
#: Steps in which a plane that cuts a surface twice is lowered, mm.
_STEP: Final = 1.0


def rims_of(surface: Surface) -> list[FloatArray]:
    """Corners of each rim ``(k, 3)``, the longest rim first."""
    rims = [surface.points[loop] for loop in border_loops(surface.triangles)]
    return sorted(rims, key=lambda rim: -_lengths(rim).sum())


def base_of_rims(surfaces: Mapping[str, Surface]) -> Plane | None:
    """The plane that the rims of open surfaces lie in, or that opens all of them; None where all are closed.

    Parameters
    ----------
    surfaces : mapping of str to Surface
        By name, mm.

    Returns
    -------
    Plane
        Its normal leads out of the heart.

    Raises
    ------
    InputError
        The rims lie too far from any one plane, or one of them is a hole below it.
    """
    rims = {name: rims_of(surface) for name, surface in surfaces.items()}
    if not any(rims.values()):
        return None
    middle = np.mean([surface.points.mean(axis=0) for surface in surfaces.values()], axis=0)
    everything = [rim for own in rims.values() for rim in own]
    plane, off, depth = _through(everything, middle, surfaces)
    if depth > _ALL_DEEP:
        # A hole in the side is no part of the base: the longest rims alone may lie in a plane.
        plane, off, depth = _through([own[0] for own in rims.values() if own], middle, surfaces)
        if depth > _DEEP:
            at = spot(plane.point)
            _require_two_sides(rims, middle, surfaces)
            raise InputError(
                f"the rims of {', '.join(rims)} lie up to {off:.1f} mm below the plane through them, about {at}: "
                f"cutting there would take {100 * depth:.0f} % of the heart's length",
                advice=[GIVE_BASE],
            )
    _hold_no_holes(rims, plane)
    return _in_one_loop(surfaces, plane)


def _require_two_sides(
    rims: Mapping[str, list[FloatArray]], middle: FloatArray, surfaces: Mapping[str, Surface]
) -> None:
    """Refuse a surface whose rim runs far below the base that all other rims agree on: one of its sides is missing."""
    for name, own in rims.items():
        others = [other[0] for one, other in rims.items() if one != name and other]
        if not own or not others:
            continue
        plane, _, depth = _through(others, middle, surfaces)
        below = -plane.signed_distance(own[0])
        if depth <= _DEEP and below.max() > _DEEP * np.ptp(surfaces[name].points @ plane.normal):
            side = "the septum: its left side" if name == "rv" else "one side, which"
            raise InputError(
                f"surface {name!r} is open along {side} is missing: its rim runs to {below.max():.1f} mm below the "
                f"base of the others, at {spot(own[0][int(below.argmax())])}; give the surface all around"
            )


def _in_one_loop(surfaces: Mapping[str, Surface], plane: Plane) -> Plane:
    """The plane lowered to where it cuts each surface in one loop, as a right ventricle below both of its valves."""
    length = max(float(np.ptp(surface.points @ plane.normal)) for surface in surfaces.values())
    for low in np.arange(0.0, _DEEP * length, _STEP):
        # A rim in the plane itself is one loop; a section there would be none.
        lowered = Plane(plane.point - (low + _FLAT) * plane.normal, plane.normal)
        if all(len(plane_sections(s.points, s.triangles, [lowered])[0]) == 1 for s in surfaces.values()):
            break
    else:
        names = ", ".join(surfaces)
        raise InputError(f"no plane below the rims of {names} cuts each of them in one loop", advice=[GIVE_BASE])
    if not low:
        return plane
    words = "the base was lowered by {amount}, to where it cuts each surface in one loop"
    notice = Notice.of("moved", words, amount=low, unit="mm", place=plane.point)
    return Plane(plane.point - low * plane.normal, plane.normal, plane.source, (*plane.notices, notice))


def require_rims_above(surfaces: Mapping[str, Surface], base: Plane) -> None:
    """Refuse surfaces that end below a base plane that was given.

    Raises
    ------
    InputError
    """
    _hold_no_holes({name: rims_of(surface) for name, surface in surfaces.items()}, base)


def _through(rims: list[FloatArray], middle: FloatArray, surfaces: Mapping[str, Surface]) -> tuple[Plane, float, float]:
    """The plane that best fits rims, lowered to where it opens all; how far they lie below it before, mm; and the share
    of the heart's length that is cut off."""
    weight = np.concatenate([_lengths(rim) for rim in rims])
    points = np.concatenate(rims)
    centre = np.average(points, axis=0, weights=weight)
    normal = np.linalg.svd((points - centre) * np.sqrt(weight)[:, None], full_matrices=False)[2][2]
    normal = normal if normal @ (centre - middle) > 0.0 else -normal
    away = (points - centre) @ normal
    length = max(float(np.ptp(surface.points @ normal)) for surface in surfaces.values())
    if np.abs(away).max() <= _FLAT:
        return Plane(centre, normal, "rims of the surfaces"), 0.0, 0.0
    off = -float(away.min())
    lowest = points[int(away.argmin())]
    words = (
        "the rims of the surfaces lie in no plane: the base lies {amount} below their middle, where it opens all of "
        "them, at the lowest rim"
    )
    notice = Notice.of("moved", words, amount=off, unit="mm", place=lowest)
    return Plane(centre - off * normal, normal, "below the rims of the surfaces", (notice,)), off, off / length


def _hold_no_holes(rims: Mapping[str, list[FloatArray]], base: Plane) -> None:
    for name, own in rims.items():
        for rim in own:
            away = base.signed_distance(rim)
            if away.min() < -_BELOW:
                at = rim[int(away.argmin())]
                wide = float(np.linalg.norm(np.ptp(rim, axis=0)))
                raise InputError(
                    f"surface {name!r} has a hole {wide:.1f} mm wide whose rim lies {-away.min():.1f} mm below the "
                    f"base plane at {spot(at)}",
                    advice=["fill the hole", GIVE_BASE],
                )


def _lengths(rim: FloatArray) -> FloatArray:
    """Length that each corner of a rim stands for, mm."""
    edge = np.linalg.norm(np.roll(rim, -1, axis=0) - rim, axis=1)
    return np.asarray(0.5 * (edge + np.roll(edge, 1)))
