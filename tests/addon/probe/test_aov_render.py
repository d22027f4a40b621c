# SPDX-License-Identifier: Apache-2.0
"""The part of the picture that values are rendered for, and how fine."""

from __future__ import annotations

from typing import Any

import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.probe.aov_render import frame_of  # noqa: E402


@pytest.fixture
def scene() -> Any:
    """A square of 2 units in an orthographic picture of 10 units and 100 pixels, right and above of the middle."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 100
    scene.render.resolution_percentage = 100
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 10.0, (0.0, 0.0, 5.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.mesh.primitive_plane_add(size=2.0, location=(2.0, 1.0, 0.0))
    bpy.context.view_layer.update()
    return scene


def test_the_frame_is_the_object_and_two_pixels_around(scene: Any) -> None:
    frame = frame_of(scene, bpy.context.object, 4, 1)
    left, right, top, bottom = 60, 80, 30, 50
    found = (frame.left, frame.right, frame.top, frame.bottom)
    wanted = [4 * v for v in (left - 2, right + 2, top - 2, bottom + 2)]
    assert found == pytest.approx(wanted, abs=4.0)  # a corner may round to the next pixel
    assert (frame.scale, frame.full) == (4, (400, 400))


@pytest.mark.parametrize(("outputs", "scale"), [(1, 8), (3000, 8), (4000, 4), (12000, 4), (16000, 2), (10**7, 1)])
def test_many_outputs_are_rendered_at_a_smaller_scale(scene: Any, outputs: int, scale: int) -> None:
    """24 or 25 pixels each way, 16 bytes a subpixel, two gigabytes: 3125 outputs or more at scale 8, 12500 at 4."""
    assert frame_of(scene, bpy.context.object, 8, outputs).scale == scale
