# SPDX-License-Identifier: Apache-2.0
"""The series *mixes*: fits of several shaders of a mix at once, and of values inside its nodes, 5 to 10 numbers, from
random starts."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import numpy as np

Build = Callable[[Any], Any]  # a tree to the output socket of its surface

LIMITS = {"Factor": (0.1, 0.9), "Fac": (0.1, 0.9), "Color": (0.05, 0.9), "Base Color": (0.05, 0.9)}
LIMITS |= {"Metallic": (0.0, 1.0), "Roughness": (0.15, 0.8)}


def _shader(kind: str, **values: float) -> Build:
    def build(tree: Any) -> Any:
        node = tree.nodes.new(f"ShaderNode{kind}")
        for name, value in values.items():
            node.inputs[name].default_value = value
        return node.outputs[0]

    return build


def _noise(tree: Any) -> Any:
    node, ramp = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeValToRGB")
    low, high = ramp.color_ramp.elements
    low.position, high.position = 0.45, 0.55
    tree.links.new(node.outputs[0], ramp.inputs[0])
    return ramp.outputs[0]


def _colored(shader: Build, *kinds: str) -> Build:
    """A shader whose colour nodes give, the one into the other, the first a texture."""

    def build(tree: Any) -> Any:
        output, last = shader(tree), None
        for kind in kinds:
            node = tree.nodes.new(f"ShaderNode{kind}")
            if last is not None:
                tree.links.new(last, next(s for s in node.inputs if s.name in ("Fac", "Factor", "Color") and s.enabled))
            last = next(socket for socket in node.outputs if socket.name in ("Color", "Fac", "Factor"))
        tree.links.new(last, next(s for s in output.node.inputs if s.type == "RGBA"))
        return output

    return build


def _fresnel(tree: Any) -> Any:
    return tree.nodes.new("ShaderNodeFresnel").outputs[0]


def _mix(factor: Build | None, first: Build, second: Build) -> Build:
    def build(tree: Any) -> Any:
        node = tree.nodes.new("ShaderNodeMixShader")
        for number, side in ((0, factor), (1, first), (2, second)):
            if side is not None:
                tree.links.new(side(tree), node.inputs[number])
        return node.outputs[0]

    return build


_DIFFUSE, _GLOSSY = _shader("BsdfDiffuse"), _shader("BsdfAnisotropic")
_PLASTIC, _METAL = _shader("BsdfPrincipled"), _shader("BsdfPrincipled", Metallic=1.0)
_SHEEN, _WAX = _shader("BsdfSheen"), _shader("SubsurfaceScattering", Scale=0.5)

# what is fitted of each mix; values that are not are the same in truth and start
MIXES: dict[str, tuple[Build, tuple[str, ...]]] = {
    "two colours": (
        _mix(None, _DIFFUSE, _GLOSSY), ("Diffuse BSDF/Color", "Glossy BSDF/Color", "Glossy BSDF/Roughness"),
    ),
    "factor": (_mix(None, _DIFFUSE, _GLOSSY), ("Mix Shader/Factor", "Diffuse BSDF/Color", "Glossy BSDF/Roughness")),
    "two by a mask": (
        _mix(_noise, _PLASTIC, _METAL),
        ("Principled BSDF/Base Color", "Principled BSDF/Roughness", "Principled BSDF.001/Base Color",
         "Principled BSDF.001/Roughness"),
    ),
    "fresnel": (
        _mix(_fresnel, _DIFFUSE, _GLOSSY), ("Diffuse BSDF/Color", "Glossy BSDF/Color", "Glossy BSDF/Roughness"),
    ),
    "coated": (
        _mix(None, _PLASTIC, _GLOSSY),
        ("Mix Shader/Factor", "Principled BSDF/Base Color", "Principled BSDF/Roughness", "Glossy BSDF/Roughness"),
    ),
    "three": (
        _mix(_noise, _DIFFUSE, _mix(None, _GLOSSY, _SHEEN)),
        ("Mix Shader.001/Factor", "Diffuse BSDF/Color", "Glossy BSDF/Roughness", "Sheen BSDF/Color"),
    ),
    "worn": (
        _mix(_noise, _colored(_PLASTIC, "TexVoronoi", "ValToRGB"), _METAL),
        ("Color Ramp/Stop 0", "Color Ramp.001/Stop 0", "Color Ramp.001/Stop 1", "Principled BSDF/Roughness",
         "Principled BSDF.001/Roughness"),
    ),
    "waxed": (
        _mix(None, _WAX, _GLOSSY), ("Mix Shader/Factor", "Subsurface Scattering/Color", "Glossy BSDF/Roughness"),
    ),
    "veined": (
        _mix(_noise, _PLASTIC, _WAX),
        ("Principled BSDF/Base Color", "Principled BSDF/Roughness", "Subsurface Scattering/Color"),
    ),
    "faded": (
        _mix(None, _colored(_DIFFUSE, "TexMagic", "HueSaturation"), _colored(_GLOSSY, "TexNoise", "ValToRGB")),
        ("Mix Shader/Factor", "Hue Saturation Value/Saturation", "Hue Saturation Value/Value", "Color Ramp/Stop 0",
         "Glossy BSDF/Roughness"),
    ),
}  # fmt: skip


def put_mix(name: str, target: Any) -> None:
    """Give the target's material the shaders of a mix."""
    tree = target.active_material.node_tree
    output = tree.get_output_node("CYCLES")
    tree.nodes.remove(output.inputs["Surface"].links[0].from_node)
    tree.links.new(MIXES[name][0](tree), output.inputs["Surface"])


