"""PNG: lossless pictures (ISO/IEC 15948), 8 bits a channel."""

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from drkid.mesh import Floats

LEVEL = 9  # of zlib
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_TRUE_COLOUR = 2


def png_bytes(picture: Floats) -> bytes:
    """A picture (height, width, 3) with values in [0, 1] as PNG."""
    pixels = (255 * picture).round().astype(np.uint8)
    height, width, _ = pixels.shape
    header = struct.pack(">IIBBBBB", width, height, 8, _TRUE_COLOUR, 0, 0, 0)
    data = zlib.compress(_filtered(pixels).tobytes(), LEVEL)
    return _SIGNATURE + _chunk(b"IHDR", header) + _chunk(b"IDAT", data) + _chunk(b"IEND", b"")


def _filtered(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(height, 1 + 3 width): every row's filter, 2 for "less the row above", and its differences."""
    rows = pixels.reshape(len(pixels), -1)
    above = np.vstack([np.zeros_like(rows[:1]), rows[:-1]])
    return np.hstack([np.full((len(rows), 1), 2, np.uint8), rows - above])


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
