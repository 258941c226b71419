"""Label map of about cubic voxels in, the same seen across the left ventricle's long axis out: where planes are sought.

An image of CT lies as the patient does, not as the heart: a plane along its slices would cut the ventricle anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from femprep.errors import InputError
from femprep.image import Grid, Segmentation
from femprep.image.long_axis import is_stack, long_axis
from femprep.mesh.tangents import tangents
from femprep.model import Notice
from femprep.model.products import product, unit_vectors

#: How the source of a plane begins that was sought so.
ACROSS: Final = "across the long axis"
#: Angle between the long axis and the stack from which slices lie across the ventricle no more, degrees.
_TILT: Final = 20.0
#: Least size of the voxels it is looked at in, mm, and their number beyond the ventricles.
_VOXEL, _ROOM = 1.0, 2


@dataclass(frozen=True)
class View:
    """A label map as planes are sought in it.

    Attributes
    ----------
    seg : Segmentation
        Its slices lie across the left ventricle.
    basal_end : str
        Which end of its stack is basal, or auto.
    words : str
        How it was turned, for a plane's source; empty where it was not.
    notices : tuple of Notice
    """

    seg: Segmentation
    basal_end: str
    words: str = ""
    notices: tuple[Notice, ...] = ()


def look_across(seg: Segmentation, basal_end: str = "auto") -> View:
    """A label map as it is, or turned where its voxels are about cubic and its slices do not lie across the ventricle.

    Whoever says which end of the stack is basal wants its slices.
    """
    if not lies_oblique(seg, basal_end):
        return View(seg, basal_end)
    words = f"{ACROSS}, which lies {tilt(seg):.0f} degrees off the image's stack"
    notice = Notice.of(
        "assumed",
        f"the base plane was laid {words}; --base gives another one, --basal-end one along the image's slices",
    )
    return View(_turned(seg), "last", words, (notice,))


def lies_oblique(seg: Segmentation, basal_end: str = "auto") -> bool:
    """Whether slices of the image do not lie across the ventricle, and nobody asked for them."""
    return basal_end == "auto" and tilt(seg) >= _TILT


def tilt(seg: Segmentation) -> float:
    """Angle between the left ventricle's long axis and the image's stack, degrees; 0 where slices tell the stack."""
    if is_stack(seg.grid):
        return 0.0
    try:
        direction = long_axis(seg).direction
    except InputError:  # whoever looks for the base says more
        return 0.0
    along = abs(float(direction @ unit_vectors(seg.grid.direction[:, seg.stack_axis])))
    return float(np.degrees(np.arccos(min(along, 1.0))))


def _turned(seg: Segmentation) -> Segmentation:
    """The labels of the ventricles, nearest voxel, on a grid whose last axis runs from the apex to the base."""
    direction = long_axis(seg).direction
    axes = np.column_stack([*tangents(direction[None])[0], direction])
    names = [name for name in ("lv", "myo", "rv", "rv_wall") if name in seg.structures]
    numbers = [number for name in names for number in seg.structures[name]]
    held = product(seg.grid.to_world(np.argwhere(np.isin(seg.labels, numbers))), axes)
    voxel = max(_VOXEL, float(seg.grid.spacing.min()))
    low, high = held.min(axis=0) - _ROOM * voxel, held.max(axis=0) + _ROOM * voxel
    i, j, k = (int(n) for n in np.ceil((high - low) / voxel - 1e-9) + 1)
    first = product(low, axes.T)
    grid = Grid((i, j, k), np.full(3, voxel), first, axes, stack=2)
    labels = np.zeros(grid.shape, seg.labels.dtype)
    flat = np.stack(np.meshgrid(np.arange(i), np.arange(j), indexing="ij"), axis=-1).reshape(-1, 2)
    for level in range(k):
        index = np.column_stack([flat, np.full(len(flat), level)])
        found = seg.grid.values_at(seg.labels, seg.grid.to_index(grid.to_world(index)))
        labels[:, :, level] = found.reshape(i, j)
    return Segmentation(labels, grid, {name: seg.structures[name] for name in names})
