"""Bytes of a file in, damaged ones out, for libFuzzer: numbers, words and lines, so that most of it stays well formed.

Random bytes seldom come past the first check of a reader (XML that is none, a gzip check sum that is wrong); what is
behind it is met by a file that is sound but for a number, a name or a line. A quarter is left to libFuzzer's own way.
"""

from __future__ import annotations

import gzip
import random
import re
import struct
import zlib
from collections.abc import Callable
from typing import Final
from xml.parsers import expat

from fuzz.damage import NUMBERS

_NUMBER: Final = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_WORD: Final = re.compile(rb"[A-Za-z_][A-Za-z_0-9:.]*")
#: What a whole number of a binary file is set to.
_WHOLE: Final = (0, 1, -1, 2, 127, 128, 255, 256, 32767, 65535, 1 << 20, (1 << 31) - 1, 1 << 31, 1 << 40, 1 << 62)
#: Half of all changes begin in so many bytes, where heads of files are.
_HEAD: Final = 1000
_GZIP: Final = b"\x1f\x8b"
#: How often XML is damaged anew until it is some; about one in ten then is none.
_TRIES: Final = 4

Random = random.Random
Own = Callable[[bytes, int], bytes]


class Damage:
    """Damaged bytes of one reader's files, as libFuzzer asks for them.

    Half begin with a sound file in place of what libFuzzer kept, most of which is refused at once. XML that is none is
    damaged anew up to three times.

    Parameters
    ----------
    sound : list of bytes
    own : callable
        libFuzzer's own way, of bytes and the most there may be.
    """

    def __init__(self, sound: list[bytes], own: Own) -> None:
        self.sound, self.own = sound, own

    def __call__(self, data: bytes, most: int, seed: int) -> bytes:
        chance = Random(seed)
        if chance.random() < 0.5:
            data = chance.choice(self.sound)
        if chance.random() < 0.25:
            return self.own(data[:most], most)
        if data[:2] == _GZIP:
            try:
                return gzip.compress(_changed(gzip.decompress(data), chance), 1)[:most]
            except (OSError, EOFError, zlib.error):
                return self.own(data[:most], most)
        for _ in range(_TRIES):
            other = _changed(data, chance)[:most]
            if data[:1] != b"<" or _well_formed(other):
                break
        return other


def _well_formed(data: bytes) -> bool:
    try:
        expat.ParserCreate().Parse(data, True)
    except (expat.ExpatError, LookupError, ValueError):
        return False
    return True


def _changed(data: bytes, chance: Random) -> bytes:
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        data = chance.choice(_WAYS)(data, chance)
    return data


def _place(data: bytes, chance: Random) -> int:
    return chance.randrange(max(len(data) if chance.random() < 0.5 else min(len(data), _HEAD), 1))


def _found(pattern: re.Pattern[bytes], data: bytes, chance: Random) -> re.Match[bytes] | None:
    return pattern.search(data, _place(data, chance))


def _number(data: bytes, chance: Random) -> bytes:
    """A number made another: a neighbour, one of the file, or one that programs stumble over."""
    one, way = _found(_NUMBER, data, chance), chance.random()
    if one is None:
        return data
    other = chance.choice(NUMBERS).encode()
    if way < 0.3 and (else_where := _found(_NUMBER, data, chance)):
        other = else_where[0]
    elif way < 0.6 and one[0].isdigit() and len(one[0]) < 20:
        other = str(int(one[0]) + chance.choice((-1, 1))).encode()
    return data[: one.start()] + other + data[one.end() :]


def _word(data: bytes, chance: Random) -> bytes:
    """A word made another of the file, left out, or doubled."""
    one, way = _found(_WORD, data, chance), chance.random()
    if one is None:
        return data
    other = one[0] + b" " + one[0] if way < 0.1 else b""
    if way > 0.3 and (else_where := _found(_WORD, data, chance)):
        other = else_where[0]
    return data[: one.start()] + other + data[one.end() :]


def _lines(data: bytes, chance: Random) -> bytes:
    """Some lines left out, doubled, or moved to another place; or the file cut off behind one."""
    first, count = data.rfind(b"\n", 0, _place(data, chance)) + 1, chance.choice((1, 1, 2, 5, 30))
    last = first
    for _ in range(count):
        last = data.find(b"\n", last) + 1 or len(data)
    some, rest, way = data[first:last], data[:first] + data[last:], chance.random()
    if way < 0.35:
        return rest
    if way < 0.4:
        return data[:last]
    at = data.rfind(b"\n", 0, _place(data, chance)) + 1
    return data[:at] + some + data[at:] if way < 0.7 else rest[:at] + some + rest[at:]


def _whole(data: bytes, chance: Random) -> bytes:
    """Two, four or eight bytes set to a whole number, or a real one."""
    form, size = chance.choice((("h", 2), ("i", 4), ("q", 8), ("f", 4), ("d", 8)))
    value = chance.choice(_WHOLE)
    raw = (
        struct.pack("<" + form, chance.choice((0.0, -1.0, float("nan"), float("inf"), 1e30, float(value & 255))))
        if form in "fd"
        else (value & ((1 << 8 * size) - 1)).to_bytes(size, "little")
    )
    at = _place(data, chance) // size * size
    return data[:at] + (raw[::-1] if chance.random() < 0.3 else raw) + data[at + size :]


def _block(data: bytes, chance: Random) -> bytes:
    """Some bytes copied to another place."""
    start, at, size = _place(data, chance), _place(data, chance), chance.choice((4, 8, 24, 100))
    return data[:at] + data[start : start + size] + data[at + size * chance.randrange(2) :]


_WAYS: Final = (_number, _number, _word, _lines, _whole, _block)
