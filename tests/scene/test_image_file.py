# SPDX-License-Identifier: Apache-2.0
"""Picture files: what every kind means, and the sentence for what cannot be used."""

from __future__ import annotations

import struct

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PillowImage
from PIL import ImageCms

from mfo_backend.scene.image_file import check_reference, read_image, write_exr, write_png
from mfo_backend.scene.picture_kind import SHOWN
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image

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


@pytest.mark.parametrize(
    ("name", "start", "sentence"),
    [
        ("a.png", b"\x76\x2f\x31\x01", r"'a\.png' is an OpenEXR file that is called \.png: rename it to \.exr"),
        ("a.exr", b"\xff\xd8\xff\xe0", r"is a PNG, JPEG, TIFF or WebP file that is called \.exr: rename it to \.png"),
        ("a.exr", b"#?RADIANCE", r"is a Radiance HDR file that is called \.exr: rename it to \.hdr"),
        ("a.jpg", b"\0\0\0\x1cftypheic", "is an HEIC, AVIF or film file, which is not read: save it as PNG or OpenEXR"),
    ],
)
def test_another_kind_than_the_name_says(tmp_path, name, start, sentence):
    (tmp_path / name).write_bytes(start + bytes(32))
    with pytest.raises(BadInputError, match=sentence):
        read_image(tmp_path / name)


def exr_bytes(tmp_path):
    write_exr(tmp_path / "whole.exr", np.random.default_rng(0).random((200, 40, 3)).astype(np.float32))
    return (tmp_path / "whole.exr").read_bytes()


@pytest.mark.parametrize("suffix", ["exr", "png", "jpg", "tif", "hdr"])
@pytest.mark.parametrize("content", [b"", b"not an image"])
def test_files_that_are_no_images(tmp_path, suffix, content, capfd):
    path = tmp_path / f"a.{suffix}"
    path.write_bytes(content)
    with pytest.raises(BadInputError, match=rf"Image 'a.{suffix}' cannot be read: the file is damaged or not an? \w*"):
        read_image(path)
    assert capfd.readouterr().out == ""


@pytest.mark.parametrize("share", [0.02, 0.5, 0.99])
def test_truncated_exr(tmp_path, share, capfd):
    """Stdout stays empty: it belongs to the protocol of a running fit."""
    data = exr_bytes(tmp_path)
    (tmp_path / "a.exr").write_bytes(data[: int(share * len(data))])
    with pytest.raises(BadInputError, match=r"'a\.exr' cannot be read: the file is damaged or not an OpenEXR image"):
        read_image(tmp_path / "a.exr")
    assert capfd.readouterr().out == ""


