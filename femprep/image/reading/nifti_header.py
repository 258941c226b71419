"""The first bytes of a NIfTI file in; what the whole file should hold, and whether its affine is one, out."""

from __future__ import annotations

import math
import struct
from typing import Final

#: Bytes of the longest header, that of NIfTI-2.
LONGEST_HEADER: Final = 540
#: By the number that a header begins with, its own length: formats and places of the axes' lengths, the bits of a
#: voxel, the offset of the voxels; of the codes, the quaternion with its offset, and the rows of the sform.
_FIELDS: Final = {
    348: (("8h", 40), ("h", 72), ("f", 108), ("2h", 252), ("6f", 256), ("12f", 280)),
    540: (("8q", 16), ("h", 14), ("q", 168), ("2i", 344), ("6d", 352), ("12d", 400)),
}


def nifti_bytes(head: bytes) -> int | None:
    """Number of bytes of the whole file by its header, NIfTI-1 or NIfTI-2 of either byte order; None of no header."""
    found = _read(head)
    if found is None:
        return None
    (axes, *lengths), (bits,), (offset,) = found[:3]
    sizes = [int(n) for n in lengths[: int(axes)]]
    if not (math.isfinite(offset) and offset >= 0) or not 1 <= axes <= 7 or any(n < 1 for n in sizes) or bits < 1:
        return None
    return int(offset) + math.prod(sizes) * int(bits) // 8


def has_finite_affine(head: bytes) -> bool:
    """Whether the affines that the header says are there hold finite numbers; ITK does not come back from others."""
    found = _read(head)
    if found is None:
        return True
    (qform, sform), quaternion, rows = found[3:]
    asked = (*(rows if sform else ()), *(quaternion if qform else ()))
    return all(map(math.isfinite, asked))


def _read(head: bytes) -> list[tuple[float, ...]] | None:
    for length, fields in _FIELDS.items():
        for order in "<>":
            if len(head) >= length and struct.unpack_from(f"{order}i", head, 0)[0] == length:
                return [struct.unpack_from(f"{order}{kind}", head, place) for kind, place in fields]
    return None
