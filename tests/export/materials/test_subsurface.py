# SPDX-License-Identifier: Apache-2.0
"""Subsurface of the target, as Cycles shows it: by recorded walks and by pictures."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from ..scenes import add_camera, add_light, add_quad, new_material  # noqa: E402
from .test_node_graphs import ball, principled, renderer_and_cycles  # noqa: E402

SAMPLES, RECORDINGS = 256, 4
VALUES = {"Subsurface_Weight": 1.0, "Subsurface_Scale": 0.8, "Base_Color": (0.8, 0.5, 0.3)}


def lit(scene: Any) -> None:
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.cycles.samples = SAMPLES
    add_camera("PERSP", location=(0.0, 0.0, 4.0))
    add_light("POINT", location=(2.5, 1.0, 1.5), energy=300.0, shadow_soft_size=0.0)


def monkey(material: Any) -> Any:
    bpy.ops.mesh.primitive_monkey_add(rotation=(-1.2, 0.0, 0.3))
    item = bpy.context.object
    item.modifiers.new("Smooth", "SUBSURF").levels = 2
    bpy.ops.object.shade_smooth()
    item.data.materials.append(material)
    return item


def same_level(export: Any, render_cycles: Any, target: Any) -> None:
    """Levels of a recorded picture within its noise, about 0.7 % in blue."""
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    renderer, wanted = renderer_and_cycles(export, render_cycles, target)
    recorded, found = RecordedScene(renderer, int(renderer.target_mask().sum())), []
    for seed in range(RECORDINGS):
        paths = recorded.record(renderer.start, grid=8, seed=seed, near=True)
        groups = paths.pixel_groups(paths.interior)
        found.append(np.asarray(recorded.pictures(paths, groups)(renderer.start))[:, :, 0].mean(axis=0))
    np.testing.assert_allclose(np.mean(found, axis=0), wanted.reshape(-1, 3)[groups.pixels].mean(axis=0), rtol=0.02)


@pytest.mark.parametrize("method", ["RANDOM_WALK", "RANDOM_WALK_SKIN"])
@pytest.mark.parametrize("anisotropy", [0.0, 0.6])
def test_a_ball_of_wax(scene: Any, export: Any, render_cycles: Any, method: str, anisotropy: float) -> None:
    lit(scene)
    material = new_material("Wax", Subsurface_Anisotropy=anisotropy, **VALUES)
    principled(material).subsurface_method = method
    same_level(export, render_cycles, ball(material))


@pytest.mark.parametrize("colour", [(0.93, 0.97, 1.0), (0.7, 0.85, 0.99)])
def test_bright_skin(scene: Any, export: Any, render_cycles: Any, colour: tuple[float, float, float]) -> None:
    """Walks below it are as long as Cycles makes them; with those of the dipole itself half of the light was lost."""
    lit(scene)
    material = new_material("Skin", **{**VALUES, "Base_Color": colour})
    principled(material).subsurface_method = "RANDOM_WALK_SKIN"
    same_level(export, render_cycles, ball(material))


@pytest.mark.parametrize("scale", [0.8, 4.0])
@pytest.mark.parametrize("shape", [ball, monkey])
def test_the_profile_of_christensen_and_burley(
    scene: Any, export: Any, render_cycles: Any, shape: Callable[[Any], Any], scale: float
) -> None:
    """Of a ball, and of a head with ears and eyes that are no part of it."""
    lit(scene)
    material = new_material("Skin", **{**VALUES, "Subsurface_Scale": scale})
    principled(material).subsurface_method = "BURLEY"
    same_level(export, render_cycles, shape(material))


def test_the_node_by_itself(scene: Any, export: Any, render_cycles: Any) -> None:
    lit(scene)
    material = new_material("Node")
    tree = material.node_tree
    node = tree.nodes.new("ShaderNodeSubsurfaceScattering")
    node.inputs["Color"].default_value, node.inputs["Scale"].default_value = (0.8, 0.5, 0.3, 1.0), 0.8
    tree.links.new(node.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"])
    same_level(export, render_cycles, ball(material))


def test_light_goes_on_below_another_slot(scene: Any, export: Any, render_cycles: Any) -> None:
    """Half of the ball has another material of the same colour; without its faces the walks would be lost."""
    lit(scene)
    target = ball(new_material("Wax", **VALUES))
    target.data.materials.append(new_material("Cap", Subsurface_Weight=1.0, Subsurface_Scale=0.8,
                                              Base_Color=(0.8, 0.5, 0.3)))  # fmt: skip
    for face in target.data.polygons:
        face.material_index = int(face.center.x < 0.0)
    same_level(export, render_cycles, target)


def test_a_radius_of_nodes(scene: Any, export: Any, render_cycles: Any) -> None:
    lit(scene)
    material = new_material("Wax", **VALUES)
    tree, node = material.node_tree, principled(material)
    ramp = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], ramp.inputs[0])
    tree.links.new(ramp.outputs["Y"], node.inputs["Subsurface Scale"])
    same_level(export, render_cycles, ball(material))


def test_what_encloses_nothing_lets_no_light_out(scene: Any, export: Any, render_cycles: Any) -> None:
    """A plane is black but for its reflection; no walk leaves it."""
    lit(scene)
    bpy.ops.mesh.primitive_plane_add(size=3.0)
    target = bpy.context.object
    target.data.materials.append(new_material("Wax", Specular_IOR_Level=1.0, **VALUES))
    same_level(export, render_cycles, target)


def mixed(material: Any, node: Any, factor: float = 0.5) -> None:
    """The material's shader and another one, which takes `factor` of it."""
    tree, output = material.node_tree, material.node_tree.get_output_node("CYCLES")
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs[0].default_value = factor
    tree.links.new(principled(material).outputs[0], mix.inputs[1])
    tree.links.new(node.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])