def test_truncated_png(tmp_path):
    write_png(tmp_path / "a.png", np.random.default_rng(0).random((64, 64, 3)))
    data = (tmp_path / "a.png").read_bytes()
    (tmp_path / "b.png").write_bytes(data[: len(data) // 2])
    with pytest.raises(BadInputError, match=r"'b\.png' cannot be read"):
        read_image(tmp_path / "b.png")


def test_huge_declared_sizes_are_refused_before_memory_is_taken(tmp_path):
    data = bytearray(exr_bytes(tmp_path))
    at = data.find(b"box2i", data.find(b"dataWindow")) + 10
    data[at + 8 : at + 16] = struct.pack("<ii", 2_000_000, 2_000_000)
    (tmp_path / "a.exr").write_bytes(data)
    with pytest.raises(BadInputError, match=r"'a\.exr' declares a size of 2000001x2000001"):
        read_image(tmp_path / "a.exr")
    (tmp_path / "a.hdr").write_bytes(b"#?RADIANCE\n\n-Y 900000 +X 900000\n")
    with pytest.raises(BadInputError, match=r"'a\.hdr' declares a size of 900000x900000"):
        read_image(tmp_path / "a.hdr")


def test_another_size_than_needed_is_refused_by_the_header(tmp_path, monkeypatch):
    pixels = np.ones((4, 6, 3), np.float32)
    write_exr(tmp_path / "a.exr", pixels)
    for suffix in ("png", "jpg", "tif"):
        PillowImage.fromarray((pixels * 255).astype(np.uint8)).save(tmp_path / f"a.{suffix}")
    (tmp_path / "a.hdr").write_bytes(b"#?RADIANCE\n\n-Y 4 +X 6\n")  # no pixels at all
    monkeypatch.setattr(PillowImage.Image, "load", lambda self: pytest.fail("decoded"))
    for name in ("a.exr", "a.png", "a.jpg", "a.tif", "a.hdr"):
        with pytest.raises(BadInputError, match="Reference is 6x4 but the scene renders 4x6"):
            read_image(tmp_path / name, (4, 6))
    assert read_image(tmp_path / "a.exr", (6, 4)).width == 6


def test_many_layers_are_refused_before_memory_is_taken(tmp_path, monkeypatch):
    layers = {f"l{i}.{c}": np.zeros((64, 64), np.float32) for i in range(9) for c in "BGR"}
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, layers).write(
        str(tmp_path / "a.exr")
    )
    assert (tmp_path / "a.exr").stat().st_size < 4096  # of 442,368 bytes of pixels
    read_image(tmp_path / "a.exr")
    monkeypatch.setattr("mfo_backend.scene.exr_file.MAX_SAMPLES", 64 * 64 * 26)
    with pytest.raises(BadInputError, match="declares 110592 samples in all its layers"):
        read_image(tmp_path / "a.exr")


def test_a_channel_name_that_is_no_text(tmp_path):
    data = exr_bytes(tmp_path)
    at = data.find(b"chlist") + 7 + 4
    (tmp_path / "a.exr").write_bytes(data[:at] + b"\xe8" + data[at + 1 :])
    with pytest.raises(BadInputError, match="damaged or not an OpenEXR"):
        read_image(tmp_path / "a.exr")


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif"])
def test_postscript_is_not_handed_to_a_program(tmp_path, suffix, monkeypatch):
    monkeypatch.setattr("subprocess.Popen", lambda *a, **k: pytest.fail("started a program"))
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 8 8\n%%EndComments\nshowpage\n")
    with pytest.raises(BadInputError, match="damaged or not an image"):
        read_image(path)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ({"Z": picture()[..., 0].copy()}, "has no colour: needed are channels R, G, B or Y, found Z"),
        ({"R": picture()[..., 0].copy(), "G": picture()[..., 0].copy()}, "has no colour: .* found G, R"),
        ({c: np.ones((4, 4), np.uint32) for c in "RGB"}, "holds 32-bit integers, which are no radiance"),
        (
            {"R": np.ones((4, 4), np.float32), **{c: np.ones((4, 4), np.uint32) for c in "GB"}},
            "holds 32-bit integers, which are no radiance",
        ),
    ],
)
def test_exr_without_usable_channels(tmp_path, content, sentence):
    write_parts(tmp_path / "a.exr", content)
    with pytest.raises(BadInputError, match=sentence):
        read_image(tmp_path / "a.exr")


@pytest.mark.parametrize(
    ("name", "sentence"),
    [("none.exr", "does not exist: check the path"), ("a.gif", "of an unknown kind: use exr, hdr, png")],
)
def test_missing_and_unknown_files(tmp_path, name, sentence):
    with pytest.raises(BadInputError, match=sentence):
        read_image(tmp_path / name)


@pytest.mark.parametrize("write", [write_exr, write_png])
def test_writing_where_no_folder_is(tmp_path, write):
    with pytest.raises(BadInputError, match="cannot be written"):
        write(tmp_path / "missing" / "a.file", picture())


def with_pixel(value, channels=1):
    pixels = picture()
    pixels[2, 3, channels] = value
    return Image(pixels, Encoding.LINEAR)


@pytest.mark.parametrize(
    ("image", "sentence"),
    [
        (Image(picture(8, 7), Encoding.LINEAR), "Reference is 7x8 but the scene renders 7x9: render the reference"),
        (Image(0 * picture(), Encoding.LINEAR), "Reference is all black"),
        (Image(-picture(), Encoding.LINEAR), "Reference is all black"),
        (with_pixel(np.nan), "Reference has 1 pixels with NaN and 0 with infinite values"),
        (with_pixel(np.inf), "Reference has 0 pixels with NaN and 1 with infinite values"),
        (with_pixel(np.nan, slice(3)), "Reference has 1 pixels with NaN and 0 with infinite values"),
        (with_pixel(np.inf, slice(3)), "Reference has 0 pixels with NaN and 1 with infinite values"),
    ],
)
def test_references_that_cannot_be_fitted(image, sentence):
    with pytest.raises(BadInputError, match=sentence):
        check_reference(image, 7, 9)


def test_negative_reference_pixels_are_clipped_with_a_note():
    image = with_pixel(-0.5)
    checked, notes = check_reference(image, 7, 9)
    assert notes == ("Reference has 1 pixels with negative values; they were set to 0.",)
    assert checked.pixels[2, 3, 1] == 0
    assert image.pixels[2, 3, 1] == -0.5
    good = Image(picture(), Encoding.LINEAR)
    assert check_reference(good, 7, 9) == (good, ())
    dark = with_pixel(0.0)
    assert check_reference(dark, 7, 9) == (dark, ())  # 0 is black, not negative


def test_a_folder_is_called_one(tmp_path):
    for name in ("pictures", "pictures.exr"):
        (tmp_path / name).mkdir()
        with pytest.raises(BadInputError, match=rf"{name}' is a folder: give one picture in it"):
            read_image(tmp_path / name)
