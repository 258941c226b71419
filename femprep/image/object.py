"""LabelObject: a mask in, one solid object out: cropped, padded, one piece, voids filled, and a report of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.image.grid import Grid, require_grid
from femprep.image.solid import PADDING, Where, cut_off, filled, largest_piece, tunnels_of, without_tips
from femprep.image.topology import counts_along, used_box
from femprep.image.views import PlaneView
from femprep.model import BoolArray, FloatArray, Immutable, readonly, records
from femprep.model.products import product, weighted
from femprep.options import ImageOptions, choose, takes


@dataclass(frozen=True, eq=False)
class LabelObject(Immutable):
    """One solid object of a segmentation, on a grid of its own that reaches a little beyond it.

    Attributes
    ----------
    mask : (ni, nj, nk) bool array
        The object, with at least two empty voxels on each side.
    grid : Grid
        Grid of that mask.
    name : str
    report : mapping
        What was found and repaired, in voxels: see :func:`make_object`. JSON-ready.
    frame : (3, 3) array, optional
        Axes of the heart it belongs to, see :class:`~femprep.image.segmentation.Segmentation`.
    views : tuple of PlaneView
        Long-axis views of the object: pixels that are not 0 belong to it.

    Examples
    --------
    >>> cavity
    LabelObject('lv': ... voxels, ... mL)
    """

    mask: BoolArray
    grid: Grid
    name: str = "object"
    report: Mapping[str, Any] = field(default_factory=dict)
    frame: FloatArray | None = None
    views: tuple[PlaneView, ...] = ()

    def __post_init__(self) -> None:
        require_grid(self.grid)
        mask = np.asarray(self.mask)
        if mask.dtype != bool or mask.shape != self.grid.shape:
            raise InputError(
                f"mask of {self.name!r} is {mask.dtype} {mask.shape}, expected bool {self.grid.shape} as its grid"
            )
        first, last = bounding_box(mask, self.name)
        if min(first) < PADDING or any(n - 1 - b < PADDING for n, b in zip(mask.shape, last)):
            raise InputError(f"mask of {self.name!r} is padded by fewer than {PADDING} voxels; use make_object")
        if mask.flags.writeable:
            mask = mask.copy()
            mask.setflags(write=False)
        object.__setattr__(self, "mask", mask)
        object.__setattr__(self, "report", MappingProxyType(dict(self.report)))
        object.__setattr__(self, "frame", rotation(self.frame))

    def __repr__(self) -> str:
        return f"LabelObject({self.name!r}: {self.voxels} voxels, {self.volume / 1000.0:.4g} mL)"

    @property
    def voxels(self) -> int:
        """Number of voxels.

        Examples
        --------
        >>> cavity.voxels < heart.voxels
        True
        """
        return int(np.count_nonzero(self.mask))

    @property
    def volume(self) -> float:
        """Volume of the voxels, mm3.

        Examples
        --------
        >>> bool(abs(cavity.volume - cavity.voxels * seg.grid.voxel_volume) < 1e-6)
        True
        """
        return self.voxels * self.grid.voxel_volume

    @property
    def barycentre(self) -> FloatArray:
        """Mean of the voxel centres, ``(3,)`` mm LPS.

        Examples
        --------
        >>> cavity.barycentre.shape
        (3,)
        """
        total = self.voxels
        centre = [counts_along(self.mask, axis) @ np.arange(n) / total for axis, n in enumerate(self.mask.shape)]
        at = self.grid.regular.to_world(np.array(centre))
        if self.grid.offsets is None:
            return at
        share = counts_along(self.mask, self.stack_axis) / total
        return np.asarray(at + product(weighted(share, self.grid.offsets), self.grid.direction.T), dtype=np.float64)

    @property
    def stack_axis(self) -> int:
        """Axis across the thick slices.

        Examples
        --------
        >>> cavity.stack_axis
        2
        """
        return self.grid.stack_axis


def rotation(frame: FloatArray | None) -> FloatArray | None:
    """Axes of a heart as a read-only rotation, checked; None stays None."""
    if frame is None:
        return None
    turn: FloatArray = readonly(frame, np.float64, (3, 3), "frame")
    if not np.allclose(turn.T @ turn, np.eye(3), atol=1e-6) or np.linalg.det(turn) < 0.0:
        raise InputError(f"frame is {turn.tolist()}, expected a rotation: three orthogonal unit columns, right-handed")
    return turn


def bounding_box(mask: BoolArray, name: str = "object") -> tuple[tuple[int, int, int], tuple[int, int, int]]:
    """First and last index of the voxels of a mask along each axis."""
    if not mask.any():
        raise InputError(f"object {name!r} has no voxels")
    i, j, k = used_box(mask)
    return (i.start, j.start, k.start), (i.stop - 1, j.stop - 1, k.stop - 1)


@takes(ImageOptions)
def make_object(
    mask: BoolArray,
    grid: Grid,
    name: str = "object",
    options: ImageOptions | None = None,
    labels: npt.NDArray[np.integer[Any]] | None = None,
    **changes: Any,
) -> LabelObject:
    """Make a solid object from a mask: crop, pad, keep the largest piece, fill its voids, count its tunnels.

    Of thick slices, tips one pixel wide are left out first: see :func:`~femprep.image.tips.thin_tips`.

    Parameters
    ----------
    mask : (ni, nj, nk) bool array
        Voxels of the object; may touch the border.
    grid : Grid
        Where they lie.
    name : str
        For messages and for what is made of the object.
    options : ImageOptions, optional
        ``policy`` and ``minimum_voxels``.
    labels : (ni, nj, nk) integer array, optional
        The label map the mask was taken from, to say which labels lay in a filled void.
    **changes
        Options by name.

    Returns
    -------
    LabelObject
        Its ``report`` holds ``policy``, ``voxels_labelled``, ``voxels``, ``tips``, ``tip_voxels``, ``pieces``,
        ``piece_voxels`` (largest first), ``removed_voxels`` (tips and smaller pieces), ``voids``, ``filled_voxels``,
        ``filled_labels`` (voxels by label), ``tunnels`` (of the object as it is now; they are counted, not mended),
        ``touches_border`` (it reached the image's border), and ``notices``.

    Raises
    ------
    InputError
        There are too few voxels or they lie in one slice; a tenth or more of them is in smaller pieces; or, with
        ``policy="strict"``, there is more than one piece, a void or a tunnel.
    """
    chosen = choose(ImageOptions, options, changes)
    strict = chosen.policy == "strict"
    first, last = bounding_box(mask, name)
    box = tuple(slice(a, b + 1) for a, b in zip(first, last))
    solid = np.pad(mask[box], PADDING)
    found = int(np.count_nonzero(solid))
    where = Where(name, grid, first)
    solid, tips, tip_notices = without_tips(solid, where, strict)
    solid, pieces, piece_notices = largest_piece(solid, where, strict)
    solid, voids, void_notices = filled(solid, where, strict, None if labels is None else labels[box])
    kept = int(np.count_nonzero(solid))
    solid, first = _tight(solid, first, name)
    _require_size(solid, name, kept, chosen.minimum_voxels)
    tunnels, tunnel_notices = tunnels_of(solid, name, strict)
    report = {
        "policy": chosen.policy,
        "voxels_labelled": found,
        "voxels": kept,
        **tips,
        **pieces,
        "removed_voxels": found - pieces["piece_voxels"][0],
        **voids,
        "tunnels": tunnels,
        "touches_border": min(where.first) == 0 or any(b == n - 1 for b, n in zip(last, mask.shape)),
        "notices": records(*cut_off(mask, grid, name), *tip_notices, *piece_notices, *void_notices, *tunnel_notices),
    }
    solid.setflags(write=False)
    start = (first[0] - PADDING, first[1] - PADDING, first[2] - PADDING)
    return LabelObject(solid, grid.window(start, solid.shape), name, report)


def _tight(solid: BoolArray, first: tuple[int, int, int], name: str) -> tuple[BoolArray, tuple[int, int, int]]:
    """Crop the padded mask again after pieces were removed; ``first`` is the image index of its first object voxel."""
    low, high = bounding_box(solid, name)
    box = tuple(slice(a - PADDING, b + 1 + PADDING) for a, b in zip(low, high))
    i, j, k = (f + a - PADDING for f, a in zip(first, low))
    return np.ascontiguousarray(solid[box]), (i, j, k)


def _require_size(solid: BoolArray, name: str, voxels: int, minimum: int) -> None:
    """Refuse what no surface can be fitted to."""
    if voxels < minimum:
        raise InputError(
            f"object {name!r} has {voxels} voxels, fewer than minimum_voxels = {minimum}; is this the right label?"
        )
    for axis, n in enumerate(solid.shape):
        if n - 2 * PADDING == 1:
            raise InputError(
                f"object {name!r} lies in one slice only (axis {'ijk'[axis]}); a closed surface needs two or more"
            )