def wax_under_gloss() -> Any:
    material = new_material("Wax", Roughness=0.6, **VALUES)
    gloss = material.node_tree.nodes.new("ShaderNodeBsdfAnisotropic")
    gloss.inputs["Roughness"].default_value = 0.4
    mixed(material, gloss, 0.3)
    return material


def paint_over_wax() -> Any:
    material = new_material("Paint", Base_Color=(0.1, 0.3, 0.6), Roughness=0.4)
    wax = material.node_tree.nodes.new("ShaderNodeSubsurfaceScattering")
    wax.inputs["Color"].default_value, wax.inputs["Scale"].default_value = (0.8, 0.5, 0.3, 1.0), 0.8
    mixed(material, wax, 0.7)
    return material


@pytest.mark.parametrize(
    ("build", "parameters"),
    [
        (wax_under_gloss, ["Principled BSDF/IOR"]),
        (wax_under_gloss, ["Principled BSDF/Base Color", "Glossy BSDF/Roughness"]),
        (paint_over_wax, ["Principled BSDF/IOR"]),
        (paint_over_wax, ["Principled BSDF/IOR", "Subsurface Scattering/Color"]),
        (paint_over_wax, ["Principled BSDF/IOR", f"Mix Shader/{'Factor' if bpy.app.version >= (5, 0) else 'Fac'}"]),
    ],
    ids=["the fitted one", "the fitted one of several", "a held one", "a free one", "a held one with a free share"],
)
def test_one_shader_of_a_mix(
    scene: Any, export: Any, render_cycles: Any, build: Callable[[], Any], parameters: list[str]
) -> None:
    """Whichever shader is fitted, and whether what light walks below may change."""
    lit(scene)
    same_level(partial(export, fit={"parameters": parameters}), render_cycles, ball(build()))


