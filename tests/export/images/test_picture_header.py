# SPDX-License-Identifier: Apache-2.0
"""Headers of pictures that other libraries wrote: Pillow, OpenEXR."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from blender_addon.export.images.picture_header import is_cut_off, read_header
from mfo_backend.scene.image_file import read_image, write_exr

WIDTH, HEIGHT = 37, 21


@pytest.mark.parametrize(
    ("suffix", "kind", "depth"),
    [("png", "PNG", "8-bit"), ("jpg", "JPEG", "8-bit"), ("tif", "TIFF", ""), ("bmp", "BMP", "8-bit")],
)
def test_display_pictures(tmp_path: Path, suffix: str, kind: str, depth: str) -> None:
    path = tmp_path / f"picture.{suffix}"
    Image.fromarray(np.zeros((HEIGHT, WIDTH, 3), np.uint8)).save(path)
    header = read_header(path)
    assert header is not None
    assert (header.kind, header.width, header.height, header.depth) == (kind, WIDTH, HEIGHT, depth)


def test_sixteen_bit_png(tmp_path: Path) -> None:
    Image.fromarray(np.zeros((HEIGHT, WIDTH), np.uint16)).save(tmp_path / "deep.png")
    header = read_header(tmp_path / "deep.png")
    assert header is not None
    assert header.depth == "16-bit"


def test_exr(tmp_path: Path) -> None:
    write_exr(tmp_path / "picture.exr", np.ones((HEIGHT, WIDTH, 3), np.float32))
    header = read_header(tmp_path / "picture.exr")
    assert header is not None
    assert (header.kind, header.width, header.height, header.depth) == ("OpenEXR", WIDTH, HEIGHT, "32-bit float")


def test_radiance(tmp_path: Path) -> None:
    text = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {HEIGHT} +X {WIDTH}\n".encode()
    (tmp_path / "picture.hdr").write_bytes(text + bytes(40))
    header = read_header(tmp_path / "picture.hdr")
    assert header is not None
    assert (header.width, header.height) == (WIDTH, HEIGHT)


@pytest.mark.parametrize("orientation", [1, 3, 6])
@pytest.mark.parametrize("suffix", ["png", "jpg", "tif"])
def test_orientation(tmp_path: Path, suffix: str, orientation: int) -> None:
    exif = Image.Exif()
    exif[274] = orientation
    path = tmp_path / f"picture.{suffix}"
    Image.fromarray(np.zeros((HEIGHT, WIDTH, 3), np.uint8)).save(path, exif=exif)
    header = read_header(path)
    assert header is not None
    assert (header.width, header.height, header.orientation) == (WIDTH, HEIGHT, orientation)


def test_a_tiff_whose_directory_stands_at_its_end(tmp_path: Path) -> None:
    """As libtiff writes them, and so Blender; the pixels are more than what is read from the start."""
    size = (800, 700)
    path = tmp_path / "picture.tif"
    Image.effect_noise(size, 50).convert("RGB").save(path, compression="tiff_adobe_deflate")
    header = read_header(path)
    assert header is not None
    assert (header.width, header.height) == size


def test_a_jpeg_with_long_data_before_its_size(tmp_path: Path) -> None:
    Image.new("RGB", (WIDTH, HEIGHT)).save(tmp_path / "picture.jpg")
    data = (tmp_path / "picture.jpg").read_bytes()
    block = b"\xff\xe2" + (65000).to_bytes(2, "big") + bytes(64998)
    for count in (3, 30):
        (tmp_path / "picture.jpg").write_bytes(data[:2] + count * block + data[2:])
        header = read_header(tmp_path / "picture.jpg")
        assert header is not None
        assert (header.kind, header.width) == ("JPEG", WIDTH if count == 3 else 0)


def test_an_exr_has_the_size_of_its_display_window(tmp_path: Path) -> None:
    """As the backend reads it: what a program cut off around the data is black."""
    path = tmp_path / "cut.exr"
    windows = {
        "dataWindow": (np.array([4, 2], np.int32), np.array([12, 9], np.int32)),
        "displayWindow": (np.zeros(2, np.int32), np.array([WIDTH - 1, HEIGHT - 1], np.int32)),
    }
    pixels = np.ones((8, 9, 3), np.float32)
    OpenEXR.File({"type": OpenEXR.scanlineimage} | windows, {"RGB": pixels}).write(str(path))
    header = read_header(path)
    assert header is not None
    assert (header.width, header.height) == (WIDTH, HEIGHT)
    read = read_image(path, (WIDTH, HEIGHT)).pixels
    assert (read.shape[:2], read.sum()) == ((HEIGHT, WIDTH), 8 * 9 * 3)


def test_colours_of_an_exr(tmp_path: Path) -> None:
    pixels = np.ones((HEIGHT, WIDTH, 3), np.float32)
    primaries = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)
    header = {"type": OpenEXR.scanlineimage, "colorInteropID": "lin_ap1_scene", "chromaticities": primaries}
    OpenEXR.File(header, {"RGB": pixels}).write(str(tmp_path / "picture.exr"))
    found = read_header(tmp_path / "picture.exr")
    assert found is not None
    assert found.space == "lin_ap1_scene"
    assert found.primaries == pytest.approx(primaries)


@pytest.mark.parametrize("suffix", ["png", "jpg", "tif", "bmp", "exr"])
def test_what_is_cut_off_raises_nothing(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"picture.{suffix}"
    if suffix == "exr":
        write_exr(path, np.ones((HEIGHT, WIDTH, 3), np.float32))
    else:
        Image.fromarray(np.zeros((HEIGHT, WIDTH, 3), np.uint8)).save(path)
    whole = path.read_bytes()
    for length in range(0, min(len(whole), 400), 7):
        path.write_bytes(whole[:length])
        read_header(path)
    path.write_bytes(b"\x00" * 100)
    assert read_header(path) is None


@pytest.mark.parametrize("kind", ["PNG", "JPEG", "TIFF"])
def test_a_png_that_is_being_written_is_cut_off_at_any_place(tmp_path: Path, kind: str) -> None:
    """And a whole one is not, with whatever a program has left behind its end."""
    path = tmp_path / "picture"
    noise = np.random.default_rng(3).integers(0, 255, (40, 60, 3), np.uint8)
    Image.fromarray(noise).save(path, format=kind)
    whole = path.read_bytes()
    for count in (9, 20, 33, 60, len(whole) // 2, len(whole) - 13):
        path.write_bytes(whole[:count])
        assert is_cut_off(path) == (kind == "PNG")
    path.write_bytes(whole + b"older picture")
    assert not is_cut_off(path)
