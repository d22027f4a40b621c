# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading the uncompressed multilayer EXR files that Blender writes. Blender's Python has no EXR module.

Layout: "OpenEXR File Layout" of the OpenEXR documentation, single- and multi-part files of scan lines.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

MAGIC = 20000630
MULTIPART = 0x1000
TYPES = {0: "<u4", 1: "<f2", 2: "<f4"}  # by the number of the pixel type


@dataclass(frozen=True)
class _Part:
    channels: list[tuple[str, np.dtype]]
    left: int
    top: int
    width: int
    height: int

    @property
    def line_bytes(self) -> int:
        return self.width * sum(kind.itemsize for _, kind in self.channels)


def read_plain_exr(path: Path) -> dict[str, NDArray[np.float32]]:
    """Every channel by its full name, ``"ViewLayer.Combined.R"``: float32 (height, width), first row at the top.

    Raises
    ------
    ValueError
        If the file is no uncompressed EXR of scan lines.
    """
    data = path.read_bytes()
    magic, version = struct.unpack_from("<ii", data)
    if magic != MAGIC:
        raise ValueError(f"{path.name} is no EXR file")
    multipart = bool(version & MULTIPART)
    parts, at = [], 8
    while (multipart and data[at] != 0) or not parts:
        part, at = _header(data, at, path.name)
        parts.append(part)
    at += multipart  # the empty header that ends the list
    found: dict[str, NDArray[np.float32]] = {}
    for number, part in enumerate(parts):
        lines = _lines(data, at, part, number if multipart else None)
        at += 8 * part.height
        begin = 0
        for name, kind in part.channels:
            size = part.width * kind.itemsize
            values = np.ascontiguousarray(lines[:, begin : begin + size]).view(kind)
            found[name] = values.astype(np.float32)
            begin += size
    return found


def _lines(data: bytes, table: int, part: _Part, number: int | None) -> NDArray[np.uint8]:
    """The bytes of each scan line, (height, line bytes)."""
    lines = np.empty((part.height, part.line_bytes), np.uint8)
    head = 8 if number is None else 12  # row and size, after the part's number
    for offset in struct.unpack_from(f"<{part.height}Q", data, table):
        row, size = struct.unpack_from("<ii", data, offset + head - 8)
        if size != part.line_bytes:
            raise ValueError("a scan line is compressed or cut off")
        lines[row - part.top] = np.frombuffer(data, np.uint8, size, offset + head)
    return lines


def _header(data: bytes, at: int, name: str) -> tuple[_Part, int]:
    attributes: dict[str, bytes] = {}
    while data[at] != 0:
        key, at = _text(data, at)
        _, at = _text(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        attributes[key] = data[at + 4 : at + 4 + size]
        at += 4 + size
    if attributes["compression"] != b"\0":
        raise ValueError(f"{name} is compressed")
    left, top, right, bottom = struct.unpack("<iiii", attributes["dataWindow"])
    channels, place = [], 0
    listed = attributes["channels"]
    while listed[place] != 0:
        channel, place = _text(listed, place)
        (kind,) = struct.unpack_from("<i", listed, place)
        channels.append((channel, np.dtype(TYPES[kind])))
        place += 16
    return _Part(channels, left, top, right - left + 1, bottom - top + 1), at + 1


def _text(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(b"\0", at)
    return data[at:end].decode("utf-8"), end + 1
