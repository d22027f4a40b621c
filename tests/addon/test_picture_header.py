# SPDX-License-Identifier: Apache-2.0
"""Headers of pictures that other libraries wrote: Pillow, OpenEXR."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from blender_addon.picture_header import read_header
from mfo_backend.scene.image_file import write_exr

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
