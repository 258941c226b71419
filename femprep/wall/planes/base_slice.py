"""Slices of the left ventricle in, the one its base is put in out; what lies beyond it and which rings are open."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from femprep.errors import Advice, InputError
from femprep.model import FloatArray, Notice
from femprep.options.advice import GIVE_BASE, MEND
from femprep.wall.planes.stack import Stack

if TYPE_CHECKING:
    from femprep.image.segmentation import Segmentation

#: The base moves one slice further in, this often at most, where its slice leaves more than this share of the cavity
#: in the next one bare: there a wall could only be guessed (4 of the 200 ACDC maps, all with shifted slices).
_STEPS_IN, _BARE = 2, 0.1
#: Share of the cavity beyond the base's slice from which on it is told, and from which on refused (of 200 ACDC maps
#: three have a fifth and more there, the most .29).
_TOLD, _REFUSED = 0.2, 0.5
#: A slice is named as the nearest to a closed ring where no more than this share of its cavity's outline is open.
_NEAR = 0.5


class BaseSlice(NamedTuple):
    """The slice the base of the left ventricle is put in, and the slices nearer to the valve that were passed over."""

    number: int
    passed: tuple[int, ...] = ()

    @property
    def note(self) -> str:
        """What there is to say of it beside its number."""
        if not self.passed:
            return ""
        return f"; passed over slice {', '.join(map(str, self.passed))}, which leaves cavity of the next slice bare"


def base_slice(seg: Segmentation, stack: Stack) -> BaseSlice:
    """The slice the base of the left ventricle is put in, and what was passed over for it.

    Raises
    ------
    InputError
        No ring closes, or what is meant for a heart would be its tip: most of the cavity lies beyond the base.
    """
    first, last = closed_rings(stack, "the base")
    number = last if stack.basal > 0 else first
    passed = []
    for _ in range(_STEPS_IN):
        inner = number - stack.basal
        if not first < inner < last or stack.bare[inner] <= _BARE:
            break
        passed.append(number)
        number = inner
    if (share := _share_beyond(stack, number)) > _REFUSED:
        opening, advice = _opening(seg, stack, number + stack.basal)
        raise InputError(
            f"{100.0 * share:.0f} % of the left cavity would lie beyond the base, as the myocardium does not close "
            f"around it {opening}",
            advice=advice,
        )
    return BaseSlice(number, tuple(passed))


def closed_rings(stack: Stack, what: str) -> tuple[int, int]:
    """The run of closed rings, or an error that says which slice is nearest to one.

    No base is advised in its place: of 14 hearts cut where least of the outline was open none passed, as the surfaces
    follow the gap down the wall.
    """
    first, last = stack.ring
    if last < first:
        slices = np.flatnonzero(stack.cavity)
        raise InputError(
            f"the myocardium closes around the cavity in none of slices {slices[0]} to {slices[-1]}, so {what} "
            "cannot be found",
            advice=[Advice(f"mend the labels{_nearest(stack)}", "labels")],
        )
    return first, last


def base_notices(seg: Segmentation, stack: Stack, base: BaseSlice) -> tuple[Notice, ...]:
    """That slices with a closed ring were passed over, that much lies beyond the base, that rings below it are open."""
    notices = []
    beyond = _share_beyond(stack, base.number)
    if base.passed:
        why = "as its slice leaves cavity of the next one bare"
        notices.append(base_moved(seg, stack, base.passed[0], base.number, why))
    elif beyond >= _TOLD:
        words = (
            "{amount} of the left cavity lie beyond the base plane near {place}, where the myocardium does not close "
            "around it, and are cut away"
        )
        place = _middle(seg, stack, base.number)
        notices.append(Notice.of("left out", words, amount=100.0 * beyond, unit="%", place=place))
    return (*notices, *_gaps_told(seg, stack))


def _gaps_told(seg: Segmentation, stack: Stack) -> list[Notice]:
    """That slices between closed rings are open."""
    if not stack.gaps:
        return []
    worst = max(stack.gaps, key=lambda number: float(stack.open[number]))
    slices = f"slice{'s' * (len(stack.gaps) > 1)} {', '.join(map(str, stack.gaps))}"
    words = (
        f"the myocardium is open in {slices}, between others in which it closes, by up to {{amount}} of the cavity's "
        f"outline near {{place}}: where the labels have no wall it is as thin as it may be; mend them, or have them "
        f"drawn anew ({' '.join(f'--leave-out {number}' for number in stack.gaps)})"
    )
    open_ = 100.0 * float(stack.open[worst])
    return [Notice.of("assumed", words, amount=open_, unit="%", place=_middle(seg, stack, worst))]


def base_moved(seg: Segmentation, stack: Stack, before: int, after: int, why: str) -> Notice:
    """That the base lies nearer to the apex than its closed rings allow: by how much, where, and what that takes away.

    Parameters
    ----------
    seg, stack
        The labels.
    before, after : int
        Slice it would lie in, and the one it lies in.
    why : str
        A clause.
    """
    steps = abs(after - before)
    slices = "1 slice" if steps == 1 else f"{steps} slices"
    full, left = (_cavity_below(seg, stack, number) for number in (before, after))
    words = (
        f"the base plane was moved by {{amount}} ({slices}) towards the apex, to near {{place}}, {why}: of the left "
        f"cavity's {full:.1f} mL below it {left:.1f} mL are left"
    )
    thickness = float(seg.grid.spacing[stack.axis])
    return Notice.of("moved", words, amount=steps * thickness, unit="mm", place=_middle(seg, stack, after))


def _cavity_below(seg: Segmentation, stack: Stack, number: int) -> float:
    """Labelled cavity of the left ventricle from the apex to the middle of a slice, mL."""
    beyond = np.arange(len(stack.cavity)) * stack.basal < number * stack.basal
    voxels = float(stack.cavity[beyond].sum()) + 0.5 * float(stack.cavity[number])
    return voxels * float(np.prod(seg.grid.spacing)) / 1000.0


def _share_beyond(stack: Stack, number: int) -> float:
    """Share of the labelled cavity in the slices between one and the basal end of the stack."""
    beyond = np.arange(len(stack.cavity)) * stack.basal > number * stack.basal
    return float(stack.cavity[beyond].sum() / stack.cavity.sum())


def _middle(seg: Segmentation, stack: Stack, number: int) -> FloatArray:
    """Where the middle of the cavity in a slice is, mm LPS."""
    inside = np.moveaxis(np.asarray(seg.mask("lv")), stack.axis, 0)[number]
    return seg.grid.to_world(np.insert(np.argwhere(inside).mean(axis=0), stack.axis, number))


def _opening(seg: Segmentation, stack: Stack, number: int) -> tuple[str, list[Advice]]:
    """A slice that does not close, where and by how much, and what there is to do about it."""
    place = np.round(_middle(seg, stack, number), 1).tolist()
    advice = [MEND]
    if not stack.thick:
        words = "for a base along the image's slices give --basal-end"
        advice += [Advice(f"{words} {end}", "wall.basal_end", end) for end in ("first", "last")]
    elif 0 <= number + stack.basal < len(stack.open) and stack.closed[number + stack.basal]:
        words = f"have the slice resampled from its neighbours (--leave-out {number})"
        advice.append(Advice(words, "image.leave_out", (number,)))
    slice_ = f"in slice {number}, " if stack.thick else ""
    what = f"{slice_}near {place} (mm LPS): {100.0 * stack.open[number]:.0f} % of its outline is open"
    return what, [*advice, GIVE_BASE]


def _nearest(stack: Stack) -> str:
    """Which slice is nearest to a closed ring; nothing where all gape."""
    number = int(np.argmin(stack.open))
    share = float(stack.open[number])
    return "" if share > _NEAR else f": slice {number} is nearest to a ring, with {100.0 * share:.0f} % of it open"
