# SPDX-License-Identifier: Apache-2.0
"""The part of the picture that values are rendered for, and how fine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.export.camera.camera_model import Region  # noqa: E402
from blender_addon.probe.aov_render import frame_of, render_outputs, world_to_frame  # noqa: E402


@pytest.fixture
def scene() -> Any:
    """A square of 2 units in an orthographic picture of 10 units and 100 pixels, right and above of the middle."""
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = 100
    scene.render.resolution_percentage = 100
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 10.0, (0.0, 0.0, 5.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.mesh.primitive_plane_add(size=2.0, location=(2.0, 1.0, 0.0))
    bpy.context.object.data.materials.append(bpy.data.materials.new("Square"))
    bpy.context.view_layer.update()
    return scene


def frame(scene: Any, scale: int, outputs: int, region: Region | None = None) -> Any:
    """The frame around the square and whatever else shows its material."""
    item = bpy.context.object
    return frame_of(scene, item, item.active_material, scale, outputs, region)


def test_the_frame_is_the_object_and_two_pixels_around(scene: Any) -> None:
    around = frame(scene, 4, 1)
    left, right, top, bottom = 60, 80, 30, 50
    found = (around.left, around.right, around.top, around.bottom)
    wanted = [4 * v for v in (left - 2, right + 2, top - 2, bottom + 2)]
    assert found == pytest.approx(wanted, abs=4.0)  # a corner may round to the next pixel
    assert (around.scale, around.full) == (4, (400, 400))


@pytest.mark.parametrize("is_linked_to", ["DATA", "OBJECT"])
def test_the_frame_is_around_all_that_shows_the_material(scene: Any, is_linked_to: str) -> None:
    square = bpy.context.object
    alone = frame(scene, 4, 1)
    bpy.ops.mesh.primitive_plane_add(size=2.0, location=(-3.0, 1.0, 0.0))
    other, bpy.context.view_layer.objects.active = bpy.context.object, square
    bpy.context.view_layer.update()
    assert frame(scene, 4, 1) == alone  # of no material
    other.data.materials.append(None)
    other.material_slots[0].link = is_linked_to
    other.material_slots[0].material = square.active_material
    bpy.context.view_layer.update()
    both = frame(scene, 4, 1)
    assert both.left == pytest.approx(4 * (10 - 2), abs=4.0)
    assert (both.right, both.top, both.bottom) == (alone.right, alone.top, alone.bottom)


def test_a_region_of_the_picture_bounds_the_frame(scene: Any) -> None:
    cut = frame(scene, 4, 1, Region(0, 40, 70, 100))
    assert (cut.right, cut.top) == (4 * 72, 4 * 38)  # and two pixels around
    assert (cut.left, cut.bottom) == pytest.approx((4 * 58, 4 * 52), abs=4.0)
    assert frame(scene, 4, 1, Region(0, 0, 50, 50)) is None


@pytest.mark.parametrize(("outputs", "scale"), [(1, 8), (3000, 8), (4000, 4), (12000, 4), (16000, 2), (10**7, 1)])
def test_many_outputs_are_rendered_at_a_smaller_scale(scene: Any, outputs: int, scale: int) -> None:
    """24 or 25 pixels each way, 16 bytes a subpixel, two gigabytes: 3125 outputs or more at scale 8, 12500 at 4."""
    assert frame(scene, 8, outputs).scale == scale


def show_position(item: Any) -> None:
    """Have an object's material write positions to the output "place"."""
    material = item.active_material
    if material.node_tree is None:
        material.use_nodes = True
    tree = material.node_tree
    output = tree.nodes.new("ShaderNodeOutputAOV")
    output.aov_name = "place"
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], output.inputs["Color"])


@pytest.mark.parametrize("lens", ["ORTHO", "PERSP"])
@pytest.mark.parametrize("fit", ["AUTO", "VERTICAL", "HORIZONTAL"])
def test_subpixels_by_a_shifted_camera_are_those_of_a_fine_picture(scene: Any, lens: str, fit: str) -> None:
    """Positions on a turned square, to a tenth of a subpixel in the mean; the picture is wider than high."""
    scene.render.resolution_x, scene.render.resolution_y = 48, 32
    scene.camera.data.sensor_fit = fit
    scene.camera.data.type, scene.camera.location = lens, (2.0, 1.0, 6.0)
    scene.camera.data.shift_x = 0.05
    item = bpy.context.object
    item.rotation_euler = (0.4, 0.3, 0.2)
    show_position(item)
    bpy.context.view_layer.update()
    around = frame(scene, 4, 1)
    before = scene.camera.data.shift_x, scene.cycles.filter_width
    fine, shifted = (
        render_outputs(scene, bpy.context.view_layer, [("place", True)], around, 16, by_pixels=by_pixels).values[
            "place"
        ]
        for by_pixels in (False, True)
    )
    assert (scene.camera.data.shift_x, scene.cycles.filter_width) == before
    assert fine.shape == shifted.shape
    inner = np.abs(fine).max(axis=2) > 0.0
    inner[1:-1, 1:-1] &= inner[:-2, 1:-1] & inner[2:, 1:-1] & inner[1:-1, :-2] & inner[1:-1, 2:]
    inner[[0, -1]] = inner[:, [0, -1]] = False
    steps = np.linalg.norm(np.diff(fine, axis=1), axis=2)[:, 1:][inner[:, 2:]]
    assert inner.sum() > 500
    assert np.abs((shifted - fine)[inner].mean(axis=0)).max() < 0.1 * np.median(steps)
    assert np.linalg.norm((shifted - fine)[inner], axis=1).mean() < 0.5 * np.median(steps)


@pytest.mark.parametrize(("narrow", "aspect"), [((48, 64), (2.0, 1.0)), ((96, 32), (1.0, 2.0)), ((48, 48), (1.5, 1.0))])
@pytest.mark.parametrize("fit", ["AUTO", "VERTICAL", "HORIZONTAL"])
def test_pixels_that_are_not_square_are_looked_at_as_square_ones(
    scene: Any, narrow: tuple[int, int], aspect: tuple[float, float], fit: str
) -> None:
    """As the fit has them; Blender 5.0 writes no multilayer EXR with others."""
    render, camera = scene.render, scene.camera.data
    camera.type, camera.sensor_fit, camera.shift_x = "PERSP", fit, 0.05
    scene.camera.location = (2.0, 1.0, 6.0)
    item = bpy.context.object
    item.rotation_euler = (0.4, 0.3, 0.2)
    show_position(item)
    found, matrices = [], []
    for size, (wide, high) in (((48, 32), (1.0, 1.0)), (narrow, aspect)):
        render.resolution_x, render.resolution_y = size
        render.pixel_aspect_x, render.pixel_aspect_y = wide, high
        bpy.context.view_layer.update()
        around = frame(scene, 2, 1)
        assert around.full == (96, 64)
        matrices.append(world_to_frame(scene, around))
        by_pixels = render_outputs(scene, bpy.context.view_layer, [("place", True)], around, 4, by_pixels=True)
        found.append(by_pixels.values["place"])
        assert (render.resolution_x, render.resolution_y, render.pixel_aspect_x, render.pixel_aspect_y) == (
            *size,
            wide,
            high,
        )
    np.testing.assert_allclose(matrices[1], matrices[0], rtol=1e-6, atol=1e-6)
    assert np.abs(found[0]).max() > 1.0
    np.testing.assert_allclose(found[1], found[0], atol=1e-6)
