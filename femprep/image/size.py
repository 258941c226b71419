"""A label map in; an error where what it holds is of no heart's size, so that its voxel sizes are in another unit.

Asked before anything is computed: arrays and meshes of later stages grow with the cube of such an error.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.image.grid import Grid
from femprep.image.segmentation import Segmentation
from femprep.image.topology import used_box
from femprep.model import BoolArray

#: Least and greatest volume of a cavity or an object, mL: a newborn mouse's ventricle has some microlitres, an
#: elephant's a few litres. Metres or micrometres taken for millimetres are 10^9 off.
VOLUMES: Final = (1e-3, 2e4)
#: Longest side of the box of an object, mm; and over its shortest: two thin slices of a long crescent come to 30.
LONGEST: Final = 1000.0
FLATTEST: Final = 100.0


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
            _require(np.isin(seg.labels, numbers), seg.grid, "+".join(known))


def _require(mask: BoolArray, grid: Grid, name: str) -> None:
    said = " x ".join(f"{size:.4g}" for size in grid.spacing)
    remedy = "voxel sizes have to be in mm: mend the header, or give them with --spacing"
    with np.errstate(over="ignore"):
        millilitres = float(np.count_nonzero(mask) * grid.voxel_volume / 1000.0)
    if not VOLUMES[0] <= millilitres <= VOLUMES[1]:
        raise InputError(
            f"{name!r} has {millilitres:.3g} mL by voxels of {said} mm, and nothing of a heart has less than "
            f"{VOLUMES[0]:g} or more than {VOLUMES[1]:g} mL; {remedy}"
        )
    sides = [(part.stop - part.start) * float(size) for part, size in zip(used_box(mask), grid.spacing)]
    if max(sides) > min(LONGEST, FLATTEST * min(sides)):
        shown = " x ".join(f"{side:.3g}" for side in sides)
        raise InputError(
            f"{name!r} fills a box of {shown} mm by voxels of {said} mm, which is no heart's; voxel sizes have to be "
            "in mm and in the order of the stored axes: mend the header, or give them with --spacing"
        )
