# SPDX-License-Identifier: Apache-2.0
"""Picture files that cannot be used: the sentence for each, and that nothing is taken or run for them."""

from __future__ import annotations

import struct

import numpy as np
import OpenEXR
import pytest
from PIL import Image as PillowImage

from mfo_backend.scene.image_file import check_reference, read_image, write_exr, write_png
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image

from .test_image_file import picture, write_parts


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


@pytest.mark.parametrize(
    ("values", "kind"),
    [
        (np.array([[0.2, 0.7]], np.float32), "float32"),
        (np.array([[3, 70_000]], np.int32), "int32"),
        (np.array([[3, -1]], np.int32), "int32"),
    ],
)
def test_grey_numbers_that_are_no_display_values_are_refused(tmp_path, values, kind):
    """Each for a reason of its own: no whole numbers, more than 16 bits hold, less than black."""
    PillowImage.fromarray(values).save(tmp_path / "grey.tif")
    with pytest.raises(BadInputError, match=rf"'grey\.tif' holds {kind} values: PNG, JPEG and TIFF must hold 8 or 16"):
        read_image(tmp_path / "grey.tif")


def coded_line(*, red):
    """A Radiance picture of 8 x 1 pixels, its line coded, with these bytes for its red."""
    plain = bytes([128 + 8, 9])  # a run of eight nines
    return b"#?RADIANCE\n\n-Y 1 +X 8\n" + bytes([2, 2, 0, 8]) + red + 3 * plain


@pytest.mark.parametrize(
    ("red", "is_read"),
    [
        (bytes([128 + 8, 9]), True),
        (bytes([128 + 5, 9, 3, 1, 2, 3]), True),
        (bytes([128 + 9, 9]), False),
        (bytes([128 + 5, 9, 128 + 4, 9]), False),
        (bytes([0, 128 + 8, 9]), False),
    ],
    ids=["one run", "two", "too long", "beyond the line", "of nothing"],
)
def test_a_run_ends_with_its_line(tmp_path, red, is_read):
    (tmp_path / "a.hdr").write_bytes(coded_line(red=red))
    if is_read:
        assert read_image(tmp_path / "a.hdr").pixels.shape == (1, 8, 3)
        return
    with pytest.raises(BadInputError, match=r"'a\.hdr' cannot be read: the file is damaged or not a Radiance image"):
        read_image(tmp_path / "a.hdr")
