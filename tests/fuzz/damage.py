"""Bytes, text and NIfTI headers in, damaged ones out; what was done, in words. All by a given random generator."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np

Random = np.random.Generator

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
