"""An object's pieces in; the largest out, refused where what is left out with the others is no speck but part of it."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.image.grid import Grid
from femprep.image.topology import used_box
from femprep.model import BoolArray, FloatArray, IntArray
from femprep.model.notice import spot

#: Share of an object from which smaller pieces, together, are no specks. In the 200 maps of ACDC left cavities are in
#: pieces once (.9 % left out), their bodies never, right ventricles 12 times (.01 to 3.2 % left out): three times that.
_PART: Final = 0.1


def require_one_body(
    pieces: npt.NDArray[np.integer[Any]], sizes: npt.NDArray[np.int64], grid: Grid, corner: IntArray, name: str
) -> None:
    """Refuse an object of which more would be left out than specks.

    Parameters
    ----------
    pieces : (ni, nj, nk) integer array
        Numbers of the pieces from 1, the largest first, 0 elsewhere.
    sizes : (n,) array
        Their voxels.
    grid : Grid
        Of the image.
    corner : (3,) array
        Index in the image of the first voxel of ``pieces``.
    name : str
        The object's.

    Raises
    ------
    InputError
    """
    if sizes[1:].sum() < _PART * sizes.sum():
        return
    found = f"object {name!r} is in {len(sizes)} pieces of {listed(sizes)} voxels"
    _require_slices(pieces, grid.stack_axis, corner, found)
    places = " and ".join(spot(middle(pieces == number, grid, corner)) for number in (1, 2))
    which, other = ("", "one is") if len(sizes) == 2 else ("the two largest ", "ones are")
    raise InputError(
        f"{found}, {which}near {places} mm, and the smaller {other} more than specks that may be left out; label what "
        "joins them, or take away the labels of what is no part of it"
    )


def _require_slices(pieces: npt.NDArray[np.integer[Any]], axis: int, corner: IntArray, found: str) -> None:
    """Refuse the two largest pieces where slices without a label lie between them."""
    low, high = sorted((used_box(pieces == number)[axis] for number in (1, 2)), key=lambda part: part.start)
    between = np.moveaxis(pieces, axis, 0)[low.stop : high.start]
    if not len(between) or between.any():
        return
    start, first, last, stop = (int(corner[axis]) + n for n in (low.start, low.stop, high.start - 1, high.stop - 1))
    empty = f"slice {first} holds" if first == last else f"slices {first} to {last} hold"
    raise InputError(
        f"{found}: {empty} nothing of it, between slices that do (axis {'ijk'[axis]}, {start} to {stop}); label what "
        "is missing, or take the labels of one piece away"
    )


def middle(mask: BoolArray, grid: Grid, corner: IntArray) -> FloatArray:
    """The voxel of a part of the image that is nearest to the middle of all of a mask's, mm."""
    index = np.argwhere(mask)
    nearest = index[np.argmin(((index - index.mean(axis=0)) ** 2).sum(axis=1))]
    return grid.to_world((nearest + corner).astype(np.float64))


def listed(sizes: npt.NDArray[np.int64], most: int = 5) -> str:
    """Sizes in a message, the first few only."""
    return ", ".join(str(int(n)) for n in sizes[:most]) + (", ..." if len(sizes) > most else "")
