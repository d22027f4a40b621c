# SPDX-License-Identifier: Apache-2.0
"""What the check says of the part of the picture that counts, and its buttons."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from .found import check, stopping


@pytest.fixture
def part(scene: SimpleNamespace):
    return scene.bpy.context.scene.mfo.first_picture.part


@pytest.fixture
def mask(scene: SimpleNamespace, part):
    """A mask of the picture's size, half white."""
    part.mask = scene.bpy.data.images.new("Mask", 96, 64)
    part.mask.pixels = [1.0] * (96 * 32 * 4) + [0.0, 0.0, 0.0, 1.0] * (96 * 32)
    return part.mask


def test_a_mask_stops_nothing_and_is_said(scene: SimpleNamespace, mask) -> None:
    assert stopping(scene) == {}
    assert [f.level for f in check(scene) if "Only a part" in f.sentence] == ["fine"]


def test_a_mask_of_another_size_is_said(scene: SimpleNamespace, part, mask) -> None:
    part.mask = scene.bpy.data.images.new("Small", 48, 32)
    said = [f.sentence for f in check(scene) if f.level == "ignored"]
    assert "The mask 'Small' is 48x32 and the picture 96x64: it is scaled to that." in said


def test_a_crop_that_leaves_nothing_stops_and_a_button_takes_it_away(scene: SimpleNamespace, part) -> None:
    part.left, part.right = 60.0, 40.0
    ((sentence, fixes),) = stopping(scene).items()
    assert "left must be below right" in sentence
    assert fixes == {"whole_picture"}
    assert scene.bpy.ops.mfo.mend(kind="whole_picture") == {"FINISHED"}
    assert part.is_whole


@pytest.fixture
def render(scene: SimpleNamespace):
    """With a region of the right upper quarter's left half."""
    render = scene.bpy.context.scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.5
    render.border_min_y, render.border_max_y = 0.5, 1.0  # from below
    return render


def test_a_drawn_region_becomes_the_part(scene: SimpleNamespace, part, render) -> None:
    assert scene.bpy.ops.mfo.take_render_region() == {"FINISHED"}
    assert tuple(part.crop) == pytest.approx((0.25, 0.0, 0.5, 0.5))
    assert not render.use_border


def test_a_render_region_stops_nothing_and_is_said(scene: SimpleNamespace, render) -> None:
    settings = scene.bpy.context.scene.mfo
    assert stopping(scene) == {}  # the reference is a picture of the frame
    said = {f.sentence: f for f in check(scene) if "Render Region" in f.sentence}
    (line,) = said.values()
    assert (line.level, "empty beside the region" in line.sentence) == ("fine", True)
    render.use_crop_to_border = True
    assert stopping(scene) == {}
    Image.new("RGB", (24, 32)).save(Path(scene.job).with_suffix(".png"))
    settings.reference_path = str(Path(scene.job).with_suffix(".png"))
    assert stopping(scene) == {}
    sentences = [f.sentence for f in check(scene)]
    assert "Render Region is on, and the picture shows the region alone." in sentences
    assert "Camera 'Camera', 24 x 32 pixels." in sentences
    assert scene.bpy.ops.mfo.mend(kind="whole_frame") == {"FINISHED"}
    assert not render.use_border


def test_a_picture_of_the_region_lies_over_it(scene: SimpleNamespace, render) -> None:
    bpy = scene.bpy
    path = Path(scene.job).with_suffix(".png")
    Image.new("RGB", (24, 32), (255, 0, 0)).save(path)
    bpy.context.scene.mfo.reference_path = str(path)
    before = set(bpy.data.images)
    assert bpy.ops.mfo.overlay_reference() == {"FINISHED"}
    image = bpy.context.scene.camera.data.background_images[0].image
    assert tuple(image.size) == (96, 64)
    pixels = np.array(image.pixels[:]).reshape(64, 96, 4)[::-1]  # rows from above
    assert np.argwhere(pixels[..., 3] > 0.5).min(axis=0).tolist() == [0, 24]
    assert np.argwhere(pixels[..., 0] > 0.5).max(axis=0).tolist() == [31, 47]
    assert bpy.ops.mfo.overlay_reference() == {"FINISHED"}
    assert set(bpy.data.images) == before


def test_a_mask_for_a_picture_of_the_region_has_its_size(scene: SimpleNamespace, part, render) -> None:
    render.use_crop_to_border = True
    assert scene.bpy.ops.mfo.paint_mask() == {"FINISHED"}
    assert tuple(part.mask.size) == (24, 32)
