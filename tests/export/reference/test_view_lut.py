# SPDX-License-Identifier: Apache-2.0
"""The table of a view against what Blender itself writes for other colours, and that nothing of the user's changes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.reference.view_lut import bake_view_lut, shown_by
from mfo_backend.metrics.display.baked_view import BakedView

from ..test_untouched import changes, fingerprint

RNG = np.random.default_rng(8)
# a surface's radiance: 11 stops of light, of any colour
COLOURS = np.exp2(RNG.uniform(-8, 3, (100, 100, 1))) * RNG.uniform(0.02, 1, (100, 100, 3))


def error(scene: Any, colours: np.ndarray) -> np.ndarray:
    lut = bake_view_lut(scene)
    view = BakedView(lut.table, lut.log2_min, lut.log2_max)
    return np.abs(view.display(colours.astype(np.float32)) - shown_by(scene, colours))


@pytest.mark.parametrize(
    ("view", "largest", "mean"),
    # those of docs/user/view_transforms.md, rounded up; kinks of a view inside of a cell make the largest
    [
        ("Standard", 0.002, 0.0004),
        ("AgX", 0.03, 0.0005),
        ("Filmic", 0.001, 0.0003),
        ("Khronos PBR Neutral", 0.045, 0.0015),
    ],
)
def test_ten_thousand_colours(view: str, largest: float, mean: float, scene: Any) -> None:
    scene.view_settings.view_transform = view
    found = error(scene, COLOURS)
    assert found.max() < largest
    assert found.mean() < mean


def test_everything_of_a_view_is_in_the_table(scene: Any) -> None:
    view = scene.view_settings
    view.view_transform, view.exposure = "AgX", -2.0
    plain = shown_by(scene, COLOURS)
    for name, value in (("look", "AgX - Punchy"), ("gamma", 1.3), ("use_curve_mapping", True)):
        setattr(view, name, value)
        if name == "use_curve_mapping":
            view.curve_mapping.curves[3].points.new(0.5, 0.7)
            view.curve_mapping.update()
        changed = shown_by(scene, COLOURS)
        assert np.abs(changed - plain).mean() > 0.02  # it is seen at all
        assert error(scene, COLOURS).mean() < 0.001
        plain = changed


def test_an_output_with_a_view_of_its_own_does_not_matter(scene: Any) -> None:
    scene.view_settings.view_transform = "AgX"
    expected = shown_by(scene, COLOURS)
    settings = scene.render.image_settings
    settings.color_management = "OVERRIDE"
    settings.view_settings.view_transform = "Standard"
    np.testing.assert_array_equal(shown_by(scene, COLOURS), expected)


def test_it_is_what_a_render_writes(scene: Any, tmp_path: Path) -> None:
    """A white world of 0.18, rendered to an 8-bit PNG."""
    Image = pytest.importorskip("PIL.Image")
    scene.view_settings.view_transform, scene.view_settings.exposure = "AgX", 0.7
    scene.render.dither_intensity = 0.0
    scene.world = bpy.data.worlds.new("World")
    if scene.world.node_tree is None:
        scene.world.use_nodes = True
    background = next(n for n in scene.world.node_tree.nodes if n.type == "BACKGROUND")
    background.inputs["Color"].default_value = (0.5, 0.18, 0.05, 1)
    scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    scene.collection.objects.link(scene.camera)
    scene.cycles.samples = 1
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "PNG", "8"
    scene.render.filepath = str(tmp_path / "world.png")
    bpy.ops.render.render(write_still=True)
    lut = bake_view_lut(scene)
    shown = BakedView(lut.table, lut.log2_min, lut.log2_max).display(np.array([0.5, 0.18, 0.05]))
    with Image.open(tmp_path / "world.png") as picture:
        written = np.asarray(picture.convert("RGB"))[16, 16] / 255
    np.testing.assert_allclose(shown, written, atol=0.5 / 255 + 0.002)  # rounding, and the table between its nodes


def test_nothing_changes(scene: Any, tmp_path: Path) -> None:
    scene.view_settings.view_transform = "Filmic"
    scene.view_settings.use_curve_mapping = True
    scene.render.image_settings.file_format = "JPEG"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.context.view_layer.update()
    before = fingerprint()
    bake_view_lut(bpy.context.scene)
    bpy.context.view_layer.update()  # clears the list of what it updates next, which is no setting of the user's
    assert changes(before, fingerprint()) == []
