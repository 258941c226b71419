"""Arrays in, the three files of an ADIOS2 file of the kind BP4 out: one step, one process, arrays whole.

Written here and not by ADIOS2: its package has no wheels for many machines, its files bear the time of writing, and on
a full disk it ends the process. What is written is what ADIOS2 2.12 writes of the same arrays of up to a million
numbers, byte for byte but for that time and its version (a test asks). The format:
https://adios2.readthedocs.io/en/latest/engines/engines.html#bp4; Godoy et al. 2020, SoftwareX 12:100561, DOI
10.1016/j.softx.2020.100561.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

#: Numbers of the types of ADIOS2.
_TYPES: Final = {np.dtype("<i8"): 4, np.dtype("<f8"): 6}
#: Numbers of what an index says of an array.
_OFFSET, _SIZES, _PAYLOAD, _FILE, _STEP, _RANGE = 3, 4, 6, 7, 8, 12
_HEADER, _VERSION = 64, "290"  # bytes; of ADIOS2, as it writes it


def bp4(arrays: Mapping[str, Any]) -> dict[str, bytes]:
    """The files of a BP4 folder by name.

    Parameters
    ----------
    arrays : mapping of str to (n,) int64 or float64 array

    Returns
    -------
    dict of str to bytes
        ``data.0``, ``md.0`` and ``md.idx``.

    Examples
    --------
    >>> from femprep.export.xdmf.bp4 import bp4
    >>> {name: len(content) for name, content in bp4({"f0_time": np.zeros(1)}).items()}
    {'data.0': 225, 'md.0': 243, 'md.idx': 128}
    """
    group = _text("group")
    lead = b"n" + group + struct.pack("<I", 0) + _text("1") + struct.pack("<IBHBH", 1, 1, 3, 2, 0)
    position = _HEADER + 4 + 8 + len(lead) + 4 + 8
    blocks, index = [], []
    for number, (name, values) in enumerate(arrays.items()):
        array = np.ascontiguousarray(values)
        kind, size = _TYPES[array.dtype], len(array)
        called = _text(name) + struct.pack("<HB", ord("K"), kind)
        limits = struct.pack("<BH", _RANGE, 1) + np.array([array.min(), array.max()]).tobytes()
        sizes = b"".join(b"n" + struct.pack("<Q", value) for value in (size, size, 0))
        block = struct.pack("<I", number) + called + struct.pack("<sBH", b"n", 1, len(sizes)) + sizes
        block += struct.pack("<BI", 1, len(limits)) + limits + b"\x04VMD]"
        payload = array.tobytes()
        blocks.append(b"[VMD" + struct.pack("<Q", 8 + len(block) + len(payload)) + block + payload)
        about = struct.pack("<BIBI", _STEP, 1, _FILE, 0)
        about += struct.pack("<BBH3Q", _SIZES, 1, 24, size, size, 0) + limits
        about += struct.pack("<BQBQ", _OFFSET, position, _PAYLOAD, position + 12 + len(block))
        entry = struct.pack("<IH", number, 0) + called + struct.pack("<QBI", 1, 6, len(about)) + about
        index.append(struct.pack("<I", len(entry)) + entry)
        position += len(blocks[-1])
    body = lead + _counted(blocks) + struct.pack("<IQ", 0, 0) + b"PGI]"
    place = group + b"n" + struct.pack("<I", 0) + _text("1") + struct.pack("<IQ", 1, _HEADER)
    first = struct.pack("<QQH", 1, 2 + len(place), len(place)) + place
    variables = _counted(index)
    ends = np.cumsum([_HEADER, len(first), len(variables), 12])
    return {
        "data.0": b"".join([_header("Data"), b"[PGI", struct.pack("<Q", 8 + len(body)), body]),
        "md.0": _header("Metadata") + first + variables + bytes(12),
        # Step, process, where each index begins and the last ends, the time (none), a reserve.
        "md.idx": _header("Index Table") + struct.pack("<8Q", 1, 0, *ends.tolist(), 0, 0),
    }


def _header(title: str) -> bytes:
    """Name and version, twice; little-endian; BP version 4; closed."""
    said = f"ADIOS-BP v{'.'.join(_VERSION)} {title}".encode()
    return said.ljust(32, b"\0") + (_VERSION.encode() + b"\0\0\x04").ljust(32, b"\0")


def _text(text: str) -> bytes:
    return struct.pack("<H", len(text)) + text.encode()


def _counted(blocks: list[bytes]) -> bytes:
    joined = b"".join(blocks)
    return struct.pack("<IQ", len(blocks), len(joined)) + joined
