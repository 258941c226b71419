"""The first bytes of a NIfTI file in; what the whole file should hold, and whether its affines agree, out."""

from __future__ import annotations

import math
import struct
from typing import Final

import numpy as np

from femprep.model import FloatArray
from femprep.model.notice import spot

#: Bytes of the longest header, that of NIfTI-2.
LONGEST_HEADER: Final = 540
#: By the number that a header begins with, its own length: formats and places of the axes' lengths, the type and the
#: bits of a voxel, the offset of the voxels; of the codes, the quaternion with its offset, and the rows of the sform;
#: of the voxel sizes, behind the sign of the third axis.
_FIELDS: Final = {
    348: (("8h", 40), ("2h", 70), ("f", 108), ("2h", 252), ("6f", 256), ("12f", 280), ("4f", 76)),
    540: (("8q", 16), ("2h", 12), ("q", 168), ("2i", 344), ("6d", 352), ("12d", 400), ("4d", 104)),
}
#: Volume that axes span, over the product of their lengths, from which they are no axes: single precision leaves 1e-7.
_FLAT: Final = 1e-5
#: Degrees from which two poses differ: quaternions of single precision are off by .05.
_TURNED: Final = 0.5
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
    (qform, sform), quaternion, rows = found[3:6]
    asked = (*(rows if sform else ()), *(quaternion if qform else ()))
    return all(map(math.isfinite, asked))


def has_flat_axes(head: bytes) -> bool:
    """Whether the only affine of the header is an sform whose axes span no volume: one is 0, or two are parallel."""
    found, _ = _read(head)
    if not found or found[3][0] > 0 or found[3][1] <= 0:
        return False
    axes = np.array(found[5]).reshape(3, 4)[:, :3]
    return bool(np.abs(np.linalg.det(axes)) <= _FLAT * np.linalg.norm(axes, axis=0).prod())


def pose_note(head: bytes, origin: FloatArray, direction: FloatArray) -> str | None:
    """What to report where qform and sform put an image elsewhere; None where they agree or one of them is not there.

    Parameters
    ----------
    head : bytes
    origin, direction : (3,), (3, 3) array
        Place of the first voxel and axes as they were read, LPS.
    """
    found, _ = _read(head)
    if not found or min(found[3]) <= 0:
        return None
    quaternion, rows, (sign, *sizes) = found[4], np.array(found[5]).reshape(3, 4), found[6]
    b, c, d = quaternion[:3]
    a = math.sqrt(max(0.0, 1.0 - b * b - c * c - d * d))
    turn = 2.0 * np.outer((b, c, d), (b, c, d)) + (2.0 * a * a - 1.0) * np.eye(3)
    turn += 2.0 * a * np.array([[0.0, -d, c], [d, 0.0, -b], [-c, b, 0.0]])
    turn[:, 2] *= -1.0 if sign < 0 else 1.0
    other = rows[:, :3] / np.linalg.norm(rows[:, :3], axis=0)
    if not np.allclose(other.T @ other, np.eye(3), atol=1e-2):
        return None
    reach = np.array(sizes) * (np.array(found[0][1:4]) - 1) / 2.0
    middles = [turn @ reach + quaternion[3:], other @ reach + rows[:, 3]]
    # Where one mirrors the other: along the axis of the image that leaves the least to turn.
    mirrored = np.linalg.det(turn) * np.linalg.det(other) < 0
    ways = [np.diag(np.where(np.arange(3) == k, -1.0, 1.0)) if mirrored else np.eye(3) for k in range(3)]
    angle = min(math.degrees(math.acos(np.clip((np.trace(turn.T @ other @ way) - 1) / 2, -1.0, 1.0))) for way in ways)
    apart = float(np.linalg.norm(middles[1] - middles[0]))
    if not mirrored and angle < _TURNED and apart < 0.5 * min(sizes):
        return None
    lps, places = np.diag([-1.0, -1.0, 1.0]), (quaternion[3:], rows[:, 3])
    both = list(zip((turn, other), places, middles))
    away = [np.abs(lps @ axes - direction).max() + np.abs(lps @ place - origin).max() for axes, place, _ in both]
    shown = [f"axes to {_letters(axes)}, middle at {spot(lps @ middle)}" for axes, _, middle in both]
    return (
        f"qform ({shown[0]}) and sform ({shown[1]}) of the header disagree: {'mirrored, ' if mirrored else ''}turned "
        f"by {angle:.1f} degrees, {apart:.1f} mm apart; the {'qform' if away[0] < away[1] else 'sform'} was taken: set "
        "the code of the wrong one to 0"
    )


def _letters(axes: FloatArray) -> str:
    """Where the axes of an image lead most, as R, A, S or L, P, I."""
    return "".join(("RAS" if axis[k] > 0 else "LPI")[k] for axis in axes.T for k in [int(np.abs(axis).argmax())])


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
