# SPDX-License-Identifier: Apache-2.0
"""PNG of 16 bits a channel: an encoder of the test with every filter, Pillow's high bytes, and libpng by Mitsuba."""

from __future__ import annotations

import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest
from PIL import Image as PillowImage

from mfo_backend.scene.image_file import read_image
from mfo_backend.scene.png_file import deep_colour
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding

COLOUR_TYPES = {2: 4, 3: 2, 4: 6}  # channels to PNG's colour type
ADAM7 = [(0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)]


def chunk(kind, content):
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def paeth(a, b, c):
    distances = [abs(b - c), abs(a - c), abs(a + b - 2 * c)]
    return (a, b, c)[distances.index(min(distances))]


def filtered(picture, kinds):
    """Rows of a picture (height, width, channels) of 16 bits, byte by byte as the specification has it."""
    step = 2 * picture.shape[2]
    above = bytes(picture.shape[1] * step)
    for row, kind in zip(picture.astype(">u2"), kinds, strict=False):
        line = row.tobytes()
        coded = bytearray([kind])
        for i, value in enumerate(line):
            a, c = (line[i - step], above[i - step]) if i >= step else (0, 0)
            b = above[i]
            coded.append((value - (0, a, b, (a + b) // 2, paeth(a, b, c))[kind]) % 256)
        yield bytes(coded)
        above = line


def write_png16(path, picture, *, kinds=None, interlaced=False, parts=1):
    height, width, channels = picture.shape
    kinds = kinds or [row % 5 for row in range(height)]
    grids = ADAM7 if interlaced else [(0, 0, 1, 1)]
    pictures = [picture[y::dy, x::dx] for x, y, dx, dy in grids]
    raw = b"".join(b"".join(filtered(p, kinds)) for p in pictures if p.size)
    data = zlib.compress(raw)
    pieces = [data[i * len(data) // parts : (i + 1) * len(data) // parts] for i in range(parts)]
    header = struct.pack(">IIBBBBB", width, height, 16, COLOUR_TYPES[channels], 0, 0, interlaced)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"tEXt", b"Title\0IDAT")
        + b"".join(chunk(b"IDAT", piece) for piece in pieces)
        + chunk(b"IEND", b"")
    )


def picture(height, width, channels, seed=0):
    """Smooth and random areas, so that every branch of every filter is taken."""
    rng = np.random.default_rng(seed)
    y, x, c = np.mgrid[:height, :width, :channels]
    smooth = (900 * x + 1700 * y + 5000 * c) % 65536
    return np.where(x < width // 2, smooth, rng.integers(0, 65536, (height, width, channels))).astype(np.uint16)


@pytest.mark.parametrize("interlaced", [False, True])
@pytest.mark.parametrize("channels", COLOUR_TYPES)
@pytest.mark.parametrize("size", [(13, 17), (1, 1), (1, 9), (9, 1), (5, 3)])
def test_every_bit_is_read(tmp_path, size, channels, interlaced):
    expected = picture(*size, channels)
    path = tmp_path / "a.png"
    write_png16(path, expected, interlaced=interlaced, parts=3)
    np.testing.assert_array_equal(deep_colour(path), expected)
    with PillowImage.open(path) as other:  # the file is one that others read, with 8 bits
        theirs = np.asarray(other.convert("RGBA"))
    np.testing.assert_array_equal(theirs[..., 0], expected[..., 0] >> 8)
    image = read_image(path)
    assert image.encoding is Encoding.SRGB
    colour = expected[..., :3] if channels > 2 else np.repeat(expected[..., :1], 3, axis=-1)
    np.testing.assert_array_equal(image.pixels, colour.astype(np.float32) / np.float32(65535))
    assert (image.alpha is None) == (channels == 3)
    if image.alpha is not None:
        np.testing.assert_array_equal(image.alpha, expected[..., -1].astype(np.float32) / np.float32(65535))


@pytest.mark.parametrize("kind", range(5))
def test_each_filter(tmp_path, kind):
    expected = picture(11, 14, 3, seed=kind)
    write_png16(tmp_path / "a.png", expected, kinds=[kind] * 11)
    np.testing.assert_array_equal(deep_colour(tmp_path / "a.png"), expected)


@pytest.mark.parametrize("channels", [3, 4])
def test_files_of_libpng(tmp_path, channels):
    """Mitsuba writes by libpng; in a process of its own, for its variant is a global."""
    expected = picture(31, 40, channels)
    np.save(tmp_path / "a.npy", expected)
    code = (
        "import mitsuba, numpy, sys; mitsuba.set_variant('scalar_rgb');"
        "mitsuba.Bitmap(numpy.load(sys.argv[1])).write(sys.argv[2])"
    )
    subprocess.run([sys.executable, "-c", code, tmp_path / "a.npy", tmp_path / "a.png"], check=True)
    np.testing.assert_array_equal(deep_colour(tmp_path / "a.png"), expected)


def test_other_files_are_left_to_pillow(tmp_path):
    PillowImage.new("RGB", (3, 2)).save(tmp_path / "a.png")
    assert deep_colour(tmp_path / "a.png") is None
    (tmp_path / "b.png").write_bytes(b"no picture")
    assert deep_colour(tmp_path / "b.png") is None


def damaged(path, change):
    write_png16(path, picture(9, 7, 3))
    path.write_bytes(change(path.read_bytes()))


@pytest.mark.parametrize(
    "change",
    [
        lambda data: data[: len(data) // 2],
        lambda data: data[:90] + bytes([data[90] ^ 1]) + data[91:],
        lambda data: data[:33],
        lambda data: data[:16] + struct.pack(">II", 1000, 1000) + data[24:],
    ],
    ids=["truncated", "flipped bit", "no data", "more pixels than data"],
)
def test_damaged_files_are_refused(tmp_path, change):
    damaged(tmp_path / "a.png", change)
    with pytest.raises(BadInputError, match="the file is damaged or not an image"):
        read_image(tmp_path / "a.png")


def test_an_unknown_filter_is_refused(tmp_path):
    raw = zlib.compress(bytes([7]) + bytes(6))
    header = struct.pack(">IIBBBBB", 1, 1, 16, 2, 0, 0, 0)
    chunks = chunk(b"IHDR", header) + chunk(b"IDAT", raw) + chunk(b"IEND", b"")
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)
    with pytest.raises(BadInputError, match="damaged"):
        read_image(tmp_path / "a.png")


@pytest.mark.parametrize("size", [(0, 9), (10**5, 10**5)])
def test_sizes_that_cannot_be_are_refused_unread(tmp_path, size):
    damaged(tmp_path / "a.png", lambda data: data[:16] + struct.pack(">II", *size) + data[24:])
    with pytest.raises(BadInputError, match=f"declares a size of {size[0]}x{size[1]}: "):
        read_image(tmp_path / "a.png")


def test_another_size_than_that_of_the_scene_is_refused(tmp_path):
    write_png16(tmp_path / "a.png", picture(3, 4, 3))
    assert read_image(tmp_path / "a.png", (4, 3)).width == 4
    with pytest.raises(BadInputError, match="Reference is 4x3 but the scene renders 3x4"):
        read_image(tmp_path / "a.png", (3, 4))
