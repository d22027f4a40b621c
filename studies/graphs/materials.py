# SPDX-License-Identifier: Apache-2.0
"""Twelve node graphs, each built onto a Principled node; what they leave unlinked is drawn by the study."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Build = Callable[[Any, Any], None]  # node tree, Principled node


def _new(tree: Any, kind: str, **inputs: float | tuple[float, ...]) -> Any:
    node = tree.nodes.new(f"ShaderNode{kind}")
    for name, value in inputs.items():
        node.inputs[name.replace("_", " ")].default_value = value
    return node


def _noise(tree: Any, scale: float) -> Any:
    return _new(tree, "TexNoise", Scale=scale).outputs[0]


def _range(tree: Any, source: Any, low: float, high: float) -> Any:
    node = _new(tree, "MapRange", From_Min=0.3, From_Max=0.7, To_Min=low, To_Max=high)
    tree.links.new(source, node.inputs["Value"])
    return node.outputs[0]


def _bump(tree: Any, source: Any, strength: float, distance: float) -> Any:
    node = _new(tree, "Bump", Strength=strength, Distance=distance)
    tree.links.new(source, node.inputs["Height"])
    return node.outputs["Normal"]


def _ramp(tree: Any, source: Any) -> Any:
    node = _new(tree, "ValToRGB")
    low, high = node.color_ramp.elements
    low.color, low.position, high.color, high.position = (0.8, 0.1, 0.05, 1.0), 0.4, (0.05, 0.2, 0.7, 1.0), 0.6
    tree.links.new(source, node.inputs[0])
    return node.outputs[0]


def ramp(tree: Any, node: Any) -> None:
    """Noise through a Color Ramp."""
    tree.links.new(_ramp(tree, _noise(tree, 4.0)), node.inputs["Base Color"])


def roughness(tree: Any, node: Any) -> None:
    """Noise through Map Range on Roughness."""
    tree.links.new(_range(tree, _noise(tree, 5.0), 0.15, 0.8), node.inputs["Roughness"])


def metallic(tree: Any, node: Any) -> None:
    """Voronoi cells between metal and plastic."""
    source = _new(tree, "TexVoronoi", Scale=4.0).outputs["Distance"]
    tree.links.new(_range(tree, source, 0.0, 1.0), node.inputs["Metallic"])


def low_bump(tree: Any, node: Any) -> None:
    """A bump of strength 0.3."""
    tree.links.new(_bump(tree, _noise(tree, 6.0), 0.3, 0.1), node.inputs["Normal"])


def bump(tree: Any, node: Any) -> None:
    """A bump of strength 1."""
    tree.links.new(_bump(tree, _noise(tree, 6.0), 1.0, 0.1), node.inputs["Normal"])


def coat_bump(tree: Any, node: Any) -> None:
    """A bump on the coat alone."""
    node.inputs["Coat Weight"].default_value = 1.0
    tree.links.new(_bump(tree, _noise(tree, 5.0), 0.6, 0.1), node.inputs["Coat Normal"])


def wave_bump(tree: Any, node: Any) -> None:
    """Waves over object coordinates, as bump and as colour."""
    wave = _new(tree, "TexWave", Scale=2.0, Distortion=2.0)
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], wave.inputs["Vector"])
    tree.links.new(_ramp(tree, wave.outputs["Fac"]), node.inputs["Base Color"])
    tree.links.new(_bump(tree, wave.outputs["Fac"], 0.5, 0.05), node.inputs["Normal"])


def hue(tree: Any, node: Any) -> None:
    """Voronoi colours through Hue/Saturation."""
    source = _new(tree, "TexVoronoi", Scale=5.0).outputs["Color"]
    change = _new(tree, "HueSaturation", Hue=0.4, Saturation=0.8, Value=0.7)
    tree.links.new(source, change.inputs["Color"])
    tree.links.new(change.outputs[0], node.inputs["Base Color"])


def facing(tree: Any, node: Any) -> None:
    """Colours that depend on the view, by Layer Weight."""
    tree.links.new(_ramp(tree, _new(tree, "LayerWeight", Blend=0.5).outputs["Facing"]), node.inputs["Base Color"])


def brushed(tree: Any, node: Any) -> None:
    """An anisotropic metal along a radial tangent."""
    tangent = tree.nodes.new("ShaderNodeTangent")
    tangent.direction_type, tangent.axis = "RADIAL", "X"
    node.inputs["Anisotropic"].default_value = 0.7
    tree.links.new(tangent.outputs[0], node.inputs["Tangent"])


def gradient(tree: Any, node: Any) -> None:
    """Generated coordinates as roughness and coat."""
    split = tree.nodes.new("ShaderNodeSeparateXYZ")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], split.inputs[0])
    tree.links.new(_range(tree, split.outputs["Z"], 0.2, 0.7), node.inputs["Roughness"])
    tree.links.new(split.outputs["X"], node.inputs["Coat Weight"])


def checker(tree: Any, node: Any) -> None:
    """A checker over generated coordinates."""
    cells = _new(tree, "TexChecker", Scale=9.0, Color1=(0.8, 0.7, 0.1, 1.0), Color2=(0.05, 0.05, 0.3, 1.0))
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], cells.inputs["Vector"])
    tree.links.new(cells.outputs["Color"], node.inputs["Base Color"])


def scale(tree: Any, node: Any) -> None:
    """Noise through a Color Ramp, of which the scale is sought."""
    ramp(tree, node)


def mixed(tree: Any, node: Any) -> None:
    """Magic colours with more contrast, mixed with a colour."""
    magic = _new(tree, "TexMagic", Scale=3.0).outputs["Color"]
    contrast, mix = tree.nodes.new("ShaderNodeBrightContrast"), tree.nodes.new("ShaderNodeMix")
    mix.data_type = "RGBA"
    tree.links.new(magic, contrast.inputs[0])
    tree.links.new(contrast.outputs[0], mix.inputs[6])
    tree.links.new(mix.outputs[2], node.inputs["Base Color"])


def picture(tree: Any, node: Any) -> None:
    """A picture of coloured blocks over generated coordinates, as colour and as roughness."""
    import bpy

    blocks = np.random.default_rng(5).uniform(0.1, 0.7, (16, 16, 3)).repeat(4, axis=0).repeat(4, axis=1)
    image = bpy.data.images.new("Blocks", 64, 64, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(np.concatenate([blocks, np.ones((64, 64, 1))], axis=2).astype(np.float32).ravel())
    image.pack()
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.image = image
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], texture.inputs["Vector"])
    for name in ("Base Color", "Roughness"):
        tree.links.new(texture.outputs["Color"], node.inputs[name])


GRAPHS: dict[str, Build] = {
    build.__name__: build
    for build in (
        ramp, roughness, metallic, low_bump, bump, coat_bump, wave_bump, hue, facing, brushed, gradient, checker,
        scale, mixed, picture,
    )
}  # fmt: skip
