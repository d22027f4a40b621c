# SPDX-License-Identifier: Apache-2.0
"""Radiance HDR files: four bytes a pixel, three mantissas and one exponent (G. Ward, Graphics Gems II, 1991)."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..types.errors import BadInputError
from ..types.image import Encoding, Image
from .colour_space import convert, to_rec709
from .picture_size import Size, check_declared_size

_SIZE = re.compile(rb"^([-+])([XY]) (\d+) ([-+])([XY]) (\d+)$")


def read_hdr(path: Path, size: Size | None = None) -> Image:
    """The scene-linear picture in a Radiance file of any of the eight orientations, run-length coded or flat.

    Colours of other primaries than Rec.709 are converted, with a note. An EXPOSURE is noted and not undone, as in
    Blender.

    Raises
    ------
    BadInputError
        If the file cannot be read, declares too large a size, or is not coded as RGBE.
    """
    data = path.read_bytes()
    try:
        header, body, (first, second) = _split(data)
    except ValueError as error:
        raise _damaged(path) from error
    if b"FORMAT=32-bit_rle_xyze" in header:
        raise BadInputError(f"Image {path.name!r} is coded as XYZ: export it as RGB.")
    (_, axis, lines), (_, _, columns) = first, second
    check_declared_size(path.name, (columns, lines) if axis == b"Y" else (lines, columns), size)
    try:
        rgbe = _upright(_decode(body, lines, columns), first, second)
    except (IndexError, ValueError) as error:
        raise _damaged(path) from error
    exponent = rgbe[..., 3].astype(np.int32)
    scale = np.where(exponent > 0, np.ldexp(np.float32(1), exponent - 136), 0).astype(np.float32)
    pixels, notes = rgbe[..., :3] * scale[..., None], []
    if (first[:2], second[:2]) != ((b"-", b"Y"), (b"+", b"X")):
        order = " ".join((sign + name).decode() for sign, name, _ in (first, second))
        notes.append(f"{path.name}: its lines run {order}; it was read upright, which Blender does not do.")
    primaries = [float(number) for number in _values(header, b"PRIMARIES")[-1:] for number in number.split()]
    if any(primaries):  # some programs write zeros
        matrix, space = to_rec709(path.name, {"chromaticities": primaries})
        if matrix is not None:
            pixels, note = convert(pixels, matrix, path.name, space)
            notes.append(note)
    exposure = np.prod([float(value) for value in _values(header, b"EXPOSURE")])
    if exposure != 1:
        notes.append(f"{path.name}: its header says that it was exposed by {exposure:.4g}, which was not undone.")
    return Image(pixels, Encoding.LINEAR, notes=tuple(notes))


def _values(header: bytes, name: bytes) -> list[bytes]:
    """What stands behind ``NAME=`` in the header, where it is numbers."""
    return re.findall(rb"^" + name + rb"=[ \t]*([-+.eE\d \t]*\d[. \t]*)\r?$", header, re.MULTILINE)


def _damaged(path: Path) -> BadInputError:
    return BadInputError(f"Image {path.name!r} cannot be read: the file is damaged or not a Radiance image.")


_Axis = tuple[bytes, bytes, int]  # sign, axis and count, as in the line "-Y 480 +X 640"


def _split(data: bytes) -> tuple[bytes, bytes, tuple[_Axis, _Axis]]:
    end = data.find(b"\n\n")
    line_end = data.find(b"\n", end + 2)
    if not data.startswith(b"#?") or end < 0 or line_end < 0:
        raise ValueError("no header")
    size = _SIZE.match(data[end + 2 : line_end].strip())
    if size is None or size[2] == size[5]:
        raise ValueError("no size")
    return data[:end], data[line_end + 1 :], ((size[1], size[2], int(size[3])), (size[4], size[5], int(size[6])))


def _upright(lines: NDArray[np.uint8], first: _Axis, second: _Axis) -> NDArray[np.uint8]:
    """Scan lines as rows from the top, each from the left; -Y and +X run that way."""
    usual = {b"Y": b"-", b"X": b"+"}
    if first[0] != usual[first[1]]:
        lines = lines[::-1]
    if second[0] != usual[second[1]]:
        lines = lines[:, ::-1]
    return lines if first[1] == b"Y" else np.swapaxes(lines, 0, 1)


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
