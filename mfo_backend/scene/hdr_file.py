# SPDX-License-Identifier: Apache-2.0
"""Radiance HDR files: four bytes a pixel, three mantissas and one exponent (G. Ward, Graphics Gems II, 1991)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..types.errors import BadInputError
from ..types.image import Encoding, Image
from .picture_size import Size, check_declared_size

_SIZE = re.compile(rb"^-Y (\d+) \+X (\d+)$")


def read_hdr(path: Path, size: Size | None = None) -> Image:
    """The scene-linear picture in a Radiance file of the usual orientation (-Y +X), run-length coded or flat.

    Raises
    ------
    BadInputError
        If the file cannot be read, declares too large a size, or is not coded as RGBE.
    """
    data = path.read_bytes()
    try:
        header, body, (height, width) = _split(data)
    except ValueError as error:
        raise _damaged(path) from error
    if b"FORMAT=32-bit_rle_xyze" in header:
        raise BadInputError(f"Image {path.name!r} is coded as XYZ: export it as RGB.")
    check_declared_size(path.name, (width, height), size)
    try:
        rgbe = _decode(body, height, width)
    except (IndexError, ValueError) as error:
        raise _damaged(path) from error
    exponent = rgbe[..., 3].astype(np.int32)
    scale = np.where(exponent > 0, np.ldexp(np.float32(1), exponent - 136), 0).astype(np.float32)
    return Image(rgbe[..., :3] * scale[..., None], Encoding.LINEAR)


def _damaged(path: Path) -> BadInputError:
    return BadInputError(f"Image {path.name!r} cannot be read: the file is damaged or not a Radiance image.")


def _split(data: bytes) -> tuple[bytes, bytes, tuple[int, int]]:
    end = data.find(b"\n\n")
    line_end = data.find(b"\n", end + 2)
    if not data.startswith(b"#?") or end < 0 or line_end < 0:
        raise ValueError("no header")
    size = _SIZE.match(data[end + 2 : line_end].strip())
    if size is None:
        raise ValueError("no size")
    return data[:end], data[line_end + 1 :], (int(size[1]), int(size[2]))


def _decode(body: bytes, height: int, width: int) -> NDArray[np.uint8]:
    values = np.frombuffer(body, np.uint8)
    coded = 8 <= width < 32768 and values[:4].tolist() == [2, 2, width >> 8, width & 255]
    if not coded:
        return values[: height * width * 4].reshape(height, width, 4)
    out = np.empty((height, 4, width), np.uint8)
    position = 0
    for row in out:
        if body[position : position + 4] != bytes([2, 2, width >> 8, width & 255]):
            raise ValueError("scan line without its mark")
        position += 4
        for plane in row:
            position = _decode_plane(values, position, plane)
    return np.moveaxis(out, 1, 2)


def _decode_plane(values: NDArray[np.uint8], position: int, plane: NDArray[np.uint8]) -> int:
    column = 0
    while column < len(plane):
        count = int(values[position])
        if count > 128:  # a run of one value
            count -= 128
            run = values[position + 1 : position + 2]
            position += 2
        else:
            run = values[position + 1 : position + 1 + count]
            position += 1 + count
        if count == 0 or column + count > len(plane) or not run.size:
            raise ValueError("run beyond the scan line")
        plane[column : column + count] = run
        column += count
    return position
