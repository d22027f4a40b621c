# SPDX-License-Identifier: Apache-2.0
"""Colours that nodes give to leaves and lace, at the edges of what their pictures leave of them. Oracle: Cycles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from blender_addon.versions import active_output  # noqa: E402

from ..scenes import add_quad, new_material, world_color  # noqa: E402
from .test_node_graphs import lit_scene, principled, renderer_and_cycles  # noqa: E402

TEXELS, WAVES = 256, 20


def lace() -> Any:
    """A picture of one colour with round holes, whose colour is black, as painting programs leave it."""
    row, column = np.meshgrid(np.arange(TEXELS), np.arange(TEXELS), indexing="ij")
    wave = 2.0 * np.pi * WAVES / TEXELS
    there = np.sin(row * wave) * np.sin(column * wave) < 0.2
    pixels = np.repeat(there[..., None].astype(np.float32), 4, axis=2)
    pixels[..., :3] *= 0.85
    image = bpy.data.images.new("Lace", TEXELS, TEXELS, alpha=True)
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image


@pytest.mark.parametrize("cut", ["alpha", "transparent", "both"])
def test_holes_take_nothing_of_a_tinted_picture(
    cut: str, scene: Any, export: Any, render_cycles: Callable[[], Any], mitsuba: Any
) -> None:
    """A card in front of a dark floor; means that held the black of the holes made it 3.4 % too dark."""
    lit_scene(scene)
    scene.cycles.samples = 256
    world_color(scene, 0.3)
    material = new_material("Target", Roughness=0.9)
    tree, shader = material.node_tree, principled(material)
    picture, tint = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeHueSaturation")
    picture.image, tint.inputs["Value"].default_value = lace(), 0.9
    tree.links.new(picture.outputs["Color"], tint.inputs["Color"])
    tree.links.new(tint.outputs["Color"], shader.inputs["Base Color"])
    if cut != "transparent":
        tree.links.new(picture.outputs["Alpha"], shader.inputs["Alpha"])
    if cut != "alpha":
        mix, clear = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfTransparent")
        tree.links.new(picture.outputs["Alpha"], mix.inputs[0])
        tree.links.new(clear.outputs[0], mix.inputs[1])
        tree.links.new(shader.outputs[0], mix.inputs[2])
        tree.links.new(mix.outputs[0], active_output(tree).inputs["Surface"])
    add_quad("Floor", 6.0, -1.0, new_material("Floor", Base_Color=(0.05, 0.05, 0.05)))
    card = add_quad("Card", 2.0, 0.0, material)
    card.data.uv_layers.new()
    renderer, truth = renderer_and_cycles(export, render_cycles, card)
    found = np.mean([renderer.image(renderer.start, seed=seed, spp=64) for seed in range(2)], axis=0)
    inside = np.asarray(renderer.target_mask()).reshape(found.shape[:2])
    assert abs(found[inside].mean() / truth[inside].mean() - 1.0) < 0.01
