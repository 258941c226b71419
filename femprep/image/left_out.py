"""A segmentation and numbers of slices in, the same without their labels out: those within the stack are drawn anew.

A slice may be labelled wrongly, or lie so far beside the others that no shift of all its structures explains it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.image.resample import slice_distance
from femprep.image.segmentation import Segmentation
from femprep.model import FloatArray, IntArray, Notice, records
from femprep.model.arrays import integers

_Labels = npt.NDArray[np.integer[Any]]


def leave_out_slices(seg: Segmentation, slices: Iterable[int]) -> Segmentation:
    """Leave out the labels of some slices of a stack.

    Before the first and behind the last slice that is kept the stack ends. A slice between two that are kept is drawn
    from them: each label's signed distance is interpolated, and every pixel takes the label it lies deepest in [1]_.

    Parameters
    ----------
    seg : Segmentation
    slices : iterable of int
        Numbers along the stack, from 0, as messages and reports have them.

    Returns
    -------
    Segmentation
        ``info["left_out"]`` tells which slices were left out and which of them were drawn anew.

    Raises
    ------
    InputError
        A number is no whole one, or no slice of the stack; fewer than two with labels are left.

    References
    ----------
    .. [1] S. P. Raya, J. K. Udupa, "Shape-based interpolation of multidimensional objects", 1990, doi 10.1109/42.52980.

    Examples
    --------
    >>> shorter = fp.leave_out_slices(seg, [int(seg.slices("lv").index[-1])])
    >>> len(shorter.slices("lv").index) == len(seg.slices("lv").index) - 1
    True
    """
    asked, axis = np.unique(integers(list(slices), "slices")).tolist(), seg.stack_axis
    stack = np.moveaxis(seg.labels, axis, 0)
    if wrong := [number for number in asked if not 0 <= number < len(stack)]:
        raise InputError(f"slice {wrong[0]} cannot be left out: the slices are 0 to {len(stack) - 1}")
    labelled = np.flatnonzero(stack.any(axis=(1, 2)))
    # Of the phases of a heart some may have none there.
    out = [number for number in asked if number in labelled]
    kept = np.setdiff1d(labelled, out)
    if len(kept) < 2:
        raise InputError(f"{len(out)} slices are to be left out of {len(labelled)} with labels: two have to be left")
    drawn = stack.copy()
    spacing = seg.grid.spacing[list(seg.grid.flat_axes)]
    anew = [number for number in out if kept[0] < number < kept[-1]]
    for number in out:
        drawn[number] = _between(stack, number, kept, spacing) if number in anew else 0
    labels = np.ascontiguousarray(np.moveaxis(drawn, 0, axis))
    record = {"slices": out, "drawn_anew": anew, "notices": records(_notice(asked, out, anew))}
    return replace(seg, labels=labels, info={**seg.info, "left_out": record})


def _between(stack: _Labels, number: int, kept: IntArray, spacing: FloatArray) -> _Labels:
    """A slice from the nearest ones kept below and above it."""
    above = int(np.searchsorted(kept, number))
    low, high = int(kept[above - 1]), int(kept[above])
    return slice_between(stack[low], stack[high], (number - low) / (high - low), spacing)


def slice_between(below: _Labels, above: _Labels, share: float, spacing: FloatArray) -> _Labels:
    """Labels of a slice at a share of the way from one to another: where each label's interpolated depth is largest."""
    numbers = np.union1d(below, above)
    depth = []
    for n in numbers:
        here, there = below == n, above == n
        # What only one of the two has comes to its end between them.
        one = slice_distance(here, spacing) if here.any() else -slice_distance(there, spacing).max()
        other = slice_distance(there, spacing) if there.any() else -slice_distance(here, spacing).max()
        depth.append((1.0 - share) * one + share * other)
    return np.asarray(numbers[np.argmax(depth, axis=0)], dtype=below.dtype)


def _notice(asked: list[int], out: list[int], anew: list[int]) -> Notice:
    """What was done, for people."""

    def told(numbers: list[int]) -> str:
        return f"slice{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers))}"

    clauses = [f"labels of {told(out)} were left out, as was asked for"] if out else []
    if anew:
        clauses.append(f"{told(anew)}, within the stack, drawn from the nearest ones kept")
    if empty := [number for number in asked if number not in out]:
        clauses.append(f"no labels were to be left out in {told(empty)}")
    return Notice.of("repaired", "; ".join(clauses))
