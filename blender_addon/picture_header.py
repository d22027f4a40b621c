# SPDX-License-Identifier: GPL-3.0-or-later
"""What a picture file says about itself in its first bytes: format, size, depth. No bpy here, no pixels are read.

Sources: PNG third edition (W3C) 11.2.1; JPEG, ITU-T T.81 B.2.2; OpenEXR file layout; Radiance picture format; TIFF 6.0;
BMP, BITMAPINFOHEADER.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

START = 65536  # bytes that are read; the size stands in the first kilobytes but for large thumbnails in a JPEG
_EXR_DEPTH = {0: "32-bit integer", 1: "16-bit float", 2: "32-bit float"}


@dataclass(frozen=True)
class PictureHeader:
    """Format and, where they were found, width and height in pixels (else 0) and the depth of a channel in words."""

    kind: str
    width: int = 0
    height: int = 0
    depth: str = ""


def read_header(path: Path) -> PictureHeader | None:
    """The header of a picture file, or None if it is none of the formats known here.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    with open(path, "rb") as file:
        data = file.read(START)
    try:
        for start, read in _READERS:
            if data.startswith(start):
                return read(data)
    except (struct.error, ValueError, IndexError):
        return None  # cut off or damaged; the backend says more
    return None


def _png(data: bytes) -> PictureHeader:
    width, height, bits = struct.unpack_from(">IIB", data, 16)
    return PictureHeader("PNG", width, height, f"{bits}-bit")


def _jpeg(data: bytes) -> PictureHeader:
    at = 2
    while data[at] == 0xFF:
        marker = data[at + 1]
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):  # a start of frame
            bits, height, width = struct.unpack_from(">BHH", data, at + 4)
            return PictureHeader("JPEG", width, height, f"{bits}-bit")
        at += 2 + struct.unpack_from(">H", data, at + 2)[0]
    return PictureHeader("JPEG")


def _exr(data: bytes) -> PictureHeader:
    at, width, height, depth = 8, 0, 0, ""
    while data[at]:
        name, at = _text(data, at)
        _kind, at = _text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        at += 4
        if name == "dataWindow":
            left, top, right, bottom = struct.unpack_from("<4i", data, at)
            width, height = right - left + 1, bottom - top + 1
        elif name == "channels":
            depth = _EXR_DEPTH.get(struct.unpack_from("<i", data, _text(data, at)[1])[0], "")
        at += size
    return PictureHeader("OpenEXR", width, height, depth)


def _radiance(data: bytes) -> PictureHeader:
    sizes = data.split(b"\n\n", 1)[1].split(b"\n", 1)[0].split()
    found = {axis[-1:]: int(count) for axis, count in zip(sizes[::2], sizes[1::2], strict=True)}
    return PictureHeader("Radiance HDR", found[b"X"], found[b"Y"], "8-bit with exponent")


def _tiff(data: bytes) -> PictureHeader:
    order = "<" if data.startswith(b"II") else ">"
    (at,) = struct.unpack_from(order + "I", data, 4)
    values = {}
    for i in range(struct.unpack_from(order + "H", data, at)[0]):
        tag, kind, _count = struct.unpack_from(order + "HHI", data, at + 2 + 12 * i)
        (values[tag],) = struct.unpack_from(order + ("H" if kind == 3 else "I"), data, at + 10 + 12 * i)
    return PictureHeader("TIFF", values.get(256, 0), values.get(257, 0))


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
    (b"\x89PNG\r\n\x1a\n", _png),
    (b"\xff\xd8", _jpeg),
    (b"\x76\x2f\x31\x01", _exr),
    (b"#?", _radiance),
    (b"II*\0", _tiff),
    (b"MM\0*", _tiff),
    (b"BM", _bmp),
    (b"RIFF", _webp),
)
