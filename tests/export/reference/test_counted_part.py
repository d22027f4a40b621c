# SPDX-License-Identifier: Apache-2.0
"""What an export writes of the part of a reference that counts."""

from __future__ import annotations

import bpy
import numpy as np
import pytest

from blender_addon.export.findings import ExportError
from blender_addon.export.reference.counted_part import CountedPart
from blender_addon.export.reference.reference import read_reference
from mfo_backend.scene.image_file import read_image


@pytest.fixture
def image(scene):
    """Four by two pixels, opaque on the left."""
    made = bpy.data.images.new("Seen", 4, 2, alpha=True, float_buffer=True)
    pixels = np.full((2, 4, 4), 0.25, np.float32)
    pixels[:, :2, 3] = 1.0
    made.pixels.foreach_set(pixels.ravel())
    return made


def mask_of(levels):
    """An image whose rows are `levels`, the upper one first."""
    rows = np.asarray(levels, np.float32)
    made = bpy.data.images.new("Mask", rows.shape[1], rows.shape[0])
    pixels = np.ones((*rows.shape, 4), np.float32)
    pixels[..., :3] = rows[::-1, :, None]
    made.pixels.foreach_set(pixels.ravel())
    return made


def test_mask_crop_and_alpha_are_in_the_request_and_the_files(scene, image, tmp_path):
    part = CountedPart(image, (0.0, 0.0, 0.5, 1.0), mask_of([[1, 0, 0, 0], [1, 1, 0, 0]]), alpha=True)
    found = read_reference(part, scene, (4, 2))
    said = found.write(tmp_path)
    assert said == {
        "path": "reference.exr",
        "encoding": "linear",
        "crop": [0.0, 0.0, 0.5, 1.0],
        "mask": "mask.png",
        "alpha": True,
    }
    assert read_image(tmp_path / "mask.png").pixels[..., 0].tolist() == [[1, 0, 0, 0], [1, 1, 0, 0]]
    assert read_image(tmp_path / "reference.exr").alpha[0].tolist() == [1.0, 1.0, 0.25, 0.25]


def test_a_whole_picture_is_said_as_before(scene, image, tmp_path):
    found = read_reference(image, scene, (4, 2))
    assert found.write(tmp_path) == {"path": "reference.exr", "encoding": "linear"}
    assert read_image(tmp_path / "reference.exr").alpha is None


@pytest.mark.parametrize(
    ("part", "said"),
    [
        ({"crop": (0.5, 0.0, 0.5, 1.0)}, "The crop leaves nothing"),
        ({"mask": "black"}, "is black everywhere"),
        ({"mask": "missing"}, "does not exist"),
    ],
)
def test_what_leaves_nothing_is_refused(scene, image, tmp_path, part, said):
    masks = {"black": mask_of([[0, 0]]), "missing": tmp_path / "none.png"}
    given = {name: masks.get(value, value) if name == "mask" else value for name, value in part.items()}
    with pytest.raises(ExportError, match=said):
        read_reference(CountedPart(image, **given), scene, (4, 2))
