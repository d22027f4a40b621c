# SPDX-License-Identifier: GPL-3.0-or-later
"""What a picture file says about itself in its first bytes: format, size, depth. No bpy here, no pixels are read.

Sources: PNG third edition (W3C) 11.2.1; JPEG, ITU-T T.81 B.2.2; OpenEXR file layout; Radiance picture format; TIFF 6.0;
BMP, BITMAPINFOHEADER; EXIF 2.3 (orientation, tag 274).
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

START = 1 << 20  # bytes that are read; a JPEG may have thumbnails and profiles before its size
_PNG = b"\x89PNG\r\n\x1a\n"
_DIRECTORY = 4096  # bytes of a TIFF's first directory, of 12 an entry; cameras write some 40 entries
_STRAIGHT = 2  # of a TIFF's ExtraSamples: an alpha that colours are not multiplied by
_EXR_DEPTH = {0: "32-bit integer", 1: "16-bit float", 2: "32-bit float"}


@dataclass(frozen=True)
class PictureHeader:
    """Format and, where they were found, width and height in pixels (else 0) and the depth of a channel in words.

    `orientation` is EXIF's, 1 for as stored. `space` (a name of the Color Interop Forum) and `primaries` (CIE xy of
    red, green, blue and white) are what an OpenEXR says of its colours. `has_straight_alpha` is what a TIFF says.
    """

    kind: str
    width: int = 0
    height: int = 0
    depth: str = ""
    orientation: int = 1
    space: str = ""
    primaries: tuple[float, ...] = ()
    has_straight_alpha: bool = False


def read_header(path: Path) -> PictureHeader | None:
    """The header of a picture file, or None if it is none of the formats known here.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    with open(path, "rb") as file:
        data = _with_directory(file, file.read(START))
    try:
        for start, read in _READERS:
            if data.startswith(start):
                return read(data)
    except (struct.error, ValueError, IndexError):
        return None  # cut off or damaged; the backend says more
    return None


def is_cut_off(path: Path) -> bool:
    """Whether a PNG ends before its last chunk, as one does that is being written; of other formats False.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    with open(path, "rb") as file:
        if file.read(8) != _PNG:
            return False
        while len(chunk := file.read(8)) == 8:
            if chunk[4:] == b"IEND":
                return False
            file.seek(struct.unpack(">I", chunk[:4])[0] + 4, 1)  # and its checksum
    return True


def _with_directory(file: BinaryIO, data: bytes) -> bytes:
    """The same for all but a TIFF, whose directory may stand at its end: it is moved behind the first eight bytes."""
    order = {b"II*\0": "<", b"MM\0*": ">"}.get(data[:4])
    if order is None or len(data) < 8:
        return data
    file.seek(struct.unpack_from(order + "I", data, 4)[0])
    return data[:4] + struct.pack(order + "I", 8) + file.read(_DIRECTORY)


def _png(data: bytes) -> PictureHeader:
    width, height, bits = struct.unpack_from(">IIB", data, 16)
    at, orientation = 8, 1
    while at + 8 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        if data[at + 4 : at + 8] == b"eXIf":
            orientation = _orientation(data[at + 8 : at + 8 + length])
        at += length + 12
    return PictureHeader("PNG", width, height, f"{bits}-bit", orientation)


def _jpeg(data: bytes) -> PictureHeader:
    at, orientation = 2, 1
    while at + 9 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):  # a start of frame
            bits, height, width = struct.unpack_from(">BHH", data, at + 4)
            return PictureHeader("JPEG", width, height, f"{bits}-bit", orientation)
        if marker == 0xE1 and data[at + 4 : at + 10] == b"Exif\0\0":
            orientation = _orientation(data[at + 10 :])
        at += 2 + struct.unpack_from(">H", data, at + 2)[0]
    return PictureHeader("JPEG", orientation=orientation)


def _exr(data: bytes) -> PictureHeader:
    at, width, height, depth, space, primaries = 8, 0, 0, "", "", ()
    while data[at]:
        name, at = _text(data, at)
        _kind, at = _text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        at += 4
        if name == "displayWindow":  # its pixels beside the data are black, as the backend reads it
            left, top, right, bottom = struct.unpack_from("<4i", data, at)
            width, height = right - left + 1, bottom - top + 1
        elif name == "channels":
            depth = _EXR_DEPTH.get(struct.unpack_from("<i", data, _text(data, at)[1])[0], "")
        elif name == "colorInteropID":
            space = data[at : at + size].decode("latin-1")
        elif name == "chromaticities":
            primaries = struct.unpack_from("<8f", data, at)
        at += size
    return PictureHeader("OpenEXR", width, height, depth, space=space, primaries=primaries)


def _radiance(data: bytes) -> PictureHeader:
    sizes = data.split(b"\n\n", 1)[1].split(b"\n", 1)[0].split()
    found = {axis[-1:]: int(count) for axis, count in zip(sizes[::2], sizes[1::2], strict=True)}
    return PictureHeader("Radiance HDR", found[b"X"], found[b"Y"], "8-bit with exponent")


def _tiff(data: bytes) -> PictureHeader:
    values = _tags(data)
    size, straight = (values.get(256, 0), values.get(257, 0)), values.get(338) == _STRAIGHT
    return PictureHeader("TIFF", *size, orientation=values.get(274, 1), has_straight_alpha=straight)


def _orientation(exif: bytes) -> int:
    """1, as stored, where EXIF data say nothing or are damaged: a picture is not refused for its turn."""
    try:
        return _tags(exif).get(274, 1)
    except (struct.error, IndexError):
        return 1


def _tags(data: bytes) -> dict[int, int]:
    """The first value of each tag in the first directory of TIFF data."""
    order = "<" if data.startswith(b"II") else ">"
    (at,) = struct.unpack_from(order + "I", data, 4)
    values = {}
    for i in range(struct.unpack_from(order + "H", data, at)[0]):
        tag, kind, _count = struct.unpack_from(order + "HHI", data, at + 2 + 12 * i)
        (values[tag],) = struct.unpack_from(order + ("H" if kind == 3 else "I"), data, at + 10 + 12 * i)
    return values


def _bmp(data: bytes) -> PictureHeader:
    width, height = struct.unpack_from("<ii", data, 18)
    return PictureHeader("BMP", width, abs(height), "8-bit")


def _webp(data: bytes) -> PictureHeader | None:
    return PictureHeader("WebP", depth="8-bit") if data[8:12] == b"WEBP" else None


def _text(data: bytes, at: int) -> tuple[str, int]:
    """The zero-ended text at `at` and the place after it."""
    end = data.index(b"\0", at)
    return data[at:end].decode("latin-1"), end + 1


_READERS = (
    (_PNG, _png),
    (b"\xff\xd8", _jpeg),
    (b"\x76\x2f\x31\x01", _exr),
    (b"#?", _radiance),
    (b"II*\0", _tiff),
    (b"MM\0*", _tiff),
    (b"BM", _bmp),
    (b"RIFF", _webp),
)
