"""Contours of planes at some of their frames in, the contours of one phase of the heartbeat out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from femprep.errors import InputError, OptionError
from femprep.image.contours import Contour, ContourPlane, Contours
from femprep.model import Notice

#: Farthest that the frame of a plane may lie from the phase, of the heartbeat.
_NEAR: Final = 0.05


class DrawnPlane(NamedTuple):
    """A plane that was imaged over the heartbeat.

    Attributes
    ----------
    plane : ContourPlane
    frames : int
        Number of its images.
    drawn : dict of int to list of Contour
        Contours of the frames that have some, from 0.
    """

    plane: ContourPlane
    frames: int
    drawn: dict[int, list[Contour]]


def contours_at(path: Path, planes: Sequence[DrawnPlane], phase: int | None, notices: Sequence[Notice]) -> Contours:
    """The contours of a phase; planes without contours there are left out.

    Phases are the frames that most planes have. A plane of another number of frames shows the phase at the same
    fraction of the heartbeat; a still image beside planes of several frames shows another heartbeat.

    Raises
    ------
    InputError
        No plane holds contours.
    OptionError
        Several phases hold contours and none was chosen, or not that one.
    """
    if not planes:
        raise InputError(f"{path}: holds no contours that femprep uses")
    frames = Counter(plane.frames for plane in planes).most_common(1)[0][0]
    there = sorted({frame for plane in planes if plane.frames == frames for frame in plane.drawn})
    shown = ", ".join(map(str, there))
    if phase is None and len(there) > 1:
        choice = f"choose one, as in phase={there[0]} (in Python) or --frame {there[0] + 1}"
        raise OptionError(f"{path}: holds contours of phases {shown}, counted from 0; {choice}")
    if phase is not None and phase not in there:
        raise OptionError(f"{path}: holds no contours of phase {phase}; phases there, counted from 0: {shown}")
    at = there[0] if phase is None else phase
    kept, contours, moved, missing = [], [], [], []
    for plane, number, drawn in planes:
        away = {frame: abs((frame / number - at / frames + 0.5) % 1.0 - 0.5) for frame in drawn}
        nearest = min(away, key=lambda frame: away[frame])
        near = nearest == at if number == frames else away[nearest] <= _NEAR and 1 not in (number, frames)
        if not near:
            missing.append(plane.name)
            continue
        kept.append(plane)
        contours += drawn[nearest]
        if away[nearest] > 0.5 / number:
            moved.append(f"{plane.name} (frame {nearest} of {number})")
    more = list(notices)
    if moved:
        words = f"{path.name}: contours of a neighbouring frame were taken on {', '.join(moved)}"
        more.append(Notice.of("assumed", words))
    if missing:
        words = f"{path.name}: planes without contours at phase {at} were left out: {', '.join(missing)}"
        more.append(Notice.of("left out", words))
    return Contours(tuple(kept), tuple(contours), str(path), tuple(more))


def unused(path: Path, names: Mapping[str, int]) -> list[Notice]:
    """The notice of a file's contours that femprep has no use for: how many, by name."""
    shown = ", ".join(f"{number} {name}" for name, number in names.items())
    return [Notice.of("left out", f"{path.name}: contours of other kinds were left out: {shown}")] if names else []
