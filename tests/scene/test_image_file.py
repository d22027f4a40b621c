# SPDX-License-Identifier: Apache-2.0
"""Picture files: what every kind means. What cannot be used is in test_unusable_images.py."""

from __future__ import annotations

import struct

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PillowImage
from PIL import ImageCms

from mfo_backend.scene.image_file import read_image, write_exr, write_png
from mfo_backend.scene.picture_kind import SHOWN
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding

COMPRESSIONS = ["NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "DWAA"]
LOSSY = {"PXR24": 2e-5, "B44": 0.02, "DWAA": 0.02}  # of their definitions: 24-bit floats, 4x4 blocks, DCT


def picture(height=9, width=7):
    y, x, c = np.mgrid[:height, :width, :3]
    return (0.2 + x / width + 0.5 * y / height + 0.1 * c).astype(np.float32)


def write_parts(path, *parts, **header):
    header = {"type": OpenEXR.scanlineimage, **header}
    made = [OpenEXR.Part(dict(header), channels, name=f"p{i}") for i, channels in enumerate(parts)]
    OpenEXR.File(made).write(str(path))


def test_exr_round_trip_keeps_every_bit(tmp_path):
    pixels = picture()
    pixels[0, 0] = (-3.5, 1e-30, 6e4)
    write_exr(tmp_path / "a.exr", pixels)
    image = read_image(tmp_path / "a.exr")
    assert image.encoding is Encoding.LINEAR
    assert image.alpha is None
    np.testing.assert_array_equal(image.pixels, pixels)


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
@pytest.mark.parametrize("compression", COMPRESSIONS)
def test_exr_of_any_compression_and_depth(tmp_path, compression, dtype):
    pixels = picture(40, 33).astype(dtype)
    header = {"compression": getattr(OpenEXR, f"{compression}_COMPRESSION"), "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": pixels}).write(str(tmp_path / "a.exr"))
    tolerance = LOSSY.get(compression, 0)
    np.testing.assert_allclose(read_image(tmp_path / "a.exr").pixels, pixels.astype(np.float32), rtol=tolerance)


def channels(prefix, pixels, alpha=None):
    named = {f"{prefix}{c}": np.ascontiguousarray(pixels[..., i]) for i, c in enumerate("RGB")}
    return named if alpha is None else {**named, f"{prefix}A": alpha}


@pytest.mark.parametrize(
    ("parts", "expected"),
    [
        (lambda p, q: [channels("", p)], 0),
        (lambda p, q: [channels("ViewLayer.Combined.", p) | {"ViewLayer.Depth.Z": p[..., 0].copy()}], 0),
        (lambda p, q: [channels("ViewLayer.AO.", q) | channels("ViewLayer.Combined.", p)], 0),
        (lambda p, q: [channels("Composite.Combined.", q), channels("", p)], 0),
        (lambda p, q: [{"Depth.Z": q[..., 0].copy()}, channels("ViewLayer.Combined.", p)], 0),
        (lambda p, q: [channels("diffuse.", p)], 0),
        (lambda p, q: [{"Y": p[..., 0].copy()}], None),
    ],
    ids=["plain", "blender", "combined before another pass", "plain part first", "second part", "any layer", "grey"],
)
def test_exr_layers_and_parts(tmp_path, parts, expected):
    wanted, other = picture(), picture() * 7
    write_parts(tmp_path / "a.exr", *parts(wanted, other))
    pixels = read_image(tmp_path / "a.exr").pixels
    if expected is None:
        wanted = np.repeat(wanted[..., :1], 3, axis=-1)
    np.testing.assert_array_equal(pixels, wanted)


def test_exr_alpha_and_tiles(tmp_path):
    alpha = picture()[..., 0] / 2
    tile = OpenEXR.TileDescription()
    tile.xSize = tile.ySize = 16
    write_parts(tmp_path / "a.exr", channels("", picture(), alpha), type=OpenEXR.tiledimage, tiles=tile)
    image = read_image(tmp_path / "a.exr")
    np.testing.assert_array_equal(image.alpha, alpha)
    np.testing.assert_array_equal(image.pixels, picture())


