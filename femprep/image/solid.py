"""Padded mask of an object in, one solid body out, with what was left out and filled: tips, pieces, voids, tunnels."""

from __future__ import annotations

import logging
from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.image.grid import Grid
from femprep.image.pieces import listed, middle, require_one_body
from femprep.image.tips import thin_tips
from femprep.image.topology import euler_characteristic, label_pieces, label_voids
from femprep.model import BoolArray, Notice
from femprep.model.notice import Kind

log = logging.getLogger(__name__)

#: Empty voxels on each side of an object's mask.
PADDING: Final = 2
#: Voxels this many times as long as the shortest ones are those of thick slices.
_THICK: Final = 2.0


class Where(NamedTuple):
    """Whose voxels a padded mask holds, and where its first unpadded one lies in the image."""

    name: str
    grid: Grid
    first: tuple[int, int, int]

    def changed(self, kind: Kind, words: str, mask: BoolArray) -> Notice:
        """What was done to the voxels of a padded mask, at the one in the middle of all of them."""
        place = middle(mask, self.grid, np.array(self.first) - PADDING)
        text = f"object {self.name}: {words}, {{amount}}"
        return Notice.of(kind, text, amount=np.count_nonzero(mask), unit="voxels", place=place)


#: A mask after a step, what the object's report has of the step, and its notices.
Step = tuple[BoolArray, dict[str, Any], list[Notice]]

_NO_TIPS: Final = {"tips": 0, "tip_voxels": 0}


def without_tips(solid: BoolArray, where: Where, strict: bool) -> Step:
    """Tips one pixel wide are left out of thick slices; not where the policy is strict."""
    spacing, axis = where.grid.spacing, where.grid.stack_axis
    if strict or spacing[axis] < _THICK * spacing.min():
        return solid, _NO_TIPS, []
    tips, number = thin_tips(solid, axis)
    if not number:
        return solid, _NO_TIPS, []
    some = "a tip one pixel wide was" if number == 1 else f"{number} tips one pixel wide were"
    notice = where.changed("left out", f"{some} left out", tips)
    log.warning("%s", notice.what)
    return solid & ~tips, {"tips": number, "tip_voxels": int(np.count_nonzero(tips))}, [notice]


def largest_piece(solid: BoolArray, where: Where, strict: bool) -> Step:
    """The largest piece is kept; refused where others are large, or where there are any and the policy is strict."""
    pieces, sizes = label_pieces(solid)
    report = {"pieces": len(sizes), "piece_voxels": [int(n) for n in sizes]}
    if len(sizes) < 2:
        return solid, report, []
    if strict:
        raise InputError(
            f"object {where.name!r} is in {len(sizes)} pieces of {listed(sizes)} voxels; "
            "mend the labels or use policy 'repair', which keeps the largest"
        )
    require_one_body(pieces, sizes, where.grid, np.array(where.first) - PADDING, where.name)
    largest = pieces == 1
    some = "a smaller piece was" if len(sizes) == 2 else f"{len(sizes) - 1} smaller pieces were"
    words = "object %r: kept the largest of %d pieces, %d of %d voxels"
    log.warning(words, where.name, len(sizes), sizes[0], sum(sizes))
    return largest, report, [where.changed("left out", f"{some} left out", solid & ~largest)]


def filled(solid: BoolArray, where: Where, strict: bool, labels: npt.NDArray[np.integer[Any]] | None) -> Step:
    """Voids are filled, and which labels lay in them is told; refused where the policy is strict."""
    voids, sizes = label_voids(solid)
    report = {"voids": len(sizes), "filled_voxels": int(sizes.sum()), "filled_labels": dict[str, int]()}
    if not len(sizes):
        return solid, report, []
    if strict:
        raise InputError(
            f"object {where.name!r} has {len(sizes)} voids of {listed(sizes)} voxels; "
            "mend the labels or use policy 'repair', which fills them"
        )
    inside = voids > 0
    if labels is not None:
        inner = tuple(slice(PADDING, n - PADDING) for n in solid.shape)
        numbers, counts = np.unique(labels[inside[inner]], return_counts=True)
        report["filled_labels"] = {str(int(n)): int(c) for n, c in zip(numbers, counts)}
    some = "a void was" if len(sizes) == 1 else f"{len(sizes)} voids were"
    notice = where.changed("repaired", f"{some} filled", inside)
    log.warning("%s", notice.what)
    return solid | inside, report, [notice]


def tunnels_of(solid: BoolArray, name: str, strict: bool) -> tuple[int, list[Notice]]:
    """Number of tunnels, which are told and not mended; refused where the policy is strict."""
    tunnels = 1 - euler_characteristic(solid)
    if not tunnels:
        return 0, []
    holes = "a tunnel" if tunnels == 1 else f"{tunnels} tunnels"
    if strict:
        raise InputError(
            f"object {name!r} has {holes}, so that it is not a ball; mend the labels or use policy 'repair', "
            "which fits a surface across them"
        )
    log.warning("object %r has %s: it is not a ball, its surface will bridge over", name, holes)
    return tunnels, [Notice.of("repaired", f"object {name} has {holes}; its surface, a mapped sphere, has none")]


def cut_off(mask: BoolArray, grid: Grid, name: str) -> list[Notice]:
    """Whether an object ends at the border of its image: there its surface is closed, and the object may go on.

    Across thick slices nothing is said: there it is closed at the last one in any case, or cut by a plane.
    """
    found = []
    for axis in range(3):
        if grid.spacing[axis] >= _THICK * grid.spacing.min():
            continue
        for end in (0, mask.shape[axis] - 1):
            side = np.moveaxis(mask, axis, 0)[end]
            if not side.any():
                continue
            index = np.insert(np.argwhere(side).mean(axis=0), axis, end)
            found.append(
                Notice.of(
                    "assumed",
                    f"object {name} reaches the border of the image near {{place}}, with {{amount}} there: its "
                    "surface was closed there, as if it ended",
                    amount=np.count_nonzero(side),
                    unit="voxels",
                    place=grid.to_world(index),
                )
            )
    return found
