# SPDX-License-Identifier: Apache-2.0
"""A leaf with the sun behind it, and what glows: a sign, lava, a lit decal. What is found is in their .blend files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from .conftest import run_bpy, run_mfo

SCENE = """
import math
import numpy as np
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine, scene.cycles.use_denoising = "CYCLES", False
scene.render.resolution_x = scene.render.resolution_y = 64
scene.world = bpy.data.worlds.new("World")
bpy.ops.mesh.primitive_grid_add(x_subdivisions=2, y_subdivisions=2, size=2.0, rotation=(1.3, 0.0, 0.3))
sheet = bpy.context.object
sheet.name = "Sheet"
material = bpy.data.materials.new("Sheet")
if material.node_tree is None:
    material.use_nodes = True
sheet.data.materials.append(material)
nodes, links = material.node_tree.nodes, material.node_tree.links
plastic, out = nodes["Principled BSDF"], nodes["Material Output"]
bpy.ops.object.light_add(type="SUN", rotation=(-1.2, 0.4, 0.0))
bpy.context.object.data.energy = 3.0
bpy.ops.object.light_add(type="AREA", location=(1.5, -2.5, 2.0), rotation=(0.9, 0.0, 0.5))
bpy.context.object.data.energy = 40.0
bpy.ops.object.camera_add(location=(0.0, -5.0, 0.3), rotation=(math.radians(87), 0.0, 0.0))
scene.camera = bpy.context.object

def done(values, start):
    render(argv[1], 128)
    for (place, name), value in zip(values, start):
        setattr(place, name, value)
    bpy.ops.wm.save_as_mainfile(filepath=argv[0])
"""
LEAF = f"""{SCENE}
through, mix, noise, ramp = (
    nodes.new(f"ShaderNode{{kind}}") for kind in ("BsdfTranslucent", "MixShader", "TexNoise", "ValToRGB")
)
noise.inputs["Scale"].default_value = 3.0
low, high = ramp.color_ramp.elements
low.position, high.position, low.color, high.color = 0.4, 0.6, (0.05, 0.3, 0.04, 1.0), (0.5, 0.45, 0.1, 1.0)
mix.inputs[0].default_value = 0.6
for first, second in (
    (noise.outputs[0], ramp.inputs[0]), (ramp.outputs[0], plastic.inputs["Base Color"]),
    (ramp.outputs[0], through.inputs["Color"]), (plastic.outputs[0], mix.inputs[1]),
    (through.outputs[0], mix.inputs[2]), (mix.outputs[0], out.inputs["Surface"]),
):
    links.new(first, second)
grey = (0.3, 0.3, 0.3, 1.0)
done([(low, "color"), (high, "color"), (mix.inputs[0], "default_value")], [grey, grey, 0.4])
"""
SIGN = f"""{SCENE}
picture = bpy.data.images.new("Sign", 8, 8)
pixels = np.ones((8, 8, 4), np.float32)
pixels[..., :3] = np.random.default_rng(3).random((8, 8, 3)) ** 3
picture.pixels = pixels.ravel()
picture.pack()
image = nodes.new("ShaderNodeTexImage")
image.image = picture
links.new(image.outputs[0], plastic.inputs["Emission Color"])
plastic.inputs["Base Color"].default_value = (0.1, 0.2, 0.4, 1.0)
plastic.inputs["Emission Strength"].default_value = 2.5
done(
    [(plastic.inputs["Base Color"], "default_value"), (plastic.inputs["Emission Strength"], "default_value")],
    [(0.5, 0.5, 0.5, 1.0), float(argv[2])],
)
"""
LAVA = f"""{SCENE}
noise, ramp = (nodes.new(f"ShaderNode{{kind}}") for kind in ("TexNoise", "ValToRGB"))
noise.inputs["Scale"].default_value = 3.0
low, high = ramp.color_ramp.elements
low.position, high.position, low.color, high.color = 0.4, 0.6, (0.02, 0.02, 0.02, 1.0), (0.9, 0.35, 0.05, 1.0)
links.new(noise.outputs[0], ramp.inputs[0])
links.new(ramp.outputs[0], plastic.inputs["Emission Color"])
plastic.inputs["Emission Strength"].default_value = 2.0
grey = (0.4, 0.4, 0.4, 1.0)
done(
    [(low, "color"), (high, "color"), (plastic.inputs["Base Color"], "default_value")], [grey, grey, grey]
)
"""
DECAL = f"""{SCENE}
glow, mix, noise, ramp = (
    nodes.new(f"ShaderNode{{kind}}") for kind in ("Emission", "MixShader", "TexNoise", "ValToRGB")
)
noise.inputs["Scale"].default_value = 3.0
low, high = ramp.color_ramp.elements
low.position, high.position = 0.45, 0.55
glow.inputs["Strength"].default_value, glow.inputs["Color"].default_value = 2.0, (0.9, 0.3, 0.1, 1.0)
plastic.inputs["Base Color"].default_value = (0.1, 0.2, 0.4, 1.0)
for first, second in (
    (noise.outputs[0], ramp.inputs[0]), (ramp.outputs[0], mix.inputs[0]), (plastic.outputs[0], mix.inputs[1]),
    (glow.outputs[0], mix.inputs[2]), (mix.outputs[0], out.inputs["Surface"]),
):
    links.new(first, second)
