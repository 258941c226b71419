"""A path in; ITK's reader for it out where the file is whole, else one clear error.

ITK takes NIfTI files that are cut short without complaint, the missing slices as zeros, and does not look at the
checksums of compressed voxels in any format, so both are checked here before.
"""

from __future__ import annotations

import gzip
import os
import re
import zlib
from pathlib import Path
from typing import BinaryIO

from femprep.errors import FileError, ResourceError
from femprep.image.reading.affine import FLAT
from femprep.image.reading.native import memory
from femprep.image.reading.nifti_header import LONGEST_HEADER, has_finite_affine, has_flat_axes, nifti_bytes
from femprep.image.reading.text_header import REMEDY, Voxels, meta_voxels, nrrd_voxels

#: ITK's reader by file name ending.
FORMATS = {
    ".nii": "NiftiImageIO",
    ".nii.gz": "NiftiImageIO",
    ".nrrd": "NrrdImageIO",
    ".nhdr": "NrrdImageIO",
    ".mha": "MetaImageIO",
    ".mhd": "MetaImageIO",
}

#: Bytes that may follow the voxels of a file: what is compressed can grow a thousandfold, and somewhat more.
_BEHIND = 1 << 26
_DENSEST = 1100
#: Bytes of a voxel, at the most, in formats that tell of them by a word.
_WIDEST = 16


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


def require_file(path: Path) -> None:
    """Check that a path is that of a file that can be opened.

    Raises
    ------
    FileError
    """
    if not path.exists():
        raise FileError(f"{path}: no such file")
    if path.is_dir():
        raise FileError(f"{path}: is a folder, expected an image file (DICOM series have to be converted first)")
    if not path.is_file():  # to open a pipe waits for whoever writes into it
        raise FileError(f"{path}: is no regular file, expected an image file")


def require_whole(path: Path) -> str:
    """Check that a file is there, not empty, not cut short and, where compressed, has the right checksum.

    Raises
    ------
    FileError
    ResourceError
        Its voxels do not fit into the memory.
    """
    require_file(path)
    reader = format_of(path)
    try:
        if path.stat().st_size == 0:
            raise FileError(f"{path}: file is empty")
        if reader == "NiftiImageIO":
            _require_whole_nifti(path)
        elif reader == "NrrdImageIO":
            _require_checksum(path, nrrd_voxels(path))
        else:
            _require_checksum(path, meta_voxels(path))
    except PermissionError:
        raise FileError(f"{path}: no permission to read it") from None
    except FileError:  # an OSError, too
        raise
    except OSError as error:  # of a name in the header that no file can have
        raise FileError(f"{path}: it or the file of its voxels cannot be read ({error.strerror}); {REMEDY}") from None
    return reader


def header_of(path: Path) -> bytes:
    """The first bytes of a NIfTI file, unpacked where it is compressed."""
    with open(path, "rb") as file:
        compressed = file.read(2) == b"\x1f\x8b"
    with gzip.open(path, "rb") if compressed else open(path, "rb") as stream:
        return stream.read(LONGEST_HEADER)


def _require_whole_nifti(path: Path) -> None:
    """Compare the number of bytes with what the header announces; decompressing also checks the checksum."""
    with open(path, "rb") as file:
        compressed = file.read(2) == b"\x1f\x8b"
        size = os.fstat(file.fileno()).st_size
    try:
        with gzip.open(path, "rb") if compressed else open(path, "rb") as stream:
            head = stream.read(LONGEST_HEADER)
            length, expected = len(head) if compressed else size, nifti_bytes(head)
            if expected is not None and expected > (_DENSEST if compressed else 1) * size:
                raise FileError(f"{path}: cut short, {size} bytes cannot hold the {expected} of its header; {REMEDY}")
            _require_room(path, expected or 0)
            while compressed and expected is not None and (block := stream.read(1 << 20)):
                length += len(block)
                if length > expected + _BEHIND:
                    raise FileError(f"{path}: holds more than the {expected} bytes its header tells of; {REMEDY}")
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        raise FileError(f"{path}: damaged or cut short ({error}); {REMEDY}") from None
    if expected is None:
        raise FileError(f"{path}: not a NIfTI file, or its header is damaged")
    if not has_finite_affine(head):
        raise FileError(f"{path}: its affine holds numbers that are not finite; mend the header")
    if has_flat_axes(head):
        raise FileError(f"{path}: {FLAT}")
    if length < expected:
        raise FileError(f"{path}: cut short, {length} of {expected} bytes; {REMEDY}")


def _require_room(path: Path, size: int) -> None:
    """Refuse what does not fit into the memory of the machine, before it is unpacked."""
    there = memory()
    if there is not None and size > there:
        raise ResourceError(
            f"{path}: its voxels are {size / 1e9:.3g} GB, and there are {there / 1e9:.3g} GB of memory; crop or "
            "resample the image"
        )


def _require_checksum(path: Path, voxels: Voxels) -> None:
    """Decompress attached or detached voxels once; the stream's own checksum is compared on the way."""
    # A list or a pattern of several files is left to ITK.
    if re.search(r"%\d*d", voxels.path.name) or voxels.path.name.upper().startswith("LIST"):
        return
    if not voxels.path.is_file():
        raise FileError(
            f"{path}: its voxels should be in {voxels.path}, which does not exist; keep the two files together"
        )
    size = voxels.path.stat().st_size - voxels.offset
    if voxels.number is not None and voxels.number > 8 * (_DENSEST if voxels.compressed else 1) * size:
        raise FileError(
            f"{path}: cut short, {size} bytes cannot hold the {voxels.number} voxels of its header; {REMEDY}"
        )
    if not voxels.compressed:
        return
    _require_room(path, voxels.number or 0)
    with open(voxels.path, "rb") as file:
        file.seek(voxels.offset)
        try:
            length, ended = _unpacked(
                file,
                size if voxels.room is None else voxels.room,
                None if voxels.number is None else _WIDEST * voxels.number + _BEHIND,
            )
        except zlib.error as error:
            raise FileError(f"{path}: damaged ({error}); {REMEDY}") from None
    if ended is None:
        raise FileError(f"{path}: holds more than the {voxels.number} voxels its header tells of; {REMEDY}")
    if not ended:
        raise FileError(f"{path}: cut short, its compressed voxels end too early; {REMEDY}")
    if length < voxels.least:
        raise FileError(f"{path}: cut short, its voxels are {length} bytes, expected {voxels.least}; {REMEDY}")


def _unpacked(file: BinaryIO, room: int, most: int | None) -> tuple[int, bool | None]:
    """Bytes of a gzip or zlib stream unpacked, and whether it ends within its room; None where it is too long."""
    stream, length = zlib.decompressobj(wbits=zlib.MAX_WBITS | 32), 0
    while room > 0 and (block := file.read(min(room, 1 << 20))):
        room -= len(block)
        while block:
            length += len(stream.decompress(block, 1 << 20))
            if stream.eof:
                return length, True
            if most is not None and length > most:
                return length, None
            block = stream.unconsumed_tail
    return length, False
