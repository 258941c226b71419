"""Planes with contours at some of their frames in, the frame of each plane at one phase of the heartbeat out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from femprep.errors import InputError, OptionError
from femprep.model import Notice

#: Farthest that the frame of a plane may lie from the phase, of the heartbeat.
_NEAR: Final = 0.05


class Frames(NamedTuple):
    """How a plane was imaged over the heartbeat.

    Attributes
    ----------
    plane : str
        Name of the plane.
    number : int
        Number of its frames.
    drawn : collection of int
        Frames that hold contours, from 0.
    """

    plane: str
    number: int
    drawn: Collection[int]


def frames_at(path: Path, planes: Sequence[Frames], phase: int | None) -> tuple[dict[str, int], list[Notice]]:
    """The frame of each plane at a phase; planes without contours there are left out.

    Phases are the frames that most planes have. A plane of another number of frames shows the phase at the same
    fraction of the heartbeat; a still image beside planes of several frames shows another heartbeat.

    Raises
    ------
    InputError
        No plane holds contours.
    OptionError
        Several phases hold contours and none was chosen, or not that one.
    """
    drawn = [plane for plane in planes if plane.drawn]
    if not drawn:
        raise InputError(f"{path}: holds no contours that femprep uses")
    count = Counter(plane.number for plane in drawn).most_common(1)[0][0]
    there = sorted({frame for plane in drawn if plane.number == count for frame in plane.drawn})
    shown = ", ".join(map(str, there))
    if phase is None and len(there) > 1:
        raise OptionError(f"{path}: holds contours of phases {shown}; choose one with phase")
    if phase is not None and phase not in there:
        raise OptionError(f"{path}: holds no contours of phase {phase}; phases there: {shown}")
    at = there[0] if phase is None else phase
    found: dict[str, int] = {}
    moved, missing = [], []
    for plane in drawn:
        away = {frame: abs((frame / plane.number - at / count + 0.5) % 1.0 - 0.5) for frame in plane.drawn}
        nearest = min(away, key=lambda frame: away[frame])
        if plane.number == count:
            nearest = at if at in plane.drawn else -1
        if nearest < 0 or away[nearest] > _NEAR or (plane.number == 1) != (count == 1):
            missing.append(plane.plane)
            continue
        found[plane.plane] = nearest
        if plane.number != count and away[nearest] > 0.5 / plane.number:
            moved.append(f"{plane.plane} (frame {nearest} of {plane.number})")
    notices = []
    if moved:
        words = f"{path.name}: contours of a neighbouring frame were taken on {', '.join(moved)}"
        notices.append(Notice.of("assumed", words))
    if missing:
        words = f"{path.name}: planes without contours at phase {at} were left out: {', '.join(missing)}"
        notices.append(Notice.of("left out", words))
    return found, notices


def unused(path: Path, names: Mapping[str, int]) -> list[Notice]:
    """The notice of a file's contours that femprep has no use for: how many, by name."""
    shown = ", ".join(f"{number} {name}" for name, number in names.items())
    return [Notice.of("left out", f"{path.name}: contours of other kinds were left out: {shown}")] if names else []
