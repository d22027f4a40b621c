# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures as OpenEXR: single part, scan lines, float32, ZIP. Blender's Python has no EXR module, so we write our own.

Layout: "OpenEXR File Layout" of the OpenEXR documentation (version 2 files).
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

MAGIC = 20000630
VERSION = 2
FLOAT = 2  # pixel type
ZIP = 3  # compression: deflate over blocks of 16 lines
LINES_PER_BLOCK = 16
# CIE xy of red, green, blue and white of ITU-R BT.709
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)


def write_exr(
    path: Path, pixels: NDArray[np.float32], *, space: str = "", primaries: tuple[float, ...] = REC709
) -> None:
    """Write scene-linear `pixels`, float32 (height, width, 1, 3 or 4), first row at the top.

    They are Rec.709, or of the `primaries` (none: not said) or the `space` (a name of the Color Interop Forum) given.

    Raises
    ------
    ValueError
        If `pixels` has another number of channels.
    OSError
        If the file cannot be written.
    """
    height, width, count = pixels.shape
    if count not in (1, 3, 4):
        raise ValueError(f"an EXR picture has 1, 3 or 4 channels here, not {count}")
    # channels are stored in alphabetical order
    order = {1: [("Y", 0)], 3: [("B", 2), ("G", 1), ("R", 0)], 4: [("A", 3), ("B", 2), ("G", 1), ("R", 0)]}[count]
    lines = np.stack([pixels[:, :, index] for _, index in order], axis=1).astype("<f4")  # (height, channel, width)
    blocks = []
    for start in range(0, height, LINES_PER_BLOCK):
        raw = lines[start : start + LINES_PER_BLOCK].tobytes()
        packed = zlib.compress(_predict(raw), 4)
        blocks.append((start, packed if len(packed) < len(raw) else raw))
    header = _header(width, height, [name for name, _ in order], space, primaries)
    offset = len(header) + 8 * len(blocks)
    with path.open("wb") as file:
        file.write(header)
        for _, data in blocks:
            file.write(struct.pack("<Q", offset))
            offset += 8 + len(data)
        for start, data in blocks:
            file.write(struct.pack("<ii", start, len(data)) + data)


def _predict(raw: bytes) -> bytes:
    """Split even from odd bytes, then store differences: what deflate compresses well (ImfZip.cpp)."""
    data = np.frombuffer(raw, dtype=np.uint8)
    split = np.concatenate([data[0::2], data[1::2]]).astype(np.int16)
    split[1:] = split[1:] - split[:-1] + 128 + 256
    return split.astype(np.uint8).tobytes()


def _header(width: int, height: int, channels: list[str], space: str, primaries: tuple[float, ...]) -> bytes:
    window = struct.pack("<iiii", 0, 0, width - 1, height - 1)
    listed = b"".join(name.encode() + b"\0" + struct.pack("<iBxxxii", FLOAT, 0, 1, 1) for name in channels) + b"\0"
    attributes = [
        ("channels", "chlist", listed),
        *([("chromaticities", "chromaticities", struct.pack("<8f", *primaries))] if primaries else []),
        *([("colorInteropID", "string", space.encode("latin-1"))] if space else []),
        ("compression", "compression", bytes([ZIP])),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1.0)),
        ("screenWindowCenter", "v2f", struct.pack("<ff", 0.0, 0.0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1.0)),
    ]
    text = b"".join(
        name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(data)) + data
        for name, kind, data in attributes
    )
    return struct.pack("<ii", MAGIC, VERSION) + text + b"\0"
