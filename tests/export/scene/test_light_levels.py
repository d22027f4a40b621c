# SPDX-License-Identifier: Apache-2.0
"""Light on a Lambertian floor: Cycles against the exported scene in Mitsuba, for every light and option."""

from __future__ import annotations

import math
from contextlib import nullcontext
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.job import ExportError, check_export

from ..scenes import add_camera, add_light, add_quad, diffuse_material, new_material, world_color

TILTED = {"location": (0.7, -0.4, 2.5), "rotation": (0.3, 0.2, 0.5)}
SHARP = {"use_soft_falloff": False}
CASES = {
    "point": ("POINT", {"energy": 100, "shadow_soft_size": 0.0}),
    "point coloured": ("POINT", {"energy": 100, "shadow_soft_size": 0.0, "color": (1.0, 0.5, 0.1)}),
    "point exposure": ("POINT", {"energy": 100, "shadow_soft_size": 0.0, "exposure": 1.5}),
    "point temperature": (
        "POINT",
        {"energy": 100, "shadow_soft_size": 0.0, "use_temperature": True, "temperature": 3000.0},
    ),
    "point not normalised": ("POINT", {"energy": 10, "shadow_soft_size": 0.0, "normalize": False}),
    "sphere": ("POINT", {"energy": 100, "shadow_soft_size": 0.5, **SHARP}),
    "sphere not normalised": ("POINT", {"energy": 10, "shadow_soft_size": 0.5, "normalize": False, **SHARP}),
    "sphere scaled": ("POINT", {"energy": 100, "shadow_soft_size": 0.3, "scale": (2, 2, 2), **SHARP}),
    "sphere soft falloff": ("POINT", {"energy": 100, "shadow_soft_size": 0.3}),
    "sun": ("SUN", {"energy": 3, "angle": 0.0, **TILTED}),
    "sun disk": ("SUN", {"energy": 3, "angle": math.radians(20), **TILTED}),
    "sun wide": ("SUN", {"energy": 3, "angle": math.radians(90)}),
    "sun not normalised": ("SUN", {"energy": 3, "angle": math.radians(20), "normalize": False}),
    "spot": ("SPOT", {"energy": 100, "shadow_soft_size": 0.0, "spot_size": 0.8, "spot_blend": 0.15, **TILTED}),
    "spot hard": ("SPOT", {"energy": 100, "shadow_soft_size": 0.0, "spot_size": 0.5, "spot_blend": 0.0}),
    "spot soft": ("SPOT", {"energy": 100, "shadow_soft_size": 0.0, "spot_size": 1.2, "spot_blend": 1.0}),
    "spot wide": ("SPOT", {"energy": 100, "shadow_soft_size": 0.0, "spot_size": 2.6, "spot_blend": 0.5}),
    "spot scaled": (
        "SPOT",
        {"energy": 100, "shadow_soft_size": 0.0, "spot_size": 0.8, "spot_blend": 0.5, "scale": (0.5, 1.5, 1)},
    ),
    "spot not normalised": ("SPOT", {"energy": 10, "shadow_soft_size": 0.0, "normalize": False, "spot_size": 2.0}),
    "spot with radius not normalised": (
        "SPOT",
        {"energy": 10, "shadow_soft_size": 0.2, "normalize": False, "spot_size": 2.0, "spot_blend": 0.2},
    ),
    "spot with sharp radius": (
        "SPOT",
        {"energy": 100, "shadow_soft_size": 0.2, "spot_size": 2.0, "spot_blend": 0.0, **SHARP},
    ),
    "spot with radius": ("SPOT", {"energy": 100, "shadow_soft_size": 0.2, "spot_size": 2.0, "spot_blend": 0.2}),
    "square": ("AREA", {"energy": 100, "shape": "SQUARE", "size": 1.0}),
    "rectangle": ("AREA", {"energy": 100, "shape": "RECTANGLE", "size": 0.5, "size_y": 2.0, **TILTED}),
    "disk": ("AREA", {"energy": 100, "shape": "DISK", "size": 1.0, **TILTED}),
    "ellipse": ("AREA", {"energy": 100, "shape": "ELLIPSE", "size": 0.5, "size_y": 1.5}),
    "area scaled": ("AREA", {"energy": 100, "shape": "RECTANGLE", "size": 0.5, "size_y": 1.0, "scale": (2, 0.5, 3)}),
    "area not normalised": ("AREA", {"energy": 10, "shape": "SQUARE", "size": 0.5, "normalize": False}),
    "area spread": ("AREA", {"energy": 100, "shape": "SQUARE", "size": 0.5, "spread": math.radians(90)}),
    "disk narrow": ("AREA", {"energy": 100, "shape": "DISK", "size": 0.5, "spread": math.radians(40)}),
}


