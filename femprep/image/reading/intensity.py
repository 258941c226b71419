"""An image file of intensities in, an IntensityImage out: T1 maps, perfusion, late enhancement, CT."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from femprep.errors import InputError
from femprep.image.grid import Grid, require_grid
from femprep.image.reading.affine import choose_spacing
from femprep.image.reading.files import format_of
from femprep.image.reading.itk import read_content, skewed
from femprep.model import Immutable, records
from femprep.model.notice import Notice


@dataclass(frozen=True, eq=False)
class IntensityImage(Immutable):
    """An image of numbers with its place in the world.

    Attributes
    ----------
    values : (ni, nj, nk) array
        NaN where nothing is known.
    grid : Grid
        Where the voxels lie.
    info : mapping
        Where it comes from and what was guessed. JSON-ready.

    Examples
    --------
    >>> image = fp.IntensityImage(seg.labels * 100.0, seg.grid)
    >>> image.values.shape == seg.grid.shape
    True
    """

    values: npt.NDArray[np.floating[Any]]
    grid: Grid
    info: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require_grid(self.grid)
        values = np.asarray(self.values)
        if values.dtype.kind not in "fiub":
            raise InputError(f"the image's values have type {values.dtype}, expected numbers")
        values = np.array(values, dtype=np.float32 if values.dtype.itemsize <= 4 else np.float64)
        if values.shape != self.grid.shape:
            raise InputError(f"the image's values have shape {values.shape}, their grid {self.grid.shape}")
        if not np.isfinite(values).any():
            raise InputError("the image holds no finite number")
        values.setflags(write=False)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "info", MappingProxyType(dict(self.info)))

    def __repr__(self) -> str:
        size, sides = " x ".join(map(str, self.grid.shape)), " x ".join(f"{x:.3g}" for x in self.grid.spacing)
        low, high = np.nanmin(self.values), np.nanmax(self.values)
        return f"IntensityImage({size} voxels of {sides} mm: {low:.4g} to {high:.4g})"


def read_image(path: str | os.PathLike[str], *, frame: int | None = None) -> IntensityImage:
    """Read an image of intensities.

    Parameters
    ----------
    path : path
        ``.nii``, ``.nii.gz``, ``.nrrd``, ``.mha`` or ``.mhd``.
    frame : int, optional
        Which frame of a file with several, from 1.

    Returns
    -------
    IntensityImage

    Raises
    ------
    FileError
        The file is missing, damaged or of an unknown format.
    InputError
        It holds no 3-D image of numbers.

    Examples
    --------
    >>> fp.read_image("t1.nii.gz")  # doctest: +SKIP
    IntensityImage(... voxels of 1.4 x 1.4 x 8 mm: ...)
    """
    file = Path(path)
    array, _, origin, direction, header, notes = found = read_content(file, frame)
    if array.ndim != 3:
        raise InputError(f"{file}: has {array.ndim} dimensions, expected a 3-D image")
    spacing = choose_spacing(found.spacing, header)
    notes = notes + ([spacing.note] if spacing.note else [])
    try:
        return IntensityImage(
            array,
            Grid(array.shape, spacing.spacing, origin, direction),
            {
                "file": str(file),
                "format": format_of(file),
                "frame": frame,
                "notices": records(*(Notice.of("assumed", line) for line in notes)),
            },
        )
    except InputError as error:
        raise (skewed(file) if "orthonormal" in str(error) else InputError(f"{file}: {error}")) from None
