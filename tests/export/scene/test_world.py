# SPDX-License-Identifier: Apache-2.0
"""The world's radiance and orientation: Cycles sees it directly, Mitsuba through the exported scene."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import bpy
import numpy as np
import pytest
from mathutils import Matrix, Vector

from blender_addon.export.job import check_export
from mfo_backend.scene.image_file import read_image

from ..load_scene import load_scene
from ..scenes import add_camera, add_light, add_quad, new_material, world_color

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
    world = load_scene(mitsuba, report).environment()
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


def test_world_of_other_nodes_is_rendered_into_panoramas(scene: Any, export: Any) -> None:
    tree, background = world_nodes(scene)
    # the colour is the direction itself, half of it for the camera, so that each pixel is known
    coordinate, paths = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeLightPath")
    half = tree.nodes.new("ShaderNodeVectorMath")
    half.operation = "MULTIPLY_ADD"
    half.inputs[1].default_value = half.inputs[2].default_value = (0.5, 0.5, 0.5)
    strength = tree.nodes.new("ShaderNodeMath")
    strength.operation, strength.inputs[0].default_value = "DIVIDE", 1.0
    shifted = tree.nodes.new("ShaderNodeMath")
    shifted.inputs[1].default_value = 1.0
    tree.links.new(coordinate.outputs["Generated"], half.inputs[0])
    tree.links.new(half.outputs[0], background.inputs["Color"])
    tree.links.new(paths.outputs["Is Camera Ray"], shifted.inputs[0])
    tree.links.new(shifted.outputs[0], strength.inputs[1])
    tree.links.new(strength.outputs[0], background.inputs["Strength"])
    add_camera("ORTHO", ortho_scale=2.0)
    before = sorted(block.name for kind in (bpy.data.scenes, bpy.data.worlds, bpy.data.cameras) for block in kind)
    report = export(add_quad("Target", 1.0, 0.0, new_material("Target")))
    assert before == sorted(b.name for kind in (bpy.data.scenes, bpy.data.worlds, bpy.data.cameras) for b in kind)
    assert any("Cycles renders it into a panorama" in note for note in report.notes)
    pictures = {path.name: np.asarray(read_image(path).pixels) for path in (report.folder / "textures").iterdir()}
    camera, light = sorted(pictures.values(), key=lambda p: p.mean())
    polar, azimuth = np.meshgrid(
        (np.arange(512) + 0.5) / 512 * np.pi, (0.5 - (np.arange(1024) + 0.5) / 1024) * 2.0 * np.pi, indexing="ij"
    )
    towards = np.stack([np.sin(polar) * np.cos(azimuth), np.sin(polar) * np.sin(azimuth), np.cos(polar)], -1)
    np.testing.assert_allclose(camera, 0.25 * towards + 0.25, atol=0.002)
    np.testing.assert_allclose(light[1::2], 0.5 * towards + 0.5, atol=0.004)


def test_a_uniform_world_of_other_nodes_is_one_colour(scene: Any, export: Any, render_cycles: Any) -> None:
    """Cycles sends light samples to a varying world alone: they pass a ball that casts no shadows, other light not."""
    from .test_light_levels import floor, tiles
    from .test_light_paths import picture_of, scene_reference

    tree, background = world_nodes(scene)
    group = bpy.data.node_groups.new("Inside", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    color, output = group.nodes.new("ShaderNodeRGB"), group.nodes.new("NodeGroupOutput")
    color.outputs[0].default_value = (0.8, 0.5, 0.1, 1.0)
    group.links.new(color.outputs[0], output.inputs[0])
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    tree.links.new(node.outputs[0], background.inputs["Color"])
    scene.cycles.samples = 256
    target = floor()
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.3, location=(0.6, 0.6, 0.3))
    ball = bpy.context.object
    ball.data.materials.append(new_material("Ball"))
    ball.visible_shadow = False
    expected = render_cycles()
    report = export(target, reference=scene_reference(expected))
    assert not list((report.folder / "textures").iterdir())
    print(report.notes)
    expected, found = tiles(expected), tiles(picture_of(report))
    assert expected.min() < 0.8 * expected.max()  # the ball takes light from the floor
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=0.005)


@pytest.mark.parametrize(
    ("coordinate", "is_said"), [("Window", True), ("Camera", True), ("Generated", False), ("transform", True)]
)
def test_a_world_that_follows_the_camera_is_named(coordinate: str, is_said: bool, scene: Any) -> None:
    from blender_addon.export.job import check_export

    tree, background = world_nodes(scene)
    source, noise = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexNoise")
    output = source.outputs["Generated" if coordinate == "transform" else coordinate]
    if coordinate == "transform":
        turned = tree.nodes.new("ShaderNodeVectorTransform")
        turned.convert_from, turned.convert_to = "WORLD", "CAMERA"
        tree.links.new(output, turned.inputs[0])
        output = turned.outputs[0]
    tree.links.new(output, noise.inputs["Vector"])
    tree.links.new(noise.outputs[0], background.inputs["Color"])
    add_camera("ORTHO", ortho_scale=2.0)
    _, notes = check_export(bpy.context, add_quad("Target", 1.0, 0.0, new_material("Target")))
    assert any("follows the camera that renders the panorama" in note for note in notes) == is_said


def test_sun_of_a_sky_becomes_a_lamp(scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any) -> None:
    from .test_light_levels import floor, tiles

    tree, background = world_nodes(scene)
    sky = tree.nodes.new("ShaderNodeTexSky")
    sky.sun_elevation, sky.sun_rotation = 0.7, 2.0
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    background.inputs["Strength"].default_value = 0.1
    target = floor()
    report = export(target)
    lamp = next(ElementTree.parse(report.folder / "scene.xml").iterfind("emitter[@type='blender_sun']"))
    assert float(lamp.find("float[@name='angle']").get("value")) == pytest.approx(np.degrees(sky.sun_size), rel=1e-4)
    expected, found = tiles(render_cycles()), tiles(render_mitsuba(report, 256))
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=0.01)


@pytest.mark.parametrize("disc", [True, False])
def test_a_sky_with_its_disc_does_not_read_what_is_linked_to_vector(
    disc: bool, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """Blender hides the socket then: with the link the sky was turned in the fit alone."""
    tree, background = world_nodes(scene)
    sky, turned = tree.nodes.new("ShaderNodeTexSky"), tree.nodes.new("ShaderNodeMapping")
    turned.inputs["Rotation"].default_value, sky.sun_disc = (0.5, 0.3, 2.0), False
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], turned.inputs["Vector"])
    tree.links.new(turned.outputs[0], sky.inputs["Vector"])
    sky.sun_elevation, sky.sun_rotation, sky.sun_disc = 0.3, 3.0, disc  # the sun is out of view
    tree.links.new(sky.outputs[0], background.inputs["Color"])
    background.inputs["Strength"].default_value = 0.1
    scene.render.resolution_x = scene.render.resolution_y = 32
    camera = add_camera("PERSP", rotation=(1.6, 0.0, 0.7), lens=18.0)
    target = add_quad("Target", 0.1, 0.0, new_material("Target"))
    bpy.context.view_layer.update()
    target.matrix_world = camera.matrix_world @ Matrix.Translation((0.0, 0.0, -3.0))
    report = export(target)
    pictures = [picture[..., :3].reshape(4, 8, 4, 8, 3).mean(axis=(1, 3)) for picture in (
        render_cycles(), render_mitsuba(report, 64)
    )]  # fmt: skip
    around = np.ones((4, 4), bool)
    around[1:3, 1:3] = False  # where the target is
    np.testing.assert_allclose(pictures[1][around], pictures[0][around], rtol=0.02)


def test_world_that_cannot_be_rendered_is_an_error(scene: Any, export: Any, monkeypatch: Any, tmp_path: Any) -> None:
    from blender_addon.export.job import ExportError
    from blender_addon.probe import client

    tree, background = world_nodes(scene)
    tree.links.new(tree.nodes.new("ShaderNodeTexSky").outputs[0], background.inputs["Color"])
    add_camera("ORTHO", ortho_scale=2.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    for words, said in ((["false"], "has ended"), (["/no/such/program"], "could not be started")):
        monkeypatch.setattr(client, "own_blender", lambda *_arguments, words=words: words)
        with pytest.raises(ExportError, match=f"World 'World' could not be rendered by Cycles: .*{said}"):
            export(target)
        assert not list(tmp_path.iterdir())


def test_a_wide_working_space_is_named_and_its_light_taken_at_the_edge(scene: Any, export: Any) -> None:
    """Deep red light was said to take light away. The sums in Rec.709 are others: a warm lamp was 7 to 24 % off."""
    if not hasattr(getattr(bpy.data, "colorspace", None), "working_space"):
        pytest.skip("this Blender has one working space")
    world_color(scene, 1.0).inputs["Color"].default_value = (1.0, 0.0, 0.0, 1.0)
    lamp = add_light("POINT", energy=10.0)
    lamp.data.color = (1.0, 0.0, 0.0)
    add_camera("ORTHO", ortho_scale=2.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    assert check_export(bpy.context, target) == ([], [])
    bpy.ops.wm.set_working_color_space(working_space="Linear Rec.2020", convert_colors=False)
    errors, notes = check_export(bpy.context, target)
    assert errors == []
    for said in ("World 'World' has colours beyond", "Light 'Light' has a colour beyond", "The working space of this"):
        assert sum(note.startswith(said) for note in notes) == 1
    lamp.data.energy = -10.0
    assert "takes light away" in check_export(bpy.context, target)[0][0]