def test_exr_data_window_is_placed_in_the_display_window(tmp_path):
    window = lambda x0, y0, x1, y1: (np.array([x0, y0], np.int32), np.array([x1, y1], np.int32))  # noqa: E731
    write_parts(
        tmp_path / "a.exr", channels("", picture(3, 4)), dataWindow=window(2, 1, 5, 3), displayWindow=window(0, 0, 4, 4)
    )
    pixels = read_image(tmp_path / "a.exr").pixels
    assert pixels.shape == (5, 5, 3)
    np.testing.assert_array_equal(pixels[1:4, 2:5], picture(3, 4)[:, :3])
    assert pixels.sum() == pytest.approx(picture(3, 4)[:, :3].sum())


def test_png_is_display_values(tmp_path):
    levels = np.arange(4 * 5 * 3, dtype=np.uint8).reshape(4, 5, 3) * 4
    write_png(tmp_path / "a.png", levels / 255)
    image = read_image(tmp_path / "a.png")
    assert image.encoding is Encoding.SRGB
    assert image.alpha is None
    np.testing.assert_allclose(image.pixels, levels / np.float32(255), rtol=0, atol=6e-8)  # one rounding to float32


def _levels(path):
    with PillowImage.open(path) as picture:
        return np.asarray(picture)


def test_write_png_clips_and_takes_grey(tmp_path):
    write_png(tmp_path / "a.png", np.array([[-1.0, 2.0, np.nan]]))
    np.testing.assert_array_equal(_levels(tmp_path / "a.png"), [[0, 255, 0]])


