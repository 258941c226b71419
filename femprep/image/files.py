"""A path in; ITK's reader for it out where the file is whole, else one clear error.

ITK takes NIfTI files that are cut short without complaint, the missing slices as zeros, and does not look at the
checksums of compressed voxels in any format, so both are checked here before.
"""

from __future__ import annotations

import gzip
import math
import re
import struct
import zlib
from pathlib import Path
from typing import BinaryIO

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

#: Bytes that may follow the voxels of a NIfTI file: what is compressed can grow a thousandfold.
_BEHIND = 1 << 26

_REMEDY = "copy or convert the file again"


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


def require_whole(path: Path) -> str:
    """Check that a file is there, not empty, not cut short and, where compressed, has the right checksum.

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
        elif reader == "NrrdImageIO":
            _require_checksum(path, *_nrrd_data(path))
        else:
            _require_checksum(path, *_meta_data(path))
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
            length, expected = len(head), _nifti_bytes(head)
            while (block := stream.read(1 << 20)) and expected is not None:
                length += len(block)
                if length > expected + _BEHIND:
                    raise FileError(f"{path}: holds more than the {expected} bytes its header tells of; {_REMEDY}")
    except (EOFError, gzip.BadGzipFile, zlib.error) as error:
        raise FileError(f"{path}: damaged or cut short ({error}); {_REMEDY}") from None
    if expected is None:
        raise FileError(f"{path}: not a NIfTI file, or its header is damaged")
    if length < expected:
        raise FileError(f"{path}: cut short, {length} of {expected} bytes; {_REMEDY}")


def _nifti_bytes(head: bytes) -> int | None:
    """Number of bytes of the whole file by its header, NIfTI-1 or NIfTI-2 of either byte order."""
    for order in "<>":
        if len(head) >= 348 and struct.unpack_from(f"{order}i", head, 0)[0] == 348:
            sizes = struct.unpack_from(f"{order}8h", head, 40)
            bits = struct.unpack_from(f"{order}h", head, 72)[0]
            offset = struct.unpack_from(f"{order}f", head, 108)[0]
            break
        if len(head) >= 176 and struct.unpack_from(f"{order}i", head, 0)[0] == 540:
            sizes = struct.unpack_from(f"{order}8q", head, 16)
            bits = struct.unpack_from(f"{order}h", head, 14)[0]
            offset = struct.unpack_from(f"{order}q", head, 168)[0]
            break
    else:
        return None
    if not math.isfinite(offset) or not 1 <= sizes[0] <= 7 or any(n < 1 for n in sizes[1 : sizes[0] + 1]) or bits < 1:
        return None
    return int(offset) + math.prod(int(n) for n in sizes[1 : sizes[0] + 1]) * int(bits) // 8


def _nrrd_data(path: Path) -> tuple[Path, int, bool]:
    """File that holds the voxels, where they begin, whether they are compressed by gzip."""
    with open(path, "rb") as file:
        fields = {}
        while (line := file.readline(1 << 16)) and line.strip():
            key, _, value = line.decode("latin-1").partition(":")
            fields[key.strip().lower()] = value.strip()
        offset = file.tell()
    compressed = fields.get("encoding", "").lower() in ("gzip", "gz")
    detached = fields.get("data file") or fields.get("datafile")
    return (path.parent / detached, 0, compressed) if detached else (path, offset, compressed)


def _meta_data(path: Path) -> tuple[Path, int, bool]:
    """File that holds the voxels, where they begin, whether they are compressed by zlib."""
    compressed = False
    with open(path, "rb") as file:
        while line := file.readline(1 << 16):
            key, _, value = line.decode("latin-1").partition("=")
            if key.strip() == "CompressedData":
                compressed = value.strip().lower() == "true"
            if key.strip() == "ElementDataFile":
                name = value.strip()
                if name.upper() == "LOCAL":
                    return path, file.tell(), compressed
                return path.parent / name, 0, compressed
    return path, 0, False


def _require_checksum(path: Path, data: Path, offset: int, compressed: bool) -> None:
    """Decompress attached or detached voxels once; the stream's own checksum is compared on the way."""
    # A list or a pattern of several files is left to ITK.
    if re.search(r"%\d*d", data.name) or data.name.upper().startswith("LIST"):
        return
    if not data.is_file():
        raise FileError(f"{path}: its voxels should be in {data}, which does not exist; keep the two files together")
    if not compressed:
        return
    with open(data, "rb") as file:
        file.seek(offset)
        try:
            whole = _decompresses(file)
        except zlib.error as error:
            raise FileError(f"{path}: damaged ({error}); {_REMEDY}") from None
    if not whole:
        raise FileError(f"{path}: cut short, its compressed voxels end too early; {_REMEDY}")


def _decompresses(file: BinaryIO) -> bool:
    """Whether a gzip or zlib stream comes to its end."""
    stream = zlib.decompressobj(wbits=zlib.MAX_WBITS | 32)
    while block := file.read(1 << 20):
        stream.decompress(block)
        if stream.eof:
            return True
    return False
