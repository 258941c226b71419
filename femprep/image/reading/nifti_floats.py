"""A NIfTI file of floats in; refused where voxels are NaN or infinite, which ITK reads as 0, the background."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Final

import numpy as np

from femprep.errors import FileError, InputError
from femprep.image.reading.nifti_header import LONGEST_HEADER, float_voxels
from femprep.image.reading.text_header import REMEDY

#: Voxels looked at in one go.
_BLOCK: Final = 1 << 22


def require_finite(path: Path, voxels: int, frame: int | None = None) -> None:
    """Check that the voxels of one frame are numbers; voxels of integers always are.

    Parameters
    ----------
    path : path
        A file that :func:`femprep.image.reading.files.require_whole` takes.
    voxels : int
        Of one frame.
    frame : int, optional
        From 1.

    Raises
    ------
    FileError, InputError
    """
    with open(path, "rb") as file:
        compressed = file.read(2) == b"\x1f\x8b"
    with gzip.open(path, "rb") if compressed else open(path, "rb") as stream:
        kind = float_voxels(stream.read(LONGEST_HEADER))
        if kind is None:
            return
        dtype, offset = np.dtype(kind[0]), kind[1]
        stream.seek(offset + dtype.itemsize * voxels * ((frame or 1) - 1))
        left, wrong = voxels, 0
        while left > 0:
            wanted = dtype.itemsize * min(left, _BLOCK)
            block = stream.read(wanted)
            if len(block) < wanted:  # the header's bits of a voxel are not those of its type
                raise FileError(f"{path}: cut short, its voxels are fewer bytes than their type needs; {REMEDY}")
            wrong += int(np.count_nonzero(~np.isfinite(np.frombuffer(block, dtype))))
            left -= _BLOCK
    if wrong:
        some = "1 voxel is no number" if wrong == 1 else f"{wrong} voxels are no numbers"
        raise InputError(
            f"{path}: {some} (NaN or infinite), so that it is no label map; write 0 where there is no label"
        )
