# SPDX-License-Identifier: Apache-2.0
"""A glowing panel with holes or layers above a floor: Cycles against the exported scene in Mitsuba."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from studies.parity.cycles_parity import render_job

from ..scene.test_light_levels import tiles
from ..scenes import add_camera, add_light, add_quad, diffuse_material, new_material

GLOW = {"Emission_Color": (1.0, 0.5, 0.2), "Emission_Strength": 2.0}
BLACK = {"Base_Color": (0.0, 0.0, 0.0), "Specular_IOR_Level": 0.0, "Roughness": 1.0}


def image_node(material: Any) -> Any:
    """An image node of smooth colours and alphas: between its pixels a product is not that of the pixels."""
    image = bpy.data.images.new("glow", 16, 16, float_buffer=True, alpha=True)
    image.alpha_mode = "CHANNEL_PACKED"
    x, y = np.meshgrid(np.linspace(0.0, 3.0, 16), np.linspace(0.0, 2.0, 16))
    waves = np.stack([np.sin(x + y), np.cos(x - y), np.sin(2.0 * y), np.cos(2.0 * x)], axis=-1)
    image.pixels.foreach_set((0.5 + 0.4 * waves).astype(np.float32).ravel())
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    return node


def link(material: Any, output: Any, name: str) -> None:
    tree = material.node_tree
    shader = tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    tree.links.new(output, shader.inputs[name])


def even(material: Any) -> None:
    shader = material.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    shader.inputs["Alpha"].default_value = 0.4


def holes(material: Any) -> None:
    link(material, image_node(material).outputs["Alpha"], "Alpha")


def coloured(material: Any) -> None:
    even(material)
    link(material, image_node(material).outputs["Color"], "Emission Color")


def sprite(material: Any) -> None:
    node = image_node(material)
    link(material, node.outputs["Alpha"], "Alpha")
    link(material, node.outputs["Color"], "Emission Color")


def baked(material: Any) -> None:
    """Nodes that Cycles bakes, below a coat."""
    noise = material.node_tree.nodes.new("ShaderNodeTexNoise")
    link(material, noise.outputs[0], "Alpha")
    shader = material.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    shader.inputs["Coat Weight"].default_value = 0.8
    shader.inputs["Coat Tint"].default_value = (0.5, 0.5, 0.5, 1.0)


def _mixed(material: Any, shader: Any) -> None:
    """By a noise that shader and Transparent, of which Transparent takes half."""
    tree = material.node_tree
    new, join = tree.nodes.new, tree.links.new
    clear, inner, outer = new("ShaderNodeBsdfTransparent"), new("ShaderNodeMixShader"), new("ShaderNodeMixShader")
    outer.inputs[0].default_value = 0.5
    join(new("ShaderNodeTexNoise").outputs[0], inner.inputs[0])
    for output, socket in (
        (shader.outputs[0], inner.inputs[1]),
        (clear.outputs[0], inner.inputs[2]),
        (inner.outputs[0], outer.inputs[1]),
        (clear.outputs[0], outer.inputs[2]),
        (outer.outputs[0], tree.get_output_node("CYCLES").inputs["Surface"]),
    ):
        join(output, socket)


def flame(material: Any) -> None:
    glow = material.node_tree.nodes.new("ShaderNodeEmission")
    glow.inputs["Color"].default_value, glow.inputs["Strength"].default_value = (1.0, 0.5, 0.2, 1.0), 4.0
    _mixed(material, glow)


def pierced(material: Any) -> None:
    _mixed(material, material.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node)


def dented(material: Any) -> None:
    """Bumps below a coat, and holes."""
    baked(material)
    new, join = material.node_tree.nodes.new, material.node_tree.links.new
    bump = new("ShaderNodeBump")
    bump.inputs["Strength"].default_value, bump.inputs["Distance"].default_value = 0.3, 0.1
    join(new("ShaderNodeTexNoise").outputs[0], bump.inputs["Height"])
    link(material, bump.outputs[0], "Normal")


def added(material: Any) -> None:
    """As much glow again, of a shader beside it."""
    dented(material)
    tree = material.node_tree
    surface, both = tree.get_output_node("CYCLES").inputs["Surface"], tree.nodes.new("ShaderNodeAddShader")
    tree.links.new(surface.links[0].from_node.outputs[0], both.inputs[0])
    tree.links.new(tree.nodes.new("ShaderNodeEmission").outputs[0], both.inputs[1])
    tree.links.new(both.outputs[0], surface)


BAKED = (baked, flame, pierced, dented, added)


@pytest.mark.parametrize("change", [even, holes, coloured, sprite, *BAKED], ids=lambda change: change.__name__)
def test_alpha_dims_what_it_lets_through(
    scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any, change: Any, tmp_path: Path
) -> None:
    add_quad("Floor", 4.0, 0.0, diffuse_material("Floor", (0.5, 0.5, 0.5)))
    add_camera("ORTHO", ortho_scale=2.0)
    target = add_quad("Target", 0.2, 0.001, new_material("Target"))
    material = new_material("Panel", **BLACK, **GLOW)
    panel = add_quad("Panel", 1.2, 1.0, material)
    panel.data.uv_layers.new()
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 4  # Mitsuba counts what a ray passes
    change(material)
    expected = tiles(render_cycles())
    report = export(target, reference=tmp_path / "cycles.exr")
    # Mitsuba's own principled has no coat that dims
    shown = np.mean(render_job(report.folder, 512), axis=0) if change in BAKED else render_mitsuba(report, spp=256)
    found = tiles(shown)
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=0.01)
    np.testing.assert_allclose(found, expected, rtol=0.1, atol=0.02)
    assert [n for n in report.notes if "dimmed" in n and "mitsuba_principled" not in n] == []


LAYERS = {
    "alpha": {"Alpha": 0.4},
    "coat": {"Coat_Weight": 1.0, "Coat_Roughness": 0.4, "Coat_Tint": (0.8, 0.5, 0.3)},
    "sheen": {"Sheen_Weight": 1.0, "Sheen_Roughness": 0.6},
    "glass": {"Transmission_Weight": 1.0, "Roughness": 0.3, "Base_Color": (0.9, 0.9, 0.9)},
}


# light samples have another share in Cycles, and see no sheen there
CLOSE = {"sheen": 0.01}


@pytest.mark.parametrize(
    ("form", "layer", "is_target"),
    [
        *(("box", "alpha", False), ("box", "coat", True), ("box", "sheen", False), ("box", "glass", True)),
        *(("sheet", "alpha", True), ("sheet", "glass", False)),
    ],
)
def test_layers_take_their_part_and_both_sides_shine(
    scene: Any, export: Any, render_cycles: Any, tmp_path: Path, form: str, layer: str, is_target: bool
) -> None:
    """A box was up to 37 % too dark where its inside shows, and a coated sheet 31 % too bright."""
    add_quad("Floor", 4.0, 0.0, diffuse_material("Floor", (0.5, 0.5, 0.5)))
    add_camera("ORTHO", ortho_scale=2.0)
    if layer != "glass":  # whose caustics of it are fireflies
        add_light("SUN", energy=3.0, rotation=(0.3, 0.2, 0.5))
    target = add_quad("Target", 0.2, 0.001, new_material("Target"))
    target.location.x = target.location.y = -0.85
    glow = new_material("Glow", **BLACK | GLOW | LAYERS[layer])
    if form == "box":
        bpy.ops.mesh.primitive_cube_add(size=0.8, location=(0.3, 0.3, 0.6))
        glowing = bpy.context.object
        glowing.data.materials.append(glow)
    else:
        glowing = add_quad("Sheet", 1.2, 1.0, glow)
    cycles = scene.cycles
    cycles.max_bounces = cycles.diffuse_bounces = cycles.transmission_bounces = cycles.glossy_bounces = 8
    cycles.samples = 512
    expected = tiles(render_cycles())
    report = export(glowing if is_target else target, reference=tmp_path / "cycles.exr")
    found = tiles(np.mean(render_job(report.folder, 1024), axis=0))
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=CLOSE.get(layer, 0.005))
    np.testing.assert_allclose(found, expected, rtol=0.12, atol=0.02)
    assert not [note for note in report.notes if "emission" in note and "mitsuba_principled" not in note]


def test_bent_normals_send_no_light_into_the_mesh(mitsuba: Any, tmp_path: Path) -> None:
    """A smooth text that glows: samples below its faces met its inside, which was 2 % of what the text shows."""
    from studies.differential.study import try_scene

    outcome = try_scene(("glowing box", "text"), 40412, tmp_path, size=32, samples=256)
    assert outcome.difference is not None
    assert not outcome.difference.is_failure
    assert abs(outcome.difference.level) < 0.0015
