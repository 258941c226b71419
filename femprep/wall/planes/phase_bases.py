"""Phases of one heart in, a base offset for each out: all phases are cut where the same share of the cavity is left.

The base moves with the heartbeat, and which of the basal slices still show a closed ring of myocardium changes with it:
a cut at each phase's own last ring would leave out a slice of cavity in one phase and none in the next. Volumes of
such cavities cannot be compared, and nodes of the rims do not correspond.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from femprep.errors import InputError
from femprep.model import FloatArray, Notice
from femprep.options import WallOptions, choose, takes
from femprep.wall.planes.base_slice import base_slice
from femprep.wall.planes.oblique import look_across
from femprep.wall.planes.round_off import LEFT, inward_of_end
from femprep.wall.planes.stack import read_stack

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation

_log = logging.getLogger(__name__)


@takes(WallOptions)
def phase_base_offsets(
    phases: Sequence[Segmentation], *, options: WallOptions | None = None, **changes: Any
) -> list[float]:
    """Offsets of the base planes of the phases of one heart, so that they leave out equal shares of the cavity.

    The share is the greatest that the own base plane of one phase (:func:`~femprep.wall.find_base`) leaves out, so that
    no plane moves away from the apex, into slices without a closed ring.

    Parameters
    ----------
    phases : sequence of Segmentation
        Label maps with the structures ``lv`` and ``myo``.
    options, **changes
        :class:`~femprep.options.WallOptions`; ``basal_end`` and ``base_offset`` matter here.

    Returns
    -------
    list of float
        ``base_offset`` of each phase, mm, at least the one in the options.

    Raises
    ------
    InputError
        There are no phases; else as :func:`~femprep.wall.find_base`.

    Examples
    --------
    >>> [round(offset, 6) for offset in fp.phase_base_offsets([seg, seg])]
    [0.0, 0.0]
    """
    chosen = choose(WallOptions, options, changes)
    if not len(phases):
        raise InputError("there are no phases; give the label map of each")
    profiles = [_profile(seg, chosen) for seg in phases]
    share = max(float(np.interp(chosen.base_offset, *profile)) for profile in profiles)
    offsets = [max(float(np.interp(share, beyond, depth)), chosen.base_offset) for depth, beyond in profiles]
    for number, offset in enumerate(offsets):
        if offset > chosen.base_offset:
            _log.info("base of phase %d moved %.1f mm towards the apex, as that of the other phases", number, offset)
    return offsets


def base_moved_with_phases(distance: float) -> list[Notice]:
    """That the base plane of a phase lies farther towards the apex than its labels alone put it, by so many mm."""
    if distance <= 0.0:
        return []
    words = (
        "the base plane was moved by {amount} towards the apex, so that it leaves out the same share of the cavity as "
        "those of the other phases"
    )
    return [Notice.of("moved", words, amount=distance, unit="mm")]


def _profile(seg: Segmentation, options: WallOptions) -> tuple[FloatArray, FloatArray]:
    """Depths below the own base plane, mm, and the share of the cavity's voxels beyond each, ascending."""
    view = look_across(seg, options.basal_end)
    seg, stack = view.seg, read_stack(view.seg, basal_end=view.basal_end, what="the base")
    slice_ = base_slice(seg, stack).number
    area = stack.cavity[:: -stack.basal].astype(float)
    base = len(area) - 1 - slice_ if stack.basal > 0 else slice_
    held = np.flatnonzero(area)
    area = area[held[0] : held[-1] + 1]
    depth = (held[0] - 0.5 - base + np.arange(len(area) + 1)) * float(seg.grid.spacing[stack.axis])
    depth -= inward_of_end(seg, stack, slice_, LEFT)
    return depth, np.concatenate([[0.0], np.cumsum(area)]) / area.sum()
