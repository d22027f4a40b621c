# SPDX-License-Identifier: Apache-2.0
"""Nodes are looked at wherever the render shows their material, also beyond the faces that the viewport has of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from ..scenes import add_quad, new_material, world_color  # noqa: E402
from .test_displacement import displace  # noqa: E402
from .test_node_graphs import lit_scene, principled, recorded_and_cycles, renderer_and_cycles  # noqa: E402


def striped(name: str = "Target") -> Any:
    """Black and white by the place in the world: the mean of both is far from either."""
    material = new_material(name, Roughness=0.8)
    tree = material.node_tree
    checker = tree.nodes.new("ShaderNodeTexChecker")
    checker.inputs["Color1"].default_value, checker.inputs["Color2"].default_value = (0.9,) * 4, (0.02,) * 4
    checker.inputs["Scale"].default_value = 2.0
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], checker.inputs["Vector"])
    tree.links.new(checker.outputs["Color"], principled(material).inputs["Base Color"])
    return material


def small_ball(material: Any) -> Any:
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.4, segments=48, ring_count=24)
    item = bpy.context.object
    item.data.materials.append(material)
    return item


def moved_by_its_material() -> Any:
    material = striped()
    height = material.node_tree.nodes.new("ShaderNodeValue").outputs[0]
    height.default_value = 1.0
    displace(material, height, 0.6, "DISPLACEMENT")
    return small_ball(material)


def moved_by_a_modifier_of_the_render() -> Any:
    item = small_ball(striped())
    modifier = item.modifiers.new("Displace", "DISPLACE")
    modifier.strength, modifier.mid_level, modifier.show_viewport = 0.6, 0.0, False
    return item


def repeated_in_the_render() -> Any:
    item = small_ball(striped())
    item.location.x = -0.9
    modifier = item.modifiers.new("Array", "ARRAY")
    modifier.count, modifier.show_viewport = 3, False
    modifier.relative_offset_displace = (1.1, 0.0, 0.0)
    return item


@pytest.mark.parametrize("build", [moved_by_its_material, moved_by_a_modifier_of_the_render, repeated_in_the_render])
def test_the_picture_is_that_of_cycles_all_over_the_target(
    scene: Any, export: Any, render_cycles: Callable[[], Any], mitsuba: Any, build: Callable[[], Any]
) -> None:
    """Beyond the viewport's faces the mean of black and white stood in."""
    lit_scene(scene)
    scene.cycles.samples = 256
    found, truth = recorded_and_cycles(export, render_cycles, build())
    assert abs(found.mean() / truth.mean() - 1.0) < 0.006
    assert np.sqrt(np.mean((found - truth) ** 2)) / truth.mean() < 0.06


def test_what_is_behind_glass_has_its_own_colours(
    scene: Any, export: Any, render_cycles: Callable[[], Any], mitsuba: Any
) -> None:
    """A table under a plate that bends nothing: below it the mean of black and white stood in."""
    lit_scene(scene)
    scene.cycles.samples = 256
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = scene.cycles.transmission_bounces = 6
    world_color(scene, 0.5)
    table = add_quad("Table", 6.0, 0.0, striped())
    clear = new_material("Clear", Base_Color=(1.0, 1.0, 1.0), Transmission_Weight=1.0, Roughness=0.0, IOR=1.0)
    add_quad("Plate", 1.2, 0.4, clear)
    renderer, truth = renderer_and_cycles(export, render_cycles, table)
    found = np.mean([renderer.image(renderer.start, seed=seed, spp=64) for seed in range(2)], axis=0)
    below = slice(16, 32), slice(16, 32)
    assert np.sqrt(np.mean((found[below] - truth[below]) ** 2)) / truth[below].mean() < 0.2
