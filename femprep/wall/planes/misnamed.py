"""A label map in; an error that tells which numbers its structures should have, where no ring is found under theirs.

A cavity lies in a ring of its wall. Where what is called so nowhere does, another pair of structures may, or a label
that none of them names, as of scar, may close the ring.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import permutations
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.image import Segmentation
from femprep.image.topology import used_box
from femprep.wall.planes.stack import open_share

#: Share of the slices with a cavity from which rings around it are no chance. Of the 200 maps of ACDC none is refused
#: as it is, and all are under each of three exchanges of numbers (cavity and wall, both ventricles, all three), with
#: the right ones told.
_MOST: Final = 0.5


@contextmanager
def numbers_told(seg: Segmentation) -> Iterator[None]:
    """Around what looks for a base: structures under one another's numbers are refused, a label that no one names told.

    Parameters
    ----------
    seg : Segmentation

    Raises
    ------
    InputError
    """
    own = {name: seg.structures[name] for name in ("lv", "myo", "rv") if name in seg.structures}
    known = {"lv", "myo"} <= set(own) and set(own["lv"] + own["myo"]) <= set(seg.present)
    if not known or _rings(seg, own["lv"], own["myo"])[0]:
        yield
        return
    if told := _swapped(seg, own):
        raise InputError(told)
    try:
        yield
    except InputError:
        if told := _left_out(seg, own):
            raise InputError(told) from None
        raise


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


def _left_out(seg: Segmentation, own: Mapping[str, tuple[int, ...]]) -> str:
    """Which label that no structure names closes the ring; nothing where none does."""
    named = {number for numbers in seg.structures.values() for number in numbers}
    for number in (one for one in seg.present if one not in named):
        wall = (*own["myo"], number)
        rings, slices = _rings(seg, own["lv"], wall)
        if rings > _MOST * slices:
            name = seg.info.get("segments", {}).get(str(number))
            label = f"label {number}" if name is None else f"segment {name!r}"
            return (
                f"'myo' closes around 'lv' in no slice; with {label}, which no structure names, it does in {rings} of "
                f"{slices}: if that is myocardium, as scar is, add it to myo (of numbers: --structure "
                f"myo={_listed(wall)})"
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
