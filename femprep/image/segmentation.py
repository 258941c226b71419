"""Segmentation: a label map on its grid, with names for its labels; gives objects, masks and slice tables."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.image.canonical_storage import moments
from femprep.image.grid import Grid, require_grid
from femprep.image.object import LabelObject, make_object, rotation
from femprep.image.slices import SliceTable, slice_table
from femprep.image.views import PlaneView
from femprep.model import BoolArray, FloatArray, Immutable
from femprep.model.arrays import integers, mapping
from femprep.options import ImageOptions, choose, likely_preset, takes


@dataclass(frozen=True, eq=False)
class Segmentation(Immutable):
    """A label map with its place in the world and the names of its structures.

    Attributes
    ----------
    labels : (ni, nj, nk) integer array
        Label numbers, 0 is background.
    grid : Grid
        Where the voxels lie.
    structures : mapping of str to tuple of int
        Label numbers of each structure.
    info : mapping
        Where it comes from and what was guessed or repaired on the way. JSON-ready.
    frame : (3, 3) array, optional
        Axes of the heart as columns, a rotation: z along the long axis to the base, x across it to the right ventricle.
        Templates fitted to its objects are turned by it; see :func:`femprep.orient`.
    views : tuple of PlaneView
        Long-axis slices of the same heart at the same time, each with its own pose.

    Examples
    --------
    >>> seg
    Segmentation(... voxels of 1.4 x 1.4 x 8 mm: ...)
    >>> bool(seg.mask("lv").any())
    True
    """

    labels: npt.NDArray[np.integer[Any]]
    grid: Grid
    structures: Mapping[str, tuple[int, ...]]
    info: Mapping[str, Any] = field(default_factory=dict)
    frame: FloatArray | None = None
    views: tuple[PlaneView, ...] = ()

    def __post_init__(self) -> None:
        require_grid(self.grid)
        object.__setattr__(self, "views", tuple(self.views))
        labels = np.asarray(self.labels)
        if labels.dtype == bool:
            labels = labels.astype(np.uint8)
        if not np.issubdtype(labels.dtype, np.integer):
            raise InputError(f"labels have type {labels.dtype}, expected integers")
        if labels.shape != self.grid.shape:
            raise InputError(f"labels have shape {labels.shape}, their grid {self.grid.shape}")
        if labels.flags.writeable:
            labels = labels.copy(order="K")
            labels.setflags(write=False)
        structures = {
            name: tuple(np.atleast_1d(integers(numbers, f"structure {name!r}")).tolist())
            for name, numbers in mapping(self.structures, "structures").items()
        }
        for name, numbers in structures.items():
            if not numbers:
                raise InputError(f"structure {name!r} has no label; give at least one number")
            if min(numbers) < 1:
                raise InputError(f"structure {name!r} has label {min(numbers)}; labels are positive, 0 is background")
        object.__setattr__(self, "labels", labels)
        object.__setattr__(self, "structures", MappingProxyType(structures))
        object.__setattr__(self, "info", mapping(self.info, "info"))
        object.__setattr__(self, "frame", rotation(self.frame))
        if self.grid.stack is None and len(self.grid.thick_axes) > 1:
            object.__setattr__(self, "grid", replace(self.grid, stack=self._longest(self.grid.thick_axes)))

    def _longest(self, axes: list[int]) -> int:
        """Which of some axes the left ventricle, or what there is, lies along most; the last of several alike."""
        known = [name for name in ("lv", "myo") if name in self.structures] or list(self.structures)
        wanted = tuple(number for name in known for number in self.structures[name])
        mask = _is_any(self.labels, wanted) if wanted else self.labels > 0
        return max(axes, key=lambda axis: (moments(mask, axis)[0], axis))

    def __repr__(self) -> str:
        return f"Segmentation({self.grid.words}: {', '.join(self.structures)})"

    @property
    def stack_axis(self) -> int:
        """Axis across the thick slices (usually 2); of cubic voxels the one that the left ventricle lies along most.

        Examples
        --------
        >>> seg.stack_axis
        2
        """
        return self.grid.stack_axis

    @cached_property
    def present(self) -> tuple[int, ...]:
        """Labels that occur in the map, in increasing order, without the background.

        Examples
        --------
        >>> seg.present
        (2, 3)
        """
        return tuple(n for n in count_labels(self.labels) if n != 0)

    def numbers(self, *structures: str) -> tuple[int, ...]:
        """Labels of one or several structures together, each checked to occur in the map.

        Raises
        ------
        InputError
            A structure has no name here, or one of its labels does not occur.

        Examples
        --------
        >>> seg.numbers("lv", "myo")
        (3, 2)
        """
        found: list[int] = []
        for name in structures:
            if name not in self.structures:
                known = ", ".join(sorted(self.structures)) or "none"
                such = next(map(repr, self.info.get("segments", {}).values()), "3")
                raise InputError(
                    f"structure {name!r} is not defined (defined: {known}); name its labels, for instance "
                    f"{name}={such}; labels there: {self.label_table() or 'none'}"
                )
            for number in self.structures[name]:
                if number not in self.present:
                    raise InputError(
                        f"label {number} of structure {name!r} does not occur in {self._source}; "
                        f"labels there: {self.label_table() or 'none'}{likely_preset(self.present)}"
                    )
                found.append(number)
        return tuple(dict.fromkeys(found))

    def label_table(self) -> str:
        """Labels that occur, each with its name in the file, where it has one, and its volume.

        Examples
        --------
        >>> seg.label_table()
        '2, 3, of 117, 117 mL'
        """
        names, voxel = self.info.get("segments", {}), float(np.prod(self.grid.spacing)) / 1e3
        count = count_labels(self.labels)
        shown = [f"{n}{f' {names[str(n)]!r}' if str(n) in names else ''}" for n in self.present]
        sizes = ", ".join(f"{count[n] * voxel:.3g}" for n in self.present)
        return f"{', '.join(shown)}, of {sizes} mL" if shown else ""

    def mask(self, *structures: str) -> BoolArray:
        """Voxels of one or several structures together, ``(ni, nj, nk)`` bool on the whole grid, as labelled.

        Examples
        --------
        >>> seg.mask("lv").shape == seg.labels.shape
        True
        """
        return _is_any(self.labels, self.numbers(*structures))

    @takes(ImageOptions)
    def object(
        self, *structures: str, name: str | None = None, options: ImageOptions | None = None, **changes: Any
    ) -> LabelObject:
        """One solid object out of one or several structures: padded, in one piece, without voids.

        Parameters
        ----------
        *structures : str
            Structures whose union is the object: ``"lv"`` for the endocardium, ``"lv", "myo"`` for the epicardium.
        name : str, optional
            Name of the object; the structures joined by ``+`` where not given.
        options : ImageOptions, optional
            ``policy`` and ``minimum_voxels`` are used; also by keyword, as in ``policy="strict"``.

        Returns
        -------
        LabelObject

        Raises
        ------
        InputError
            A label does not occur, the object is too small or lies in one slice only, or, with
            ``policy="strict"``, it is not one piece without voids and tunnels.

        Examples
        --------
        >>> seg.object("lv", "myo", name="epi")
        LabelObject('epi': ... voxels, ... mL)
        """
        if not structures:
            raise InputError("no structure given; name at least one, as in object('lv')")
        chosen = choose(ImageOptions, options, changes)
        mask = self.mask(*structures)
        found = make_object(mask, self.grid, name or "+".join(structures), options=chosen, labels=self.labels)
        views = tuple(view for one in self.views if (view := one.showing(*structures)) is not None)
        return replace(found, frame=self.frame, views=views)

    def with_views(self, *views: PlaneView) -> Segmentation:
        """The same segmentation with further long-axis views.

        Examples
        --------
        >>> seg.with_views().views
        ()
        """
        return replace(self, views=(*self.views, *views))

    def with_long_axis(
        self,
        path: str | os.PathLike[str],
        structures: Mapping[str, int | Sequence[int]] | None = None,
        preset: str | None = None,
    ) -> Segmentation:
        """The same segmentation with the long-axis views of a file.

        Parameters
        ----------
        path : path
            Label map of one or a few slices in any pose, of the same heart at the same time.
        structures : mapping of str to int or several ints, optional
            Label numbers by structure; those of the stack where not given.
        preset : str, optional
            A known data set, in place of structures.

        Raises
        ------
        FileError, InputError, OptionError
            See :func:`femprep.read_segmentation`.

        Examples
        --------
        >>> seg.with_long_axis("patient_LA_ED_gt.nii.gz")  # doctest: +SKIP
        """
        from femprep.image.reading.long_axis import read_views

        given = {name: tuple(np.atleast_1d(n).tolist()) for name, n in (structures or {}).items()}
        own = given or (None if preset else self.structures)
        return self.with_views(*read_views(Path(path), own, preset))

    def slices(self, *structures: str) -> SliceTable:
        """Area and centroid of one or several structures together in each slice across the stack.

        Examples
        --------
        >>> table = seg.slices("lv")
        >>> len(table.area) == len(table.index)
        True
        """
        return slice_table(self.mask(*structures), self.grid, self.stack_axis)

    @property
    def _source(self) -> str:
        return str(self.info.get("file", "the label map"))


def count_labels(labels: npt.NDArray[np.integer[Any]]) -> dict[int, int]:
    """Number of voxels of each label that occurs, in increasing order."""
    if labels.dtype.itemsize <= 2:
        # Far cheaper than sorting all voxels.
        low = int(labels.min(initial=0))
        counts = np.bincount(labels.ravel(order="K").astype(np.int64) - low if low < 0 else labels.ravel(order="K"))
        return {int(n) + low: int(counts[n]) for n in np.flatnonzero(counts)}
    numbers, found = np.unique(labels, return_counts=True)
    return {int(n): int(c) for n, c in zip(numbers, found)}


def _is_any(labels: npt.NDArray[np.integer[Any]], numbers: tuple[int, ...]) -> BoolArray:
    """Where labels are any of some numbers; one byte per voxel, no sorting."""
    out = labels == numbers[0]
    for number in numbers[1:]:
        out |= labels == number
    return np.asarray(out, dtype=bool)
