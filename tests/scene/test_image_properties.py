# SPDX-License-Identifier: Apache-2.0
"""What is written is what is read, for any picture."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from blender_addon.export.files.exr_file import write_exr as write_exr_of_the_addon
from mfo_backend.scene.image_file import read_image, write_exr, write_png
from mfo_backend.types.image import Encoding

SHAPES = st.tuples(st.integers(1, 9), st.integers(1, 9), st.just(3))
ANY_FLOAT = st.floats(width=32, allow_nan=True, allow_infinity=True)
UNIT = st.floats(0, 1, width=32)


@pytest.fixture(scope="module")
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


@given(pixels=arrays.arrays(np.float32, SHAPES, elements=ANY_FLOAT))
def test_exr_keeps_every_bit(folder: Path, pixels: np.ndarray) -> None:
    write_exr(folder / "a.exr", pixels)
    image = read_image(folder / "a.exr")
    assert image.encoding is Encoding.LINEAR
    np.testing.assert_array_equal(image.pixels, pixels)


@given(pixels=arrays.arrays(np.float32, SHAPES, elements=ANY_FLOAT))
def test_the_addon_s_exr_is_read_as_it_was(folder: Path, pixels: np.ndarray) -> None:
    write_exr_of_the_addon(folder / "b.exr", pixels)
    np.testing.assert_array_equal(read_image(folder / "b.exr").pixels, pixels)


@given(pixels=arrays.arrays(np.float32, SHAPES, elements=UNIT))
def test_png_keeps_the_nearest_level(folder: Path, pixels: np.ndarray) -> None:
    write_png(folder / "c.png", pixels)
    image = read_image(folder / "c.png")
    assert image.encoding is Encoding.SRGB
    assert np.abs(image.pixels - pixels).max() <= 0.5 / 255 + 1e-6
    write_png(folder / "d.png", image.pixels)  # a level is its own nearest
    np.testing.assert_array_equal(read_image(folder / "d.png").pixels, image.pixels)