def floor() -> Any:
    """A floor under the camera with a small target in its middle."""
    add_quad("Floor", 4.0, 0.0, diffuse_material("Floor", (0.5, 0.5, 0.5)))
    add_camera("ORTHO", ortho_scale=2.0)
    return add_quad("Target", 0.2, 0.001, new_material("Target"))


def tiles(pixels: np.ndarray) -> np.ndarray:
    """Means over 4x4 pixels, without those that see the target."""
    means = pixels.reshape(8, 4, 8, 4, 3).mean(axis=(1, 3))
    keep = np.ones((8, 8), bool)
    keep[3:5, 3:5] = False
    return means[keep]


def test_light_nodes(scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any) -> None:
    """One Emission node with plain values multiplies the light, without a second Blender."""
    target = floor()
    light = add_light("POINT", energy=100, shadow_soft_size=0.0).data
    light.use_nodes = True
    emission = light.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    emission.inputs["Color"].default_value = (0.5, 0.8, 0.2, 1.0)
    emission.inputs["Strength"].default_value = 2.5
    expected, found = tiles(render_cycles()), tiles(render_mitsuba(export(target)))
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=0.005)


def test_portal_and_negative_light(scene: Any) -> None:
    target = floor()
    world_color(scene, 1.0)
    portal = add_light("AREA", energy=100).data
    portal.cycles.is_portal = True
    errors, notes = check_export(bpy.context, target)
    assert errors == []
    assert notes == ["Light 'Light' is a portal, which gives no light of its own; it is left out."]
    portal.cycles.is_portal = False
    portal.energy = -1.0
    assert check_export(bpy.context, target)[0] == [
        "Light 'Light' takes light away (negative power or colour): make it positive."
    ]


@pytest.mark.parametrize("shown", ["target", "baked", "plain"])
@pytest.mark.parametrize("is_open", [False, True])
def test_a_principled_bsdf_that_takes_light_is_refused(
    is_open: bool, shown: str, scene: Any, export: Any, render_cycles: Any
) -> None:
    """Emission below zero: it takes 17 to 130 % of a picture, before Blender 5 and by Open Shading Language."""
    target = floor()
    world_color(scene, 1.0)
    dark = target if shown == "target" else add_quad("Dark", 0.4, 0.5, new_material("Dark", Emission_Strength=-0.9))
    dark.location.x += 0.5
    tree = dark.data.materials[0].node_tree
    scene.cycles.samples = 4
    shader = tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    shader.inputs["Emission Strength"].default_value = -0.9
    shader.inputs["Emission Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    if shown == "baked":
        noise = tree.nodes.new("ShaderNodeTexNoise")
        tree.links.new(noise.outputs["Color"], shader.inputs["Base Color"])
    scene.cycles.shading_system = is_open
    takes = is_open or bpy.app.version < (5, 0)
    assert (render_cycles().min() < 0.0) == takes
    with pytest.raises(ExportError, match="takes light away") if takes else nullcontext():
        export(target)


@pytest.mark.parametrize("case", CASES)
def test_level_on_floor(case: str, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any) -> None:
    kind, settings = CASES[case]
    known = set(bpy.types.Light.bl_rna.properties.keys())  # `size` and others are of its subclasses
    missing = {"exposure", "use_temperature", "normalize"} & set(settings) - known
    if missing:
        pytest.skip(f"the lights of this Blender have no {missing.pop()}")
    target = floor()
    add_light(kind, **settings)
    scene.cycles.samples = 256
    report = export(target)
    expected, found = tiles(render_cycles()), tiles(render_mitsuba(report, 256))
    scale = expected.max()
    assert scale > 0.0
    # the level: 1 %, left for the noise of 60 tiles of 16 pixels with 256 samples in both renderers
    assert found.sum() == pytest.approx(expected.sum(), rel=0.01)
    # the shape: 3 % of the brightest tile, each tile has a sixtieth of the samples
    assert np.abs(found - expected).max() <= 0.03 * scale