@pytest.mark.parametrize("build", [wax_under_gloss, paint_over_wax])
def test_a_mix_from_another_camera_is_what_its_own_camera_sees(
    scene: Any, export: Any, render_cycles: Any, build: Callable[[], Any]
) -> None:
    """As it is recorded where a further picture is looked for: from the very place the level is the same."""
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    lit(scene)
    of_one = partial(export, fit={"parameters": ["Principled BSDF/IOR"]})
    renderer, _ = renderer_and_cycles(of_one, render_cycles, ball(build()))
    recorded, levels = RecordedScene(renderer, int(renderer.target_mask().sum())), []
    sensor = renderer.scene.sensors()[0]
    for paths in (
        recorded.record(renderer.start, grid=8, seed=0, near=True),
        recorded.record_from(sensor, renderer.start, grid=8, seed=0),
    ):
        groups = paths.pixel_groups(paths.interior)
        levels.append(np.asarray(recorded.evaluator(paths, groups)(renderer.start))[:, :, 0].mean(axis=0))
    np.testing.assert_allclose(levels[1], levels[0], rtol=0.03)  # noise of blue is 1.4 % in each


@pytest.mark.parametrize("alpha", [0.0, 0.5])
def test_wax_behind_a_cut_out(scene: Any, export: Any, render_cycles: Any, mitsuba: Any, alpha: float) -> None:
    """A sheet to fit of which one half is cut out, and a ball of wax behind it: nothing of the wax came through."""
    lit(scene)
    ball(new_material("Wax", Roughness=1.0, Specular_IOR_Level=0.0, **VALUES))
    material = new_material("Sheet", Base_Color=(0.2, 0.2, 0.2), Roughness=0.8)
    tree = material.node_tree
    split, edge = tree.nodes.new("ShaderNodeSeparateXYZ"), tree.nodes.new("ShaderNodeMapRange")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], split.inputs[0])
    tree.links.new(split.outputs["X"], edge.inputs["Value"])
    edge.interpolation_type = "STEPPED"
    edge.inputs["Steps"].default_value, edge.inputs["To Min"].default_value = 1.0, 1.0
    edge.inputs["To Max"].default_value = alpha
    tree.links.new(edge.outputs[0], principled(material).inputs["Alpha"])
    sheet = add_quad("Sheet", 1.2, 1.3, material)
    renderer, wanted = renderer_and_cycles(export, render_cycles, sheet)
    found = np.mean([renderer.image(renderer.start, seed=seed, spp=SAMPLES) for seed in range(RECORDINGS)], axis=0)
    open_half = slice(12, 20), slice(17, 22)
    np.testing.assert_allclose(found[open_half].mean(axis=(0, 1)), wanted[open_half].mean(axis=(0, 1)), rtol=0.03)


@pytest.mark.parametrize("tilt", [0.12, -0.12])
@pytest.mark.parametrize("method", ["RANDOM_WALK", "RANDOM_WALK_SKIN", "BURLEY"])
def test_light_leaves_by_the_normal_that_nodes_give(
    scene: Any, export: Any, render_cycles: Any, tilt: float, method: str
) -> None:
    """Of a slab under a slanting lamp: with the mesh's own normals it was twice as bright, or a third too dark."""
    lit(scene)
    material = new_material("Wax", **{**VALUES, "Subsurface_Scale": 0.02, "Specular_IOR_Level": 0.0})
    principled(material).subsurface_method = method
    tree = material.node_tree
    tilted = tree.nodes.new("ShaderNodeNormalMap")
    tilted.inputs["Color"].default_value = (0.5 + tilt, 0.5, 0.9, 1.0)
    tree.links.new(tilted.outputs[0], principled(material).inputs["Normal"])
    bpy.ops.mesh.primitive_cube_add(size=2.0, scale=(1.0, 1.0, 0.3))
    bpy.context.object.data.materials.append(material)
    same_level(export, render_cycles, bpy.context.object)


@pytest.mark.parametrize("method", ["RANDOM_WALK", "RANDOM_WALK_SKIN", "BURLEY"])
def test_a_channel_without_a_radius_is_diffuse(scene: Any, export: Any, render_cycles: Any, method: str) -> None:
    """Red of icing whose Subsurface Radius begins with zero was half as bright as it should be."""
    lit(scene)
    material = new_material("Icing", Subsurface_Radius=(0.0, 0.09, 0.09), **{**VALUES, "Subsurface_Scale": 0.1})
    principled(material).subsurface_method = method
    same_level(export, render_cycles, ball(material))
