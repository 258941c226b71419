"""A mask of thick slices in, its tips one pixel wide out: slivers that run out of the object within a slice.

Readers' brushes leave them beside the myocardium, mostly where a right ventricle ends in a crescent. No smooth surface
follows what is one pixel wide; one that tries bends about it.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.image.topology import label_pieces
from femprep.model import BoolArray, IntArray

#: A tip is longer than this, pixels: corners of rounder shapes are no longer than one.
_SHORTEST: Final = 2.0
#: What lies behind a neck one pixel wide belongs to the tip where it has fewer pixels than a square of three.
_FEWEST: Final = 9
_AROUND: Final = np.ones((3, 3), dtype=np.bool_)
_SQUARE: Final = np.ones((2, 2), dtype=np.bool_)

_Numbers = npt.NDArray[np.integer[Any]]


def _sides(thin: _Numbers, pieces: int, parts: _Numbers) -> IntArray:
    """To how many parts each thin piece of a slice is next, ``(pieces,)``: of all at once, a map of noise has many."""
    beside = np.pad(parts, 1)
    pairs = []
    for i, j in np.ndindex(_AROUND.shape):
        part = beside[i : i + parts.shape[0], j : j + parts.shape[1]]
        both = (thin > 0) & (part > 0)
        pairs.append(np.stack([thin[both], part[both]], axis=1))
    return np.bincount(np.unique(np.concatenate(pairs), axis=0)[:, 0], minlength=pieces + 1)[1:]


def thin_tips(mask: BoolArray, stack_axis: int) -> tuple[BoolArray, int]:
    """Voxels of tips one pixel wide and longer than two within a slice, and the number of tips.

    A tip is a piece of what squares of two pixels cannot cover, with the few pixels that hang on it alone; itself it
    hangs on one side. What joins two parts of a slice is none, nor a slice that is thin as a whole. Where the object
    would fall apart, as slices that lie beside each other touch by their tips alone, there are none.
    """
    from scipy import ndimage

    tips = np.zeros_like(mask)
    count = 0
    for plane, out in zip(np.moveaxis(mask, stack_axis, 0), np.moveaxis(tips, stack_axis, 0)):
        parts, number = ndimage.label(ndimage.binary_opening(plane, _SQUARE), _AROUND)
        sizes = np.bincount(parts.ravel(), minlength=number + 1)[1:]
        if not number:
            continue
        parts[np.isin(parts, 1 + np.flatnonzero(sizes < min(_FEWEST, sizes.max())))] = 0
        thin, pieces = ndimage.label(plane & (parts == 0), _AROUND)
        far = ndimage.distance_transform_edt(parts == 0)
        longest = np.asarray(ndimage.maximum(far, thin, np.arange(1, pieces + 1)))
        found = 1 + np.flatnonzero((longest > _SHORTEST) & (_sides(thin, pieces, parts) == 1))
        out[np.isin(thin, found)] = True
        count += len(found)
    if count and len(label_pieces(mask & ~tips)[1]) > len(label_pieces(mask)[1]):
        return np.zeros_like(mask), 0
    return tips, count