done(
    [(glow.inputs["Color"], "default_value"), (plastic.inputs["Base Color"], "default_value")],
    [(0.5, 0.5, 0.5, 1.0), (0.5, 0.5, 0.5, 1.0)],
)
"""
SHOW_GLOW = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
nodes = bpy.data.objects["Sheet"].active_material.node_tree.nodes
if "Emission" in nodes:
    colors, strength = [nodes["Emission"].inputs["Color"].default_value], nodes["Emission"].inputs["Strength"]
else:
    colors = [element.color for element in nodes["Color Ramp"].color_ramp.elements]
    strength = nodes["Principled BSDF"].inputs["Emission Strength"]
found = [[strength.default_value * number for number in list(color)[:3]] for color in colors]
"""
SHOW = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
nodes = bpy.data.objects["Sheet"].active_material.node_tree.nodes
found = [list(element.color)[:3] for element in nodes["Color Ramp"].color_ramp.elements] + [
    nodes["Mix Shader"].inputs[0].default_value
] if "Color Ramp" in nodes else nodes["Principled BSDF"].inputs["Emission Strength"].default_value
"""


def saved_same(folder: Path, scene: Sequence[Any], *options: str) -> Path:
    """The file that a fit of a scene's script, with what follows it, has saved, and that is the same."""
    build, *more = scene
    start, picture, saved = folder / "start.blend", folder / "reference.exr", folder / "saved.blend"
    run_bpy(build, start, picture, *more)
    done = run_mfo(
        "blend", start, "--object", "Sheet", "--reference", picture, *options,
        "--out", folder / "job", "--apply", "--save-as", saved, "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    assert done.answer["verdict"] == "same"
    return saved


def test_what_a_ramp_gives_both_shaders_of_a_leaf_is_found(tmp_path: Path) -> None:
    names = "Roughness, Color Ramp/Stop 0, Color Ramp/Stop 1, Mix Shader/Factor"
    low, high, factor = run_bpy(SHOW, saved_same(tmp_path, [LEAF], "--parameters", names))
    assert low == pytest.approx([0.05, 0.3, 0.04], abs=0.03)
    assert high == pytest.approx([0.5, 0.45, 0.1], abs=0.05)
    assert factor == pytest.approx(0.6, abs=0.05)


@pytest.mark.parametrize("strength", [1.0, 0.0])
def test_the_strength_of_a_glow_by_a_picture_is_found(tmp_path: Path, strength: float) -> None:
    """From none by the class of materials that glow."""
    assert run_bpy(SHOW, saved_same(tmp_path, [SIGN, strength])) == pytest.approx(2.5, rel=0.02)


@pytest.mark.parametrize(
    ("build", "radiances"),
    [(LAVA, [(0.04, 0.04, 0.04), (1.8, 0.7, 0.1)]), (DECAL, [(1.8, 0.6, 0.2)])],
    ids=["a ramp", "a shader of a mix"],
)
def test_the_light_that_nodes_give_is_found(
    tmp_path: Path, build: str, radiances: list[tuple[float, float, float]]
) -> None:
    """Colour and strength are a product."""
    saved = saved_same(tmp_path, [build])
    for found, radiance in zip(run_bpy(SHOW_GLOW, saved), radiances, strict=True):
        assert found == pytest.approx(radiance, abs=0.03)
