# SPDX-License-Identifier: Apache-2.0
"""Nodes of lamps for `light_scene.py`, built by a Python with `bpy`: colours, falloffs, IES, gobos, softboxes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

Nodes = Callable[[Any, Any], None]  # of a tree and the Emission in it

# a made-up luminaire: two lobes, narrower across, nothing upwards
_POLAR, _ROUND = np.linspace(0.0, 180.0, 37), np.linspace(0.0, 360.0, 13)


def profile() -> str:
    """An IESNA LM-63 file."""
    polar, turn = np.meshgrid(np.radians(_POLAR), np.radians(_ROUND))
    candela = 800.0 * np.cos(polar).clip(0.0) ** (2.0 + np.cos(2.0 * turn)) + 300.0 * np.exp(
        -(((polar - 0.6) / 0.2) ** 2)
    )
    lines = ["IESNA:LM-63-2002", "[TEST] made up", "TILT=NONE"]
    lines += [f"1 1000 1 {len(_POLAR)} {len(_ROUND)} 1 2 0 0 0", "1 1 100"]
    lines += [" ".join(f"{value:g}" for value in row) for row in (_POLAR, _ROUND, *np.round(candela, 2))]
    return "\n".join(lines) + "\n"


def blackbody(tree: Any, emission: Any) -> None:
    """2700 K, with a Math node for the strength."""
    node = tree.nodes.new("ShaderNodeBlackbody")
    node.inputs[0].default_value = 2700.0
    tree.links.new(node.outputs[0], emission.inputs["Color"])
    sine = tree.nodes.new("ShaderNodeMath")
    sine.operation = "SINE"
    tree.links.new(sine.outputs[0], emission.inputs["Strength"])


def falloff(output: str, smooth: float) -> Nodes:
    """A Light Falloff."""

    def build(tree: Any, emission: Any) -> None:
        node = tree.nodes.new("ShaderNodeLightFalloff")
        node.inputs["Strength"].default_value, node.inputs["Smooth"].default_value = 1.5, smooth
        tree.links.new(node.outputs[output], emission.inputs["Strength"])

    return build


def ray_length(tree: Any, emission: Any) -> None:
    """Nothing beyond two metres and a half."""
    path, less = tree.nodes.new("ShaderNodeLightPath"), tree.nodes.new("ShaderNodeMath")
    less.operation = "LESS_THAN"
    less.inputs[1].default_value = 2.5
    tree.links.new(path.outputs["Ray Length"], less.inputs[0])
    tree.links.new(less.outputs[0], emission.inputs["Strength"])


def ies(tree: Any, emission: Any) -> None:
    """An IES picture, a colour and a smooth falloff."""
    import bpy

    text = bpy.data.texts.new("profile")
    text.write(profile())
    node, fall = tree.nodes.new("ShaderNodeTexIES"), tree.nodes.new("ShaderNodeLightFalloff")
    node.mode, node.ies = "INTERNAL", text
    node.inputs["Strength"].default_value = 0.01
    fall.inputs["Smooth"].default_value = 0.5
    emission.inputs["Color"].default_value = (1.0, 0.7, 0.4, 1.0)
    tree.links.new(node.outputs[0], fall.inputs["Strength"])
    tree.links.new(fall.outputs["Quadratic"], emission.inputs["Strength"])


def gobo(coordinate: str, scale: float = 1.0) -> Nodes:
    """A picture of smooth colours by Normal or UV; a Normal is divided by its depth, as a slide projects."""

    def build(tree: Any, emission: Any) -> None:
        image, texco = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeTexCoord")
        image.image, image.extension = picture(), "EXTEND"
        tree.links.new(image.outputs["Color"], emission.inputs["Color"])
        if coordinate == "UV":
            tree.links.new(texco.outputs["UV"], image.inputs["Vector"])
            return
        parts, divide, mapping = (
            tree.nodes.new(f"ShaderNode{kind}") for kind in ("SeparateXYZ", "VectorMath", "Mapping")
        )
        divide.operation = "DIVIDE"
        tree.links.new(texco.outputs[coordinate], parts.inputs[0])
        tree.links.new(texco.outputs[coordinate], divide.inputs[0])
        tree.links.new(parts.outputs["Z"], divide.inputs[1])
        tree.links.new(divide.outputs[0], mapping.inputs["Vector"])
        mapping.inputs["Location"].default_value = (0.5, 0.5, 0.0)
        mapping.inputs["Scale"].default_value = (scale, scale, scale)
        tree.links.new(mapping.outputs[0], image.inputs["Vector"])

    return build


def blinds(tree: Any, emission: Any) -> None:
    """Stripes of a Wave Texture by the direction of the light."""
    texco, wave = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexWave")
    wave.inputs["Scale"].default_value = 4.0
    tree.links.new(texco.outputs["Normal"], wave.inputs["Vector"])
    tree.links.new(wave.outputs["Color"], emission.inputs["Color"])


def softbox(tree: Any, emission: Any) -> None:
    """Brighter in the middle of the light's area, by a gradient of its UV."""
    texco, mapping, gradient = (tree.nodes.new(f"ShaderNode{k}") for k in ("TexCoord", "Mapping", "TexGradient"))
    gradient.gradient_type = "SPHERICAL"
    mapping.inputs["Location"].default_value = (-1.0, -1.0, 0.0)
    mapping.inputs["Scale"].default_value = (2.0, 2.0, 2.0)
    tree.links.new(texco.outputs["UV"], mapping.inputs["Vector"])
    tree.links.new(mapping.outputs[0], gradient.inputs["Vector"])
    tree.links.new(gradient.outputs["Color"], emission.inputs["Color"])


def by_place(tree: Any, emission: Any) -> None:
    """Checks by the Object coordinates of places on the light."""
    texco, checker = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexChecker")
    checker.inputs["Scale"].default_value = 3.0
    checker.inputs["Color2"].default_value = (0.1, 0.1, 0.3, 1.0)
    tree.links.new(texco.outputs["Object"], checker.inputs["Vector"])
    tree.links.new(checker.outputs["Color"], emission.inputs["Color"])


def falling_checks(tree: Any, emission: Any) -> None:
    """Checks with a smooth falloff."""
    by_place(tree, emission)
    falloff("Quadratic", 1.0)(tree, emission)


def picture() -> Any:
    """A picture of 64 x 64 smooth colours, another one along each of its edges."""
    import bpy

    image = bpy.data.images.new("gobo", 64, 64, float_buffer=True)
    x, y = np.meshgrid(np.linspace(0.0, 1.0, 64), np.linspace(0.0, 1.0, 64))
    waves = [0.5 + 0.5 * np.sin(2.0 * math.pi * (2.0 * x + 0.3)), x * y, 1.0 - 0.8 * y]
    pixels = np.stack([*waves, np.ones_like(x)], axis=-1)
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.pack()
    return image
