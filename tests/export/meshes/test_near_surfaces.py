# SPDX-License-Identifier: Apache-2.0
"""Surfaces a tenth of a millimetre apart, and small things that stand on large ones. Oracle: Cycles' render."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy
import numpy as np
import pytest

from ..scene.test_light_paths import picture_of, scene_reference
from ..scenes import add_camera, add_light, add_quad, diffuse_material, new_material, world_color

KINDS = {
    "cut-out": {"Base_Color": (0.8, 0.3, 0.1), "Alpha": 0.4},
    "glass": {"Base_Color": (0.9, 0.9, 0.9), "Transmission_Weight": 1.0, "Roughness": 0.0, "IOR": 1.0},
}


@pytest.mark.parametrize("gap", [1e-4, 2e-5])
@pytest.mark.parametrize("kind", KINDS)
def test_what_lies_close_below_is_seen_and_lit(
    scene: Any, export: Any, render_cycles: Callable[[], Any], mitsuba: Any, kind: str, gap: float
) -> None:
    """A decal on a box, a label behind glass: both seen from above, under a sky, a metre from zero."""
    scene.render.resolution_x = scene.render.resolution_y = 16
    cycles = scene.cycles
    cycles.max_bounces = cycles.diffuse_bounces = cycles.transmission_bounces = 4
    cycles.samples = 512
    world_color(scene, 0.4)
    add_camera("ORTHO", (0, 0, 5), ortho_scale=1.0)
    below = add_quad("Below", 2.0, 1.0, new_material("Below", Base_Color=(0.2, 0.5, 0.7), Roughness=0.8))
    add_quad("Floor", 4.0, 0.0, diffuse_material("Floor", (0.05, 0.05, 0.05)))
    add_quad("Above", 0.6, 1.0 + gap, new_material("Above", **KINDS[kind]))
    expected = render_cycles()
    ours = picture_of(export(below, reference=scene_reference(expected)), rounds=16)
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), expected.mean(axis=(0, 1)), rtol=0.005)


def test_light_reaches_below_a_small_thing_on_a_shelf(
    scene: Any, export: Any, render_cycles: Callable[[], Any], mitsuba: Any
) -> None:
    """A ball of 4 mm on a shelf of a metre, all opaque: what the shelf shows around the place where they touch."""
    scene.render.resolution_x = scene.render.resolution_y = 24
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 4
    scene.cycles.samples = 512
    world_color(scene, 0.5)
    add_light("AREA", (-0.01, -0.02, 0.03), rotation=(0.6, -0.3, 0.0), energy=0.01, size=0.01)
    add_camera("ORTHO", (0, -0.02, 0.012), rotation=(1.05, 0, 0), ortho_scale=0.003, clip_start=1e-4)
    shelf = add_quad("Shelf", 1.0, 0.0, diffuse_material("Shelf", (0.6, 0.5, 0.4)))
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.002, location=(0.0, 0.0, 0.002), segments=48, ring_count=24)
    bpy.context.object.data.materials.append(diffuse_material("Ball", (0.6, 0.1, 0.1)))
    expected = render_cycles()
    ours = picture_of(export(shelf, reference=scene_reference(expected)), rounds=16)
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), expected.mean(axis=(0, 1)), rtol=0.005)


def test_no_light_of_a_lamp_comes_through_the_ceiling_it_is_aslant_in(
    scene: Any, export: Any, render_cycles: Callable[[], Any], mitsuba: Any
) -> None:
    """A strip lies some millimetres above: shadow rays ended 2.7 mm before it, and the floor was 5.2 % too bright."""
    scene.render.resolution_x = scene.render.resolution_y = 16
    scene.cycles.max_bounces = 0
    scene.cycles.samples = 1024
    grey = diffuse_material("Grey", (0.6, 0.6, 0.6))
    floor = add_quad("Floor", 6.0, 0.0, grey)
    add_quad("Ceiling", 6.0, 3.0, diffuse_material("White", (0.8, 0.8, 0.8)))
    add_light("AREA", (0.0, 0.0, 2.99), rotation=(0.05, 0.0, 0.0), energy=60.0, size=1.5)
    add_camera("PERSP", (0.0, -2.0, 1.5), rotation=(0.9, 0.0, 0.0), lens=30.0)
    expected = render_cycles()
    ours = picture_of(export(floor, reference=scene_reference(expected)), rounds=32)
    np.testing.assert_allclose(ours.mean(axis=(0, 1)), expected.mean(axis=(0, 1)), rtol=0.008)
