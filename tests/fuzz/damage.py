"""Bytes, text and label maps in, damaged ones out; what was done, in words. All by a given random generator."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy import ndimage

Random = np.random.Generator
Labels = np.ndarray

#: Numbers that programs stumble over.
NUMBERS = (
    *("0", "-1", "1", "nan", "inf", "-inf", "1e300", "-1e300", "1e-300", "1e30", "1e-30", "2147483648", "-2147483648"),
    *("9223372036854775808", "1e5", "65536", "255", "0x10", "", "one", "1,5", "1 2", "--", "1" * 400),
)


def choose(random: Random, values: object) -> object:
    """One of some values."""
    values = list(values)  # type: ignore[call-overload]
    return values[int(random.integers(len(values)))]


def bytes_of(random: Random, data: bytes, first: int = 0, last: int | None = None) -> tuple[bytes, str]:
    """Bytes with some changed, cut off, put in or doubled."""
    end = len(data) if last is None else min(last, len(data))
    if end <= first:
        return data + b"\0", "a null at the end"
    out, way = bytearray(data), int(random.integers(6))
    if way <= 2:
        count = int(random.integers(1, 5 if way else 40))
        for place in random.integers(first, end, count):
            out[place] = int(random.integers(256)) if way else int(choose(random, (0, 0x7F, 0x80, 0xFF)))  # type: ignore[call-overload]
        return bytes(out), f"{count} bytes overwritten"
    place = int(random.integers(first, end))
    if way == 3:
        return bytes(out[:place]), f"cut off at byte {place} of {len(data)}"
    if way == 4:
        return bytes(out[:place]) + random.bytes(int(random.integers(1, 64))) + bytes(out[place:]), "bytes put in"
    length = int(random.integers(1, 200))
    return bytes(out[:place] + out[place : place + length] + out[place:]), f"{length} bytes doubled"


def text_of(random: Random, text: str) -> tuple[str, str]:
    """Text with a number replaced, a line dropped, doubled or swapped, or a word changed."""
    way = int(random.integers(5))
    if way <= 2 and (found := list(re.finditer(r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?", text))):
        one, other = choose(random, found), str(choose(random, NUMBERS))
        return text[: one.start()] + other + text[one.end() :], f"{one[0]!r} made {other[:20]!r}"  # type: ignore[attr-defined, index]
    lines = text.splitlines(keepends=True)
    at = int(random.integers(len(lines)))
    if way == 3:
        return "".join(lines[:at] + lines[at + 1 :]), f"line {at + 1} dropped"
    lines.insert(int(random.integers(len(lines))), lines[at])
    return "".join(lines), f"line {at + 1} doubled"


def file_of(random: Random, path: Path) -> str:
    """Damage one file in place: as text where it is one, half of the time; else as bytes."""
    data = path.read_bytes()
    if b"\0" not in data[:4000] and random.random() < 0.6:
        text, done = text_of(random, data.decode("latin-1"))
        path.write_bytes(text.encode("latin-1"))
        return done
    data, done = bytes_of(random, data)
    path.write_bytes(data)
    return done


#: Offset and form of fields of a NIfTI-1 header.
FIELDS = {
    "sizeof_hdr": (0, "i"),
    **{f"dim[{i}]": (40 + 2 * i, "h") for i in range(8)},
    "datatype": (70, "h"),
    "bitpix": (72, "h"),
    **{f"pixdim[{i}]": (76 + 4 * i, "f") for i in range(8)},
    "vox_offset": (108, "f"),
    "scl_slope": (112, "f"),
    "scl_inter": (116, "f"),
    "xyzt_units": (123, "B"),
    "qform_code": (252, "h"),
    "sform_code": (254, "h"),
    **{f"quatern_{c}": (256 + 4 * i, "f") for i, c in enumerate("bcd")},
    **{f"srow[{i}]": (280 + 4 * i, "f") for i in range(12)},
    "magic": (344, "i"),
}
_WHOLE = (0, 1, -1, 2, 3, 4, 7, 16, 64, 255, 512, 1792, 32767, -32768)
_REAL = (0.0, -0.0, 1.0, -1.0, 1e3, 1e-3, 1e6, 1e-6, 1e30, 1e-30, float("nan"), float("inf"), float("-inf"), 352.5)


def header_of(random: Random, data: bytes) -> tuple[bytes, str]:
    """A NIfTI-1 file with fields of its header set to values of another kind."""
    out, done = bytearray(data), []
    for _ in range(int(random.integers(1, 4))):
        name = str(choose(random, FIELDS))
        offset, form = FIELDS[name]
        value = choose(random, _REAL if form == "f" else _WHOLE)
        struct.pack_into(f"<{form}", out, offset, int(value) & 255 if form == "B" else value)  # type: ignore[call-overload]
        done.append(f"{name}={value}")
    return bytes(out), " ".join(done)


def _dropped(random: Random, labels: Labels) -> Labels:
    keep = random.random(labels.shape[2]) > 0.4
    keep[random.integers(labels.shape[2], size=2)] = True
    return labels[:, :, keep]


def _emptied(random: Random, labels: Labels) -> Labels:
    out = labels.copy()
    out[:, :, random.integers(labels.shape[2], size=int(random.integers(1, 4)))] = 0
    return out


def _shifted(random: Random, labels: Labels) -> Labels:
    out, reach = labels.copy(), int(choose(random, (2, 6, 20)))  # type: ignore[call-overload]
    for k in range(labels.shape[2]):
        out[:, :, k] = np.roll(labels[:, :, k], random.integers(-reach, reach + 1, 2), (0, 1))
    return out


def _swapped(random: Random, labels: Labels) -> Labels:
    a, b = random.choice(np.unique(labels), 2)
    return np.where(labels == a, b, np.where(labels == b, a, labels)).astype(labels.dtype)


def _thinned(random: Random, labels: Labels) -> Labels:
    number = random.choice(np.unique(labels)[1:])
    kept = ndimage.binary_erosion(labels == number, np.ones((3, 3, 1)), iterations=int(random.integers(1, 4)))
    return np.where((labels == number) & ~kept, 0, labels).astype(labels.dtype)


def _grown(random: Random, labels: Labels) -> Labels:
    number = random.choice(np.unique(labels)[1:])
    grown = ndimage.binary_dilation(labels == number, np.ones((3, 3, 1)), iterations=int(random.integers(1, 5)))
    return np.where(grown, number, labels).astype(labels.dtype)


def _bridged(random: Random, labels: Labels) -> Labels:
    out, number = labels.copy(), random.choice(np.unique(labels))
    a, b = (random.integers(0, labels.shape) for _ in range(2))
    for share in np.linspace(0.0, 1.0, 200):
        out[tuple(np.rint(a + share * (b - a)).astype(int))] = number
    return out


def _cropped(random: Random, labels: Labels) -> Labels:
    low = [int(random.integers(0, max(n // 3, 1))) for n in labels.shape]
    high = [n - int(random.integers(0, max(n // 3, 1))) for n in labels.shape]
    return labels[tuple(slice(a, max(b, a + 1)) for a, b in zip(low, high, strict=True))]


def _turned(random: Random, labels: Labels) -> Labels:
    return np.transpose(labels, random.permutation(3))


def _mirrored(random: Random, labels: Labels) -> Labels:
    return np.flip(labels, int(random.integers(3)))


def _speckled(random: Random, labels: Labels) -> Labels:
    share = float(choose(random, (0.001, 0.01, 0.1, 0.5)))  # type: ignore[arg-type]
    noise = random.integers(0, int(labels.max()) + 2, labels.shape)
    return np.where(random.random(labels.shape) < share, noise, labels).astype(labels.dtype)


def _few(random: Random, labels: Labels) -> Labels:
    first = int(random.integers(max(labels.shape[2] - 4, 1)))
    return labels[:, :, first : first + int(random.integers(1, 5))]


def _hollow(random: Random, labels: Labels) -> Labels:
    number = random.choice(np.unique(labels)[1:])
    core = ndimage.binary_erosion(labels == number, iterations=2)
    return np.where(core, 0, labels).astype(labels.dtype)


def _half(random: Random, labels: Labels) -> Labels:
    out, axis = labels.copy(), int(random.integers(3))
    np.moveaxis(out, axis, 0)[: labels.shape[axis] // 2] = int(random.integers(4))
    return out


def _coarse(random: Random, labels: Labels) -> Labels:
    step = int(random.integers(2, 6))
    return labels[::step, ::step]


#: What may be done to a label map, by name.
LABELS: dict[str, Callable[[Random, Labels], Labels]] = {
    "slices dropped": _dropped,
    "slices emptied": _emptied,
    "slices shifted": _shifted,
    "labels swapped": _swapped,
    "thinned": _thinned,
    "grown": _grown,
    "bridged": _bridged,
    "cropped": _cropped,
    "turned": _turned,
    "mirrored": _mirrored,
    "speckled": _speckled,
    "few slices": _few,
    "hollow": _hollow,
    "half gone": _half,
    "coarse": _coarse,
}
#: What voxel sizes are multiplied by.
SCALES = (1.0, 1.0, 1.0, 1.0, 1e3, 1e-3, 10.0, 0.1, 0.5, 2.0)
