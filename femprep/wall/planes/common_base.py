"""Segmentation of both ventricles in, one base Plane that opens both cavities out."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from scipy.ndimage import distance_transform_edt, label

from femprep.errors import InputError
from femprep.model import BoolArray, FloatArray, Notice, Plane
from femprep.options import WallOptions, choose, takes
from femprep.options.run import LEFT_ALONE
from femprep.wall.planes.base_slice import base_moved, base_notices, base_slice
from femprep.wall.planes.landmarks import centre, given_base, slice_plane
from femprep.wall.planes.oblique import look_across
from femprep.wall.planes.round_off import LEFT, inward_note, inward_of_end, round_off_notices
from femprep.wall.planes.stack import Stack, open_share, read_stack

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation

logger = logging.getLogger(__name__)

#: A slice opens the right ventricle where its surface rises from there to the next slice towards the apex by this angle
#: at least everywhere, degrees: flatter, it is a lid, and a plane through that leaves a wedge no mesh fills well (of
#: 200 ACDC maps three by 7 and 8 degrees failed for it; of eight by 15 to 18 seven passed).
_LID: Final = 15.0
#: And where its largest piece is at least this share of the cavity there.
_WHOLE: Final = 0.85


@takes(WallOptions)
def find_common_base(seg: Segmentation, *, options: WallOptions | None = None, **changes: Any) -> Plane:
    """Base plane that cuts both ventricles open.

    It is the base plane of the left ventricle (:func:`~femprep.wall.find_base`) where the right ventricle reaches it.
    Where the labels of the right ventricle end earlier, widen from there so fast that they end in a lid, or fall into
    pieces (inflow and outflow), the plane moves towards the apex, slice by slice, to the first one in which both
    cavities are open; ``source`` says so. (A run gives each ventricle its own base instead.)
    Where its wall is labelled, that has to close around it as well, if it does
    in any of these slices: beside the tricuspid valve its cavity opens into the atrium. A right ventricle that reaches
    further than the plane is cut there.

    Parameters
    ----------
    seg : Segmentation
        Label map with the structures ``lv``, ``myo`` and ``rv``.
    options, **changes
        :class:`~femprep.options.WallOptions`; ``base``, ``basal_end`` and ``base_offset`` matter here.

    Returns
    -------
    Plane
        Its normal points away from the apex.

    Raises
    ------
    InputError
        As :func:`~femprep.wall.find_base`; also where no slice of the basal half opens both cavities.

    Examples
    --------
    >>> from femprep.phantoms import biventricular
    >>> fp.find_common_base(biventricular().segmentation(spacing=(2.0, 2.0, 8.0))).source
    'labels: ...'
    """
    chosen = choose(WallOptions, options, changes)
    if chosen.base is not None:
        return given_base(seg, chosen, below=("tricuspid",))
    view = look_across(seg, chosen.basal_end)
    seg, stack = view.seg, read_stack(view.seg, basal_end=view.basal_end, what="the base")
    base = base_slice(seg, stack)
    start, note, notices = base.number, base.note, view.notices + base_notices(seg, stack, base)
    first, last = stack.ring
    allowed = max((last - first + 1) // 2, 1)
    right = np.moveaxis(seg.mask("rv"), stack.axis, 0)
    opened = _opened(right, range(start, start - allowed * stack.basal, -stack.basal), seg.grid.spacing, stack)
    if not opened:
        raise InputError(
            f"no slice from {start} on, within {allowed} of the base of the left ventricle, opens the cavity of the "
            "right ventricle as well",
            advice=["check its labels", LEFT_ALONE],
        )
    walled = _walled(seg, right, stack, opened)
    slice_ = (walled or opened)[0]
    if slice_ != start:
        where = "where the wall closes around the right ventricle" if walled else "where the right ventricle is open"
        steps = abs(slice_ - start)
        note += f"; {steps} slice(s) below the left ventricle's base, {where}"
        logger.warning("base plane moved %d slice(s) towards the apex, %s", steps, where)
        notices += (base_moved(seg, stack, start, slice_, f"{where} as well"),)
    inward = inward_of_end(seg, stack, slice_, (*LEFT, ("rv",)))
    source = f"labels: {view.words or centre(stack, slice_)}{note}{inward_note(inward)}"
    offset = chosen.base_offset + inward
    return slice_plane(seg, stack, slice_, stack.basal, offset, source, notices + round_off_notices(inward))


def separate_bases(seg: Segmentation, options: WallOptions) -> tuple[Segmentation, Plane | None]:
    """Base plane of the right ventricle where its labels end nearer to the apex than the left ventricle's base.

    Parameters
    ----------
    seg : Segmentation
        Label map with the structures ``lv``, ``myo`` and ``rv``.
    options : WallOptions

    Returns
    -------
    right : Segmentation
        Labels to fit the right ventricle to: its last open slice is repeated on unlabelled voxels up to two slices
        beyond the left ventricle's base, so that its surface passes through both bases at a steep angle.
    plane : Plane or None
        None where the right ventricle reaches the left one's base, a base is given, or the labels are no short-axis
        stack.
    """
    if options.base is not None or look_across(seg, options.basal_end).seg is not seg:
        return seg, None
    stack = read_stack(seg, basal_end=options.basal_end, what="the base")
    start = base_slice(seg, stack).number
    right = np.moveaxis(seg.mask("rv"), stack.axis, 0)
    first, last = stack.ring
    below = range(start, start - max((last - first + 1) // 2, 1) * stack.basal, -stack.basal)
    opened = _opened(right, below, seg.grid.spacing, stack)
    number = (_walled(seg, right, stack, opened) or opened or [start])[0]
    if number == start:
        return seg, None
    room = 2
    padding = [(room, room) if axis == stack.axis else (0, 0) for axis in range(3)]
    padded = np.pad(seg.labels, padding)
    labels = np.moveaxis(padded, stack.axis, 0)
    own = [label for name in ("rv", "rv_wall") for label in seg.structures.get(name, ())]
    named = [label for group in seg.structures.values() for label in group]
    last = labels[number + room]
    for k in range(number + stack.basal, start + (room + 1) * stack.basal, stack.basal):
        free = np.isin(last, own) & ~np.isin(labels[k + room], named)
        labels[k + room][free] = last[free]
    i, j, k = (-low for low, _ in padding)
    grid = seg.grid.window((i, j, k), padded.shape)
    words = "the base of the right ventricle lies {amount} nearer to the apex than the left one's, where its labels end"
    notice = Notice.of("assumed", words, amount=abs(start - number) * float(seg.grid.spacing[stack.axis]), unit="mm")
    plane = slice_plane(
        seg, stack, number, stack.basal, options.base_offset, f"labels: {centre(stack, number)}", (notice,)
    )
    return replace(seg, labels=padded, grid=grid), plane


def _opened(right: BoolArray, slices: range, spacing: FloatArray, stack: Stack) -> list[int]:
    """The slices in which a cavity is open: in one piece, and none of them a lid of it."""
    found = []
    for number in slices:
        below = number - stack.basal
        if not 0 <= below < len(right):
            break
        pieces = np.bincount(label(right[number], np.ones((3, 3)))[0].ravel())[1:]
        if not len(pieces) or pieces.max() < _WHOLE * pieces.sum():
            continue
        away = distance_transform_edt(~right[number], sampling=np.delete(spacing, stack.axis))
        rise = np.arctan2(spacing[stack.axis], np.max(away, where=right[below], initial=0.0))
        if np.degrees(rise) >= _LID:
            found.append(number)
    return found


def _walled(seg: Segmentation, right: BoolArray, stack: Stack, slices: list[int]) -> list[int]:
    """The slices in which a labelled wall closes around the right ventricle.

    None where it does in no slice: walls thinner than a voxel have holes everywhere, which then tell nothing.
    """
    if "rv_wall" not in seg.structures or not set(seg.structures["rv_wall"]) <= set(seg.present):
        return []
    body = np.moveaxis(seg.mask("rv", "rv_wall", "lv", "myo"), stack.axis, 0)
    return [number for number in slices if open_share(right[number], body[number]) == 0.0]
