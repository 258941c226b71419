"""Masks in files of their own in, a Segmentation out, as TotalSegmentator and others leave them."""

from __future__ import annotations

import logging
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from femprep.errors import InputError, OptionError
from femprep.image.grid import Grid
from femprep.image.reading.affine import sizes
from femprep.image.reading.reader import NoLabelError, read_segmentation
from femprep.image.reading.segments import merged_masks
from femprep.image.segmentation import Segmentation, count_labels
from femprep.model import BoolArray, Notice, records
from femprep.options import ImageOptions, choose, takes

log = logging.getLogger(__name__)


@takes(ImageOptions)
def read_masks(
    masks: Mapping[str, str | os.PathLike[str] | Sequence[str | os.PathLike[str]]],
    options: ImageOptions | None = None,
    **changes: Any,
) -> Segmentation:
    """Read structures that stand in files of their own, one mask or several for each, as TotalSegmentator writes them.

    Parameters
    ----------
    masks : mapping of str to path or several paths
        Files by structure: every voxel that is not 0 belongs to it.
    options, **changes
        As for :func:`read_segmentation`.

    Returns
    -------
    Segmentation
        Where masks overlap a voxel is the smaller structure's, which the notices say.

    Raises
    ------
    FileError
        A file is missing, damaged or of an unknown format.
    InputError
        The masks do not lie on the same grid, or one is empty.

    Examples
    --------
    >>> fp.read_masks({"lv": "left_ventricle.nii.gz", "myo": "myocardium.nii.gz"})  # doctest: +SKIP
    Segmentation(...)
    """
    chosen = choose(ImageOptions, options, changes)
    if not masks:
        raise OptionError("no masks: give a file by structure, as in lv=left_ventricle.nii.gz")
    found: dict[str, BoolArray] = {}
    first: Segmentation | None = None
    said: list[Any] = []
    for name, files in masks.items():
        for file in [files] if isinstance(files, str | os.PathLike) else list(files):
            try:
                one = read_segmentation(file, {"mask": 1}, options=chosen)
            except NoLabelError:
                raise InputError(
                    f"mask {name!r}, {Path(file).name}, is empty; check the file, or leave it out"
                ) from None
            if first is None:
                first = one
                said += one.info["notices"]
            elif reason := _other_grid(first.grid, one.grid):
                raise InputError(f"mask {name!r}, {Path(file).name}, lies on another grid than the first one: {reason}")
            found[name] = found[name] | (one.labels != 0) if name in found else one.labels != 0
    assert first is not None
    labels, names, overlaps = merged_masks(found)
    for line in overlaps:
        log.info("%s", line)
    count = count_labels(labels)
    info = {
        **first.info,
        "file": ", ".join(f"{name}={file}" for name, file in masks.items()),
        "labels": {str(n): c for n, c in count.items()},
        "absent": {name: [] for name in names},
        "notices": [*said, *records(*(Notice.of("assumed", line) for line in overlaps))],
    }
    return Segmentation(labels, first.grid, names, info)


def _other_grid(one: Grid, other: Grid) -> str | None:
    """In what two grids differ; None where they are the same."""
    if one.shape != other.shape:
        return f"{' x '.join(map(str, other.shape))} voxels, not {' x '.join(map(str, one.shape))}"
    for what, a, b in (("voxel sizes", one.spacing, other.spacing), ("origin", one.origin, other.origin)):
        if not np.allclose(a, b, atol=1e-3):
            return f"{what} {sizes(b)} mm, not {sizes(a)} mm"
    return None if np.allclose(one.direction, other.direction, atol=1e-4) else "other directions of its axes"
