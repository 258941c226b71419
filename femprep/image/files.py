"""A path in; nothing out where the file is whole, else one clear error.

NIfTI files cut short are read by ITK without complaint, the missing slices as zeros, so they are checked here before.
"""

from __future__ import annotations

import gzip
import math
import struct
import zlib
from pathlib import Path

from femprep.errors import FileError

#: ITK's reader by file name ending.
FORMATS = {
    ".nii": "NiftiImageIO",
    ".nii.gz": "NiftiImageIO",
    ".nrrd": "NrrdImageIO",
    ".nhdr": "NrrdImageIO",
    ".mha": "MetaImageIO",
    ".mhd": "MetaImageIO",
}


def format_of(path: Path) -> str:
    """ITK's reader for a file name.

    Raises
    ------
    FileError
        The ending is not a known one.
    """
    name = path.name.lower()
    for ending in sorted(FORMATS, key=len, reverse=True):
        if name.endswith(ending):
            return FORMATS[ending]
    raise FileError(f"{path}: unknown image format; expected {', '.join(sorted(FORMATS))}")


def require_file(path: Path) -> str:
    """Check that a file is there, not empty and, for NIfTI, not cut short; return ITK's reader for it.

    Raises
    ------
    FileError
    """
    if not path.exists():
        raise FileError(f"{path}: no such file")
    if path.is_dir():
        raise FileError(f"{path}: is a folder, expected an image file (DICOM series have to be converted first)")
    reader = format_of(path)
    try:
        if path.stat().st_size == 0:
            raise FileError(f"{path}: file is empty")
        if reader == "NiftiImageIO":
            _require_whole_nifti(path)
    except PermissionError:
        raise FileError(f"{path}: no permission to read it") from None
    return reader


def _require_whole_nifti(path: Path) -> None:
    """Compare the number of bytes with what the header announces; decompressing also checks the checksum."""
    with open(path, "rb") as file:
        compressed = file.read(2) == b"\x1f\x8b"
    try:
        with gzip.open(path, "rb") if compressed else open(path, "rb") as stream:
            head = stream.read(352)
            length = len(head)
            while block := stream.read(1 << 20):
                length += len(block)
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        raise FileError(f"{path}: damaged or cut short ({error}); copy or convert the file again") from None
    expected = _nifti_bytes(head)
    if expected is None:
        raise FileError(f"{path}: not a NIfTI file, or its header is damaged")
    if length < expected:
        raise FileError(f"{path}: cut short, {length} of {expected} bytes; copy or convert the file again")


def _nifti_bytes(head: bytes) -> int | None:
    """Number of bytes of the whole file by its header, NIfTI-1 or NIfTI-2 of either byte order."""
    for order in "<>":
        if len(head) >= 348 and struct.unpack_from(f"{order}i", head, 0)[0] == 348:
            sizes = struct.unpack_from(f"{order}8h", head, 40)
            bits = struct.unpack_from(f"{order}h", head, 72)[0]
            offset = int(struct.unpack_from(f"{order}f", head, 108)[0])
            break
        if len(head) >= 176 and struct.unpack_from(f"{order}i", head, 0)[0] == 540:
            sizes = struct.unpack_from(f"{order}8q", head, 16)
            bits = struct.unpack_from(f"{order}h", head, 14)[0]
            offset = int(struct.unpack_from(f"{order}q", head, 168)[0])
            break
    else:
        return None
    if not 1 <= sizes[0] <= 7 or any(n < 1 for n in sizes[1 : sizes[0] + 1]) or bits < 1:
        return None
    voxels = math.prod(int(n) for n in sizes[1 : sizes[0] + 1])
    return offset + voxels * int(bits) // 8
