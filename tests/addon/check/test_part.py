# SPDX-License-Identifier: Apache-2.0
"""What the check says of the part of the picture that counts, and its buttons."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

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


def test_the_render_region_becomes_the_part(scene: SimpleNamespace, part) -> None:
    render = scene.bpy.context.scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x = 0.25, 0.5
    render.border_min_y, render.border_max_y = 0.5, 1.0  # from below
    assert {"whole_frame", "region_counts"} in stopping(scene).values()
    assert scene.bpy.ops.mfo.mend(kind="region_counts") == {"FINISHED"}
    assert tuple(part.crop) == pytest.approx((0.25, 0.0, 0.5, 0.5))
    assert not render.use_border
