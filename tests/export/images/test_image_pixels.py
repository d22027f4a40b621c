# SPDX-License-Identifier: Apache-2.0
"""Which pictures' numbers a renderer draws as Cycles does."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.images.image_pixels import UnreadableImageError, are_usual, read_encoded  # noqa: E402


@pytest.fixture
def image() -> Iterator[Any]:
    """A picture of 2 x 2 floats, all of them 0.5."""
    image = bpy.data.images.new("Numbers", 2, 2, float_buffer=True)
    image.pixels.foreach_set(np.full(16, 0.5, np.float32))
    yield image
    bpy.data.images.remove(image)


@pytest.mark.parametrize(
    ("value", "usual"),
    [(0.5, True), (-99.0, True), (100.0, True), (101.0, False), (-101.0, False), (np.inf, False), (-np.inf, False),
     (np.nan, False)],
)  # fmt: skip
def test_one_number_beyond_the_largest_either_way_is_enough(image: Any, value: float, usual: bool) -> None:
    image.pixels[5] = value
    assert are_usual(image, 100.0) == usual


def test_bytes_are_usual_and_what_cannot_be_read_is_left_to_its_reader(tmp_path: Path) -> None:
    of_bytes, lost = (bpy.data.images.new(name, 2, 2) for name in ("Bytes", "Lost"))
    try:
        assert are_usual(of_bytes, 0.0)
        lost.source, lost.filepath = "FILE", str(tmp_path / "none.exr")
        assert are_usual(lost, 0.0)
        with pytest.raises(UnreadableImageError, match=r"^has no pixels \(is its file missing\?"):
            read_encoded(lost)
    finally:
        for each in (of_bytes, lost):
            bpy.data.images.remove(each)
