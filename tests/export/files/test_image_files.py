# SPDX-License-Identifier: Apache-2.0
"""Our EXR, PNG and PLY writers, read back by OpenEXR, Pillow and Mitsuba."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blender_addon.export.files.exr_file import write_exr
from blender_addon.export.files.ply_file import TriangleMesh, write_ply
from blender_addon.export.files.png_file import write_png
from mfo_backend.render.pictures.mitsuba_renderer import two_threads


@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize("size", [(1, 1), (5, 7), (40, 33), (16, 16)])
@pytest.mark.parametrize("kind", ["noise", "smooth"])
def test_exr_keeps_every_bit(channels: int, size: tuple[int, int], kind: str, tmp_path: Path) -> None:
    import OpenEXR

    generator = np.random.default_rng(1)
    pixels = generator.standard_normal((*size, channels)).astype(np.float32) * 1e3
    if kind == "smooth":
        pixels[:] = np.linspace(0, 1e-3, size[1], dtype=np.float32)[None, :, None] + np.arange(channels) * np.float32(2)
    write_exr(tmp_path / "a.exr", pixels)
    file = OpenEXR.File(str(tmp_path / "a.exr"))
    name = {1: "Y", 3: "RGB", 4: "RGBA"}[channels]
    read = file.channels()[name].pixels
    assert read.dtype == np.float32
    np.testing.assert_array_equal(read.reshape(pixels.shape), pixels)
    assert str(file.header()["compression"]) == "Compression.ZIP_COMPRESSION"


def test_exr_is_read_by_mitsuba(tmp_path: Path, mitsuba: Any) -> None:
    pixels = np.random.default_rng(2).random((20, 9, 3)).astype(np.float32)
    write_exr(tmp_path / "a.exr", pixels)
    with two_threads():
        read = mitsuba.Bitmap(str(tmp_path / "a.exr"))
    np.testing.assert_array_equal(np.array(read), pixels)


def test_exr_refuses_two_channels(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="1, 3 or 4 channels here, not 2"):
        write_exr(tmp_path / "a.exr", np.zeros((2, 2, 2), np.float32))


def test_png_round_trip(tmp_path: Path) -> None:
    from PIL import Image

    pixels = np.random.default_rng(3).integers(0, 256, (7, 5, 3)).astype(np.uint8)
    write_png(tmp_path / "a.png", pixels)
    with Image.open(tmp_path / "a.png") as image:
        np.testing.assert_array_equal(np.asarray(image), pixels)


def test_ply_is_read_by_mitsuba(tmp_path: Path, mitsuba: Any) -> None:
    generator = np.random.default_rng(4)
    normals = generator.standard_normal((4, 3)).astype(np.float32)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    mesh = TriangleMesh(
        generator.random((4, 3), dtype=np.float32),
        normals,
        generator.random((4, 2), dtype=np.float32),
        np.array([[0, 1, 2], [2, 1, 3]], dtype=np.int32),
    )
    write_ply(tmp_path / "a.ply", mesh)
    shape = mitsuba.load_dict({"type": "ply", "filename": str(tmp_path / "a.ply")})
    parameters = mitsuba.traverse(shape)
    for name, array in (
        ("vertex_positions", mesh.positions),
        ("vertex_normals", mesh.normals),
        ("vertex_texcoords", mesh.uvs),
        ("faces", mesh.triangles),
    ):
        # Mitsuba normalises the normals once more
        np.testing.assert_allclose(np.array(parameters[name]).reshape(array.shape), array, rtol=0, atol=2e-7)