@pytest.mark.parametrize(("suffix", "tolerance"), [("png", 0), ("tif", 0), ("jpg", 0.03)])  # JPEG is lossy
@pytest.mark.parametrize("mode", ["RGB", "L"])
def test_display_files(tmp_path, suffix, tolerance, mode):
    grey = np.full((16, 16), 128, np.uint8)
    source = PillowImage.fromarray(grey if mode == "L" else np.stack([grey, grey // 2, grey], -1))
    source.save(tmp_path / f"a.{suffix}", quality=95)
    pixels = read_image(tmp_path / f"a.{suffix}").pixels
    green = 128 if mode == "L" else 64
    np.testing.assert_allclose(pixels[8, 8] * 255, [128, green, 128], rtol=1e-6, atol=tolerance * 255)


def test_png_alpha_palette_and_16_bit_grey(tmp_path):
    PillowImage.fromarray(np.full((2, 2, 4), 51, np.uint8)).save(tmp_path / "rgba.png")
    np.testing.assert_allclose(read_image(tmp_path / "rgba.png").alpha, 0.2, rtol=1e-6)
    PillowImage.new("P", (2, 2)).save(tmp_path / "palette.png")
    assert read_image(tmp_path / "palette.png").pixels.max() == 0
    PillowImage.fromarray(np.full((2, 2), 12345, np.uint16)).save(tmp_path / "deep.png")
    np.testing.assert_allclose(read_image(tmp_path / "deep.png").pixels, 12345 / 65535, rtol=1e-6)


@pytest.mark.parametrize("coded", [True, False])
def test_radiance(tmp_path, coded):
    """Mantissas 128, 64, 32 with exponent 129 are 1, 0.5, 0.25 times two; a zero exponent is black."""
    pixel, black = bytes([128, 64, 32, 129]), bytes(4)
    if coded:
        planes = [bytes([128 + 7, p, 1, b]) for p, b in zip(pixel, black, strict=True)]
        line = bytes([2, 2, 0, 8]) + b"".join(planes)
    else:
        line = pixel * 7 + black
    data = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n" + 2 * line
    (tmp_path / "a.hdr").write_bytes(data)
    image = read_image(tmp_path / "a.hdr")
    assert image.encoding is Encoding.LINEAR
    np.testing.assert_array_equal(image.pixels[1, 6], [1, 0.5, 0.25])
    np.testing.assert_array_equal(image.pixels[1, 7], 0)
    (tmp_path / "b.hdr").write_bytes(data[:-5])
    with pytest.raises(BadInputError, match=r"'b\.hdr' cannot be read: the file is damaged"):
        read_image(tmp_path / "b.hdr")


@pytest.mark.parametrize("size_line", [f"{a}Y 3 {b}X 9" for a in "-+" for b in "-+"] + ["+X 9 -Y 3", "-X 9 +Y 3"])
def test_radiance_of_any_orientation(tmp_path, size_line):
    """Every pixel of the file is written at the place that its line names."""
    levels = np.arange(1, 28, dtype=np.uint8).reshape(3, 9) * 4
    (first, _), (second, _) = (size_line.split()[i : i + 2] for i in (0, 2))
    rows = levels if first[0] == {"Y": "-", "X": "+"}[first[1]] else np.flip(levels, 0 if first[1] == "Y" else 1)
    rows = rows if second[0] == {"Y": "-", "X": "+"}[second[1]] else np.flip(rows, 0 if second[1] == "Y" else 1)
    lines = rows if first[1] == "Y" else rows.T
    body = b"".join(bytes([v, v, v, 136]) for v in lines.ravel())
    (tmp_path / "a.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + size_line.encode() + b"\n" + body)
    image = read_image(tmp_path / "a.hdr")
    np.testing.assert_array_equal(image.pixels[..., 1], levels)
    assert bool(image.notes) == (size_line != "-Y 3 +X 9")


def test_radiance_header_of_exposure_and_primaries(tmp_path):
    def read(line):
        head = b"#?RADIANCE\n" + line + b"FORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n"
        (tmp_path / "a.hdr").write_bytes(head + bytes([100, 50, 25, 136]))
        return read_image(tmp_path / "a.hdr")

    plain = read(b"")
    assert plain.notes == ()
    assert read(b"PRIMARIES= 0 0 0 0 0 0 0 0\nEXPOSURE=1.0\n").notes == ()
    exposed = read(b"EXPOSURE=2\nEXPOSURE= 4.0\n")
    np.testing.assert_array_equal(exposed.pixels, plain.pixels)
    assert exposed.notes == ("a.hdr: its header says that it was exposed by 8, which was not undone.",)
    wide = read(b"PRIMARIES= .708 .292 .170 .797 .131 .046 .3127 .3290\n")
    assert wide.pixels[0, 0, 0] > plain.pixels[0, 0, 0]
    assert "converted from the primaries in its header" in wide.notes[0]


@pytest.mark.parametrize("suffix", [".webp", ".bmp"])
def test_webp_and_bmp(tmp_path, suffix):
    levels = np.random.default_rng(0).integers(0, 256, (5, 7, 3), np.uint8)
    PillowImage.fromarray(levels).save(tmp_path / f"a{suffix}", **({"lossless": True} if suffix == ".webp" else {}))
    np.testing.assert_allclose(read_image(tmp_path / f"a{suffix}").pixels * 255, levels, atol=1e-4)


@pytest.mark.parametrize("orientation", range(2, 9))
@pytest.mark.parametrize("suffix", [".jpg", ".png", ".tif", ".webp"])
def test_exif_orientation_is_said_and_left(tmp_path, suffix, orientation):
    turned = PillowImage.Exif()
    turned[274] = orientation
    levels = np.zeros((16, 32, 3), np.uint8)
    levels[8:, :16] = 255
    PillowImage.fromarray(levels).save(tmp_path / f"a{suffix}", exif=turned)
    image = read_image(tmp_path / f"a{suffix}", (32, 16))
    np.testing.assert_allclose(image.pixels * 255, levels, atol=12)  # JPEG and WebP are lossy
    assert len(image.notes) == 1
    assert f"want it shown {SHOWN[orientation]}; it was taken as it is stored" in image.notes[0]


def test_a_colour_profile_that_is_not_srgb_is_said(tmp_path):
    picture = PillowImage.new("RGB", (4, 4))

    def said(profile):
        picture.save(tmp_path / "a.jpg", icc_profile=profile)
        return read_image(tmp_path / "a.jpg").notes

    assert said(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()) == ()
    header, table = bytes(128), struct.pack(">I4sII", 1, b"desc", 144, 64)
    old = b"desc" + bytes(4) + struct.pack(">I", 11) + b"Display P3\0"
    new = b"mluc" + bytes(4) + struct.pack(">II2s2sII", 1, 12, b"en", b"US", 20, 28) + "Display P3".encode("utf-16-be")
    for description in (old, new):
        (note,) = said(header + table + description.ljust(64, b"\0"))
        assert note == "a.jpg: its colour profile is 'Display P3'; its numbers were taken as sRGB, as in Blender."
    assert said(header + table) == ()  # cut off
    PillowImage.new("CMYK", (4, 4)).save(tmp_path / "a.jpg")
    assert "it holds ink (CMYK)" in read_image(tmp_path / "a.jpg").notes[0]