class DrawnMix:
    """The values that are fitted of a mix, drawn at random and put where they are."""

    def __init__(self, name: str, target: Any) -> None:
        from blender_addon.export.nodes.target_shader import target_shader
        from blender_addon.graph_values.mix_values import inside_values
        from blender_addon.graph_values.table import GraphValue

        self._tree, self.names = target.active_material.node_tree, MIXES[name][1]
        shader = target_shader(target.active_material)
        assert shader is not None
        inside = [value for value in inside_values(shader) if isinstance(value, GraphValue)]
        self._inside = {value.name: value for value in inside if value.name in self.names}

    def draw(self, seed: random.Random, *, near: dict[str, Any] | None = None) -> dict[str, Any]:
        """Values by name, evenly from their ranges."""
        return {name: self._one(name, seed) for name in self.names}

    def put(self, values: dict[str, Any]) -> None:
        """Set them."""
        from blender_addon.graph_values.place import write

        for name, value in values.items():
            if name in self._inside:
                write(self._tree, self._inside[name].place, value)
            else:
                self._socket(name).default_value = (*value, 1.0) if isinstance(value, tuple) else value

    def errors(self, truth: dict[str, Any]) -> dict[str, float]:
        """The largest difference of each value's numbers from the truth."""
        from blender_addon.graph_values.place import read

        def at(name: str) -> Any:
            inside = self._inside.get(name)
            return self._socket(name).default_value if inside is None else read(self._tree, inside.place)

        here = {name: np.ravel(at(name))[: np.size(value)] for name, value in truth.items()}
        return {name: float(np.abs(here[name] - np.ravel(value)).max()) for name, value in truth.items()}

    def share(self, name: str, deviation: float, truth: Any) -> float:
        """A standard deviation of a value in the unit of its `errors`."""
        return deviation

    def _one(self, name: str, seed: random.Random) -> Any:
        inside = self._inside.get(name)
        low, high = LIMITS[name.rpartition("/")[2]] if inside is None else (inside.range.lower, inside.range.upper)
        is_color = "Color" in name.rpartition("/")[2] if inside is None else inside.place.size == 3
        return tuple(seed.uniform(low, high) for _ in range(3)) if is_color else seed.uniform(low, high)

    def _socket(self, name: str) -> Any:
        node, _, value = name.rpartition("/")
        return self._tree.nodes[node].inputs[value]
