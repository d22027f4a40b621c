# SPDX-License-Identifier: Apache-2.0
"""PNG pictures with 16 bits a channel and several channels, which Pillow reads with 8.

References
----------
W3C Recommendation "Portable Network Graphics (PNG) Specification (Third Edition)", sections 5 (chunks), 8 (Adam7) and 9
(filters).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..types.errors import BadInputError
from .picture_size import Size, check_declared_size

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_CHANNELS = {2: 3, 4: 2, 6: 4}  # colour type to channels: RGB, grey with alpha, RGBA
# first column and row, and the distance to the next, of the seven pictures an interlaced file holds
_ADAM7 = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))


def deep_colour(path: Path, size: Size | None = None) -> NDArray[np.uint16] | None:
    """The picture (height, width, channels) of a PNG file, or None if it has not 16 bits in several channels.

    Two channels are grey and alpha, three colour, four colour and alpha.

    Raises
    ------
    BadInputError
        If such a file is damaged, too large, or declares another `size` (width, height).
    """
    data = path.read_bytes()
    if data[:8] != _SIGNATURE or data[12:16] != b"IHDR" or len(data) < 33:
        return None
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", data[16:29])
    if depth != 16 or colour not in _CHANNELS:
        return None
    check_declared_size(path.name, (width, height), size)
    channels = _CHANNELS[colour]
    passes = [(0, 0, 1, 1)] if not interlaced else _ADAM7
    sizes = [(-(-(width - x) // dx), -(-(height - y) // dy)) for x, y, dx, dy in passes]
    expected = sum(rows * (1 + 2 * channels * columns) for columns, rows in sizes if columns > 0 and rows > 0)
    try:
        # no more is unpacked than the picture holds, whatever the file says
        raw = zlib.decompressobj().decompress(b"".join(_image_data(data)), expected)
    except (zlib.error, struct.error):
        raw = b""
    if len(raw) < expected:
        raise BadInputError(f"Image {path.name!r} cannot be read: the file is damaged or not an image.")
    picture = np.empty((height, width, channels), np.uint16)
    start = 0
    for (x, y, dx, dy), (columns, rows) in zip(passes, sizes, strict=True):
        if columns > 0 and rows > 0:
            count = rows * (1 + 2 * channels * columns)
            lines = np.frombuffer(raw, np.uint8, count, start).reshape(rows, -1)
            if lines[:, 0].max() > 4:
                raise BadInputError(f"Image {path.name!r} cannot be read: the file is damaged or not an image.")
            unfiltered = _unfiltered(lines[:, 0], lines[:, 1:].reshape(rows, columns, 2 * channels))
            picture[y::dy, x::dx] = unfiltered.view(">u2")
            start += count
    return picture


def _image_data(data: bytes) -> Iterator[bytes]:
    """The contents of the IDAT chunks; raises `zlib.error` for one whose checksum is not its own."""
    at = 8
    while at + 8 <= len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind = data[at + 4 : at + 8]
        if kind == b"IEND":
            return
        if kind == b"IDAT":
            end = at + 8 + length
            if data[end : end + 4] != struct.pack(">I", zlib.crc32(data[at + 4 : end])):
                raise zlib.error("checksum")
            yield data[at + 8 : end]
        at += length + 12


def _unfiltered(kinds: NDArray[np.uint8], coded: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Bytes (rows, columns, bytes of a pixel) from their differences to neighbours; `kinds` is each row's filter.

    A pixel needs those to the left, above, and above to the left, so all pixels of one diagonal, from the lower left to
    the upper right, are made at once.
    """
    rows, columns, _ = coded.shape
    # a row and a column of zeros stand before the picture
    out = np.zeros((rows + 1, columns + 1, coded.shape[2]), np.int16)
    kind = kinds.astype(np.int64)[:, None]
    for diagonal in range(rows + columns - 1):
        y = np.arange(max(0, diagonal - columns + 1), min(rows, diagonal + 1))
        x = diagonal - y
        left, up, corner = out[y + 1, x], out[y, x + 1], out[y, x]
        estimate = left + up - corner
        to_left, to_up, to_corner = abs(estimate - left), abs(estimate - up), abs(estimate - corner)
        nearest = np.where((to_left <= to_up) & (to_left <= to_corner), left, np.where(to_up <= to_corner, up, corner))
        guess = np.choose(kind[y], np.stack([np.zeros_like(left), left, up, (left + up) >> 1, nearest]))
        out[y + 1, x + 1] = (coded[y, x] + guess) & 0xFF
    return np.ascontiguousarray(out[1:, 1:].astype(np.uint8))
