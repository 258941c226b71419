"""Shades or colours of pixels in, a picture for a page out: a PNG file as a ``data:`` address."""

from __future__ import annotations

import base64
import struct
import zlib

import numpy as np
import numpy.typing as npt

#: Kind of PNG by the number of channels: shades of grey; red, green, blue and opacity.
_KINDS = {1: 0, 4: 6}


def png_address(pixels: npt.NDArray[np.uint8]) -> str:
    """An array of pixels as the address of a PNG picture.

    Parameters
    ----------
    pixels : (rows, columns) or (rows, columns, 4) uint8 array
        Shades from black, 0, to white, 255; or red, green, blue and opacity.

    References
    ----------
    W3C, Portable Network Graphics, third edition, section 5: https://www.w3.org/TR/png-3
    """
    rows, columns = pixels.shape[:2]
    kind = _KINDS[pixels.shape[2] if pixels.ndim == 3 else 1]
    # Each row begins with the number of its filter: none.
    lines = np.pad(np.ascontiguousarray(pixels).reshape(rows, -1), ((0, 0), (1, 0)))
    chunks = [
        _chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, kind, 0, 0, 0)),
        _chunk(b"IDAT", zlib.compress(lines.tobytes(), 9)),
        _chunk(b"IEND", b""),
    ]
    return address(b"\x89PNG\r\n\x1a\n" + b"".join(chunks))


def address(png: bytes) -> str:
    """A PNG file as a ``data:`` address."""
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


def _chunk(name: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))
