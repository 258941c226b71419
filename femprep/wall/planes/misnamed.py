"""A label map in; an error that tells which numbers its structures should have, where no ring is found under theirs.

A cavity lies in a ring of its wall. Where what is called so nowhere does, another pair of structures may.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import permutations
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.image import Segmentation
from femprep.image.topology import used_box
from femprep.options import likely_preset
from femprep.wall.planes.stack import open_share

#: Share of the slices with a cavity from which rings around it are no chance. Of the 200 maps of ACDC none is refused
#: as it is, and all are under each of three exchanges of numbers (cavity and wall, both ventricles, all three), with
#: the right ones told.
_MOST: Final = 0.5


def require_order(seg: Segmentation) -> None:
    """Refuse structures with swapped numbers.

    Raises
    ------
    InputError
    """
    own = {name: seg.structures[name] for name in ("lv", "myo", "rv") if name in seg.structures}
    known = {"lv", "myo"} <= set(own) and set(own["lv"] + own["myo"]) <= set(seg.present)
    if known and not _rings(seg, own["lv"], own["myo"])[0] and (told := _swapped(seg, own)):
        raise InputError(told + likely_preset(seg.present))


def _swapped(seg: Segmentation, own: Mapping[str, tuple[int, ...]]) -> str:
    """Which structures have one another's numbers; nothing where the labels do not tell."""
    for cavity, wall in permutations(own, 2):
        rings, slices = _rings(seg, own[cavity], own[wall])
        if rings > _MOST * slices:
            order = [cavity, wall, *(name for name in own if name not in (cavity, wall))]
            names = {name: own[other] for name, other in zip(("lv", "myo", "rv"), order) if name != other}
            given = " ".join(f"--structure {name}={_listed(numbers)}" for name, numbers in names.items())
            return (
                f"{cavity!r} lies in a ring of {wall!r} in {rings} of {slices} slices, and 'lv' in one of 'myo' in "
                f"none: their numbers, segments or files seem to be swapped; of numbers give {given}"
            )
    return ""


def _rings(seg: Segmentation, cavity: Sequence[int], wall: Sequence[int]) -> tuple[int, int]:
    """Number of slices in which a cavity lies in a closed ring of wall, and of slices with cavity."""
    inside = np.isin(seg.labels, cavity)
    if not inside.any():
        return 0, 0
    box = tuple(slice(max(part.start - 1, 0), part.stop + 1) for part in used_box(inside))
    one, both = (np.moveaxis(mask[box], seg.stack_axis, 0) for mask in (inside, inside | np.isin(seg.labels, wall)))
    shares = [open_share(a, b) for a, b in zip(one, both) if a.any()]
    return shares.count(0.0), len(shares)


def _listed(numbers: Sequence[int]) -> str:
    return ",".join(map(str, numbers))
