# SPDX-License-Identifier: Apache-2.0
"""The world's radiance and orientation: Cycles sees it directly, Mitsuba through the exported scene."""

from __future__ import annotations

from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Vector

from .scenes import add_camera, add_quad, new_material

DIRECTIONS = [
    (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0.1, 0.05, 1), (0.05, -0.1, -1),
    (3, 2, 1), (-1, 2, -2), (-2, -3, 1), (1, -1, 3)
]  # fmt: skip
MAPPINGS = {
    "none": None,
    "point": ("POINT", {"Rotation": (0.3, -0.5, 1.1)}),
    "texture": ("TEXTURE", {"Rotation": (0.3, -0.5, 1.1)}),
    "scaled": ("POINT", {"Rotation": (0.2, 0.0, 0.4), "Scale": (1.0, -1.0, 2.0)}),
    "moved": ("TEXTURE", {"Location": (0.2, 0.1, -0.3), "Scale": (1.0, 2.0, 1.0)}),
}


def world_nodes(scene: Any) -> tuple[Any, Any]:
    world = bpy.data.worlds.new("World")
    scene.world = world
    if world.node_tree is None:
        world.use_nodes = True
    tree = world.node_tree
    return tree, tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node


def smooth_map(height: int = 32) -> np.ndarray:
    """A float picture in which every direction has a colour of its own."""
    v, u = np.meshgrid((np.arange(height) + 0.5) / height, (np.arange(2 * height) + 0.5) / (2 * height), indexing="ij")
    turn = 2 * np.pi * u
    return np.stack([1 + np.sin(turn), 1.5 + np.cos(2 * turn), 3 * v, np.ones_like(u)], -1).astype(np.float32)


def environment(scene: Any, mapping: Any) -> None:
    tree, background = world_nodes(scene)
    scene.world.cycles.sampling_method = "NONE"  # building Cycles' importance map takes longer than the rest
    pixels = smooth_map()
    image = bpy.data.images.new("Sky", 64, 32, float_buffer=True)
    image.pixels.foreach_set(pixels[::-1].ravel())
    node = tree.nodes.new("ShaderNodeTexEnvironment")
    node.image = image
    tree.links.new(node.outputs["Color"], background.inputs["Color"])
    background.inputs["Strength"].default_value = 1.7
    if mapping is not None:
        coordinate, move = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeMapping")
        move.vector_type = mapping[0]
        for name, value in mapping[1].items():
            move.inputs[name].default_value = value
        tree.links.new(coordinate.outputs["Generated"], move.inputs["Vector"])
        tree.links.new(move.outputs["Vector"], node.inputs["Vector"])


@pytest.mark.parametrize("mapping", MAPPINGS)
def test_environment_along_axes_and_between(
    mapping: str, scene: Any, export: Any, render_cycles: Any, mitsuba: Any
) -> None:
    environment(scene, MAPPINGS[mapping])
    scene.render.resolution_x = scene.render.resolution_y = 4
    scene.cycles.samples = 4
    camera = add_camera("PERSP", (0, 0, 0), lens=4000.0, clip_start=0.5)
    target = add_quad("Target", 0.02, -1.0, new_material("Target"))
    report = export(target)
    target.hide_render = True
    world = mitsuba.load_file(str(report.folder / "scene.xml")).environment()
    expected, found = [], []
    for direction in DIRECTIONS:
        camera.rotation_euler = Vector(direction).to_track_quat("-Z", "Y").to_euler()
        expected.append(render_cycles().mean(axis=(0, 1)))
        si = mitsuba.SurfaceInteraction3f()
        si.wi = -mitsuba.Vector3f(*(float(x) for x in Vector(direction).normalized()))
        found.append(np.array(world.eval(si)).ravel())
    assert np.std(expected, axis=0).min() > 0.4
    # both interpolate the same pixels in float32. Mappings that are more than a rotation are resampled once, on a
    # map whose pixels are 6 degrees wide
    tolerance = 0.002 if mapping in ("none", "point", "texture") else 0.1
    np.testing.assert_allclose(found, expected, atol=tolerance * np.max(expected))


def test_environment_lights_a_floor(scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any) -> None:
    from .test_light_levels import floor, tiles

    environment(scene, MAPPINGS["point"])
    scene.cycles.samples = 256
    target = floor()
    expected, found = tiles(render_cycles()).mean(axis=0), tiles(render_mitsuba(export(target), 256)).mean(axis=0)
    np.testing.assert_allclose(found, expected, rtol=0.01)


@pytest.mark.parametrize("exposure", [1.0, 2.5])
def test_constant_world(exposure: float, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any) -> None:
    from .test_light_levels import floor, tiles

    _, background = world_nodes(scene)
    background.inputs["Color"].default_value = (0.2, 0.5, 0.9, 1.0)
    background.inputs["Strength"].default_value = 1.3
    scene.cycles.film_exposure = exposure
    target = floor()
    expected, found = tiles(render_cycles()), tiles(render_mitsuba(export(target)))
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=0.005)


def test_world_behind_a_transparent_film_is_black(scene: Any, export: Any, render_mitsuba: Any) -> None:
    _, background = world_nodes(scene)
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    scene.render.film_transparent = True
    add_camera("ORTHO", ortho_scale=2.0)
    report = export(add_quad("Target", 1.0, 0.0, new_material("Target")))
    pixels = render_mitsuba(report)
    assert report.request["image"]["film_transparent"] is True
    assert pixels[0, 0].max() == 0.0
    assert pixels[16, 16].min() > 0.5


def test_unsupported_world_is_refused(scene: Any, export: Any) -> None:
    from blender_addon.export.job import ExportError

    tree, background = world_nodes(scene)
    tree.links.new(tree.nodes.new("ShaderNodeTexSky").outputs[0], background.inputs["Color"])
    add_camera("ORTHO", ortho_scale=2.0)
    with pytest.raises(ExportError, match=r"World 'World' uses the node 'Sky Texture'.*Environment Texture"):
        export(add_quad("Target", 1.0, 0.0, new_material("Target")))
