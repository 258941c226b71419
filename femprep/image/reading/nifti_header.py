"""The first bytes of a NIfTI file in; what the whole file should hold, and whether its affine is one, out."""

from __future__ import annotations

import math
import struct
from typing import Final

import numpy as np

#: Bytes of the longest header, that of NIfTI-2.
LONGEST_HEADER: Final = 540
#: By the number that a header begins with, its own length: formats and places of the axes' lengths, the type and the
#: bits of a voxel, the offset of the voxels; of the codes, the quaternion with its offset, and the rows of the sform.
_FIELDS: Final = {
    348: (("8h", 40), ("2h", 70), ("f", 108), ("2h", 252), ("6f", 256), ("12f", 280)),
    540: (("8q", 16), ("2h", 12), ("q", 168), ("2i", 344), ("6d", 352), ("12d", 400)),
}
#: Volume that axes span, over the product of their lengths, from which they are no axes: single precision leaves 1e-7.
_FLAT: Final = 1e-5
#: Types of voxels that can hold what is no number.
_FLOATS: Final = {16: "f4", 64: "f8"}


def nifti_bytes(head: bytes) -> int | None:
    """Number of bytes of the whole file by its header, NIfTI-1 or NIfTI-2 of either byte order; None of no header."""
    found, _ = _read(head)
    if not found:
        return None
    (axes, *lengths), (_, bits), (offset,) = found[:3]
    sizes = [int(n) for n in lengths[: int(axes)]]
    if not (math.isfinite(offset) and offset >= 0) or not 1 <= axes <= 7 or any(n < 1 for n in sizes) or bits < 1:
        return None
    return int(offset) + math.prod(sizes) * int(bits) // 8


def has_finite_affine(head: bytes) -> bool:
    """Whether the affines that the header says are there hold finite numbers; ITK does not come back from others."""
    found, _ = _read(head)
    if not found:
        return True
    (qform, sform), quaternion, rows = found[3:]
    asked = (*(rows if sform else ()), *(quaternion if qform else ()))
    return all(map(math.isfinite, asked))


def has_flat_axes(head: bytes) -> bool:
    """Whether the only affine of the header is an sform whose axes span no volume: one is 0, or two are parallel."""
    found, _ = _read(head)
    if not found or found[3][0] > 0 or found[3][1] <= 0:
        return False
    axes = np.array(found[5]).reshape(3, 4)[:, :3]
    return bool(np.abs(np.linalg.det(axes)) <= _FLAT * np.linalg.norm(axes, axis=0).prod())


def float_voxels(head: bytes) -> tuple[str, int] | None:
    """Type, with its byte order, and offset of voxels that are floats; None of others."""
    found, order = _read(head)
    if not found or found[1][0] not in _FLOATS:
        return None
    return order + _FLOATS[int(found[1][0])], int(found[2][0])


def _read(head: bytes) -> tuple[list[tuple[float, ...]], str]:
    """The fields, none of no header, and its byte order."""
    for length, fields in _FIELDS.items():
        for order in "<>":
            if len(head) >= length and struct.unpack_from(f"{order}i", head, 0)[0] == length:
                return [struct.unpack_from(f"{order}{kind}", head, place) for kind, place in fields], order
    return [], ""
