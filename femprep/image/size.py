"""A label map in; an error where what it holds is of no heart's size, so that its voxel sizes are in another unit.

Asked before anything is computed: arrays and meshes of later stages grow with the cube of such an error.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.image.grid import Grid
from femprep.image.segmentation import Segmentation
from femprep.image.topology import used_box
from femprep.model import BoolArray, IntArray

#: Least and greatest volume of a cavity or an object, mL: a newborn mouse's ventricle has some microlitres, an
#: elephant's a few litres. Metres or micrometres taken for millimetres are 10^9 off.
VOLUMES: Final = (1e-3, 2e4)
#: Longest side of the box of an object, mm; and over its shortest: two thin slices of a long crescent come to 30.
LONGEST: Final = 1000.0
FLATTEST: Final = 100.0
#: Longest side of the box of cavity and wall together over the next one: that of ACDC's 200 maps comes to 1.50 at most,
#: a pig's to 1.54, that of cavities alone, which are not asked, to 2.64.
THINNEST: Final = 5.0


def require_heart_size(seg: Segmentation, structures: Iterable[Iterable[str]]) -> None:
    """Make sure that objects are as large as something of a heart can be.

    Parameters
    ----------
    seg : Segmentation
    structures : iterable of iterables of str
        Structures that each object is the union of; those that the map has not are left to whoever needs them.

    Raises
    ------
    InputError
        A volume or the shape of its box is none of a heart.
    """
    for names in structures:
        known = [name for name in names if name in seg.structures]
        numbers = [number for name in known for number in seg.structures[name] if number in seg.present]
        if numbers:
            _require(np.isin(seg.labels, numbers), seg.grid, known)


def _require(mask: BoolArray, grid: Grid, names: Sequence[str]) -> None:
    name = "+".join(names)
    said = " x ".join(f"{size:.4g}" for size in grid.spacing)
    remedy = (
        "voxel sizes have to be in mm, in the order of the stored axes: mend the header, or give them with --spacing"
    )
    with np.errstate(over="ignore"):
        millilitres = float(np.count_nonzero(mask) * grid.voxel_volume / 1000.0)
    box = np.array([part.stop - part.start for part in used_box(mask)])
    if not VOLUMES[0] <= millilitres <= VOLUMES[1]:
        raise InputError(
            f"{name!r} has {millilitres:.3g} mL by voxels of {said} mm, and nothing of a heart has less than "
            f"{VOLUMES[0]:g} or more than {VOLUMES[1]:g} mL; {remedy}{_likely(box, grid, millilitres)}"
        )
    sides = box * grid.spacing
    least, middle, most = np.sort(sides)
    rod = len(names) > 1 and most > THINNEST * middle
    if rod or most > min(LONGEST, FLATTEST * least):
        shown = " x ".join(f"{side:.3g}" for side in sides)
        remedy += _likely(box, grid, millilitres, int(np.argmax(sides)) if rod else None)
        raise InputError(f"{name!r} fills a box of {shown} mm by voxels of {said} mm, which is no heart's; {remedy}")


def _likely(box: IntArray, grid: Grid, millilitres: float, long: int | None = None) -> str:
    """The voxel sizes that would make a heart of it, where all of them, or one alone, are off by a unit; else nothing.

    Sizes in cm, m or micrometres, or ten times those they should be, are off by powers of ten, and a volume by their
    cubes, so that one power alone comes to between 1 and 1000 mL. Of a rod the axis that is too ``long`` is off.
    """
    axes = np.arange(3)
    if long is not None:
        ways = [np.where(axes == long, factor, 1.0) for factor in (0.1, 1e-3)]
    else:
        ways = [np.full(3, 10.0 ** -np.floor(np.log10(millilitres) / 3.0))] if 0.0 < millilitres < np.inf else []
        ways += [np.where(axes == axis, factor, 1.0) for factor in (1e-3, 1e3) for axis in range(3)]
    for way in ways:
        volume, sides = millilitres * float(way.prod()), box * grid.spacing * way
        if 1.0 <= volume < 1000.0 and sides.min() > 5.0 and sides.max() < 300.0:
            sizes = " ".join(f"{size:.6g}" for size in grid.spacing * way)
            return f"; --spacing {sizes} would make it {volume:.3g} mL"
    return ""
