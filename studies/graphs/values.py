# SPDX-License-Identifier: Apache-2.0
"""The series *values*: fits of values inside the nodes, 4 to 9 numbers, from random starts."""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from typing import Any

import numpy as np

# what is fitted of each graph, names inside the nodes and sockets of the shader; a colour is three numbers
FITTED: dict[str, tuple[str, ...]] = {
    "ramp": ("Color Ramp/Stop 0", "Color Ramp/Stop 1", "Color Ramp/Position 0", "Color Ramp/Position 1", "Roughness"),
    "roughness": ("Map Range/To Min", "Map Range/To Max", "Base Color", "Metallic"),
    "metallic": ("Map Range/To Min", "Map Range/To Max", "Base Color", "Roughness"),
    "bump": ("Bump/Strength", "Base Color", "Roughness"),
    "coat_bump": ("Bump/Strength", "Base Color", "Roughness"),
    "wave_bump": ("Color Ramp/Stop 0", "Color Ramp/Stop 1", "Bump/Strength", "Roughness"),
    "hue": (
        *("Hue Saturation Value/Hue", "Hue Saturation Value/Saturation", "Hue Saturation Value/Value"),
        "Roughness",
    ),
    "facing": ("Color Ramp/Stop 0", "Color Ramp/Stop 1", "Layer Weight/Blend", "Roughness"),
    "gradient": ("Map Range/To Min", "Map Range/To Max", "Base Color"),
    "checker": ("Checker Texture/Color1", "Checker Texture/Color2", "Roughness"),
    "scale": ("Noise Texture/Scale", "Color Ramp/Stop 0", "Color Ramp/Stop 1"),
    "picture": ("Base Color/Gain", "Base Color/Offset", "Roughness/Gain", "Roughness/Offset"),
    "mixed": ("Mix/Factor", "Mix/B", "Brightness Contrast/Contrast", "Roughness"),
}
SOCKETS = {"Base Color": (0.05, 0.9), "Metallic": (0.0, 1.0), "Roughness": (0.15, 0.8)}
TINTS = {"Gain": (0.5, 1.5), "Offset": (-0.05, 0.1)}  # of pictures; their own ranges are far wider
WITHIN = (0.1, 0.9)  # of a value's range, the truth and the start are drawn from


class Drawn:
    """The values that are fitted of a target, drawn at random and put where they are."""

    def __init__(self, target: Any, node: Any, names: Sequence[str]) -> None:
        from blender_addon.export.nodes.target_shader import target_shader
        from blender_addon.graph_values.table import graph_values

        shader = target_shader(target.active_material)
        assert shader is not None
        self.names = tuple(names)
        self._tree, self._node = target.active_material.node_tree, node
        self._inside = {value.name: value for value in graph_values(shader) if value.name in self.names}

    def draw(self, seed: random.Random, *, near: dict[str, Any] | None = None) -> dict[str, Any]:
        """Values by name, evenly from most of their ranges.

        As a start, of a truth that is `near`, scales are at most three times off, and stops of ramps where they are in
        a new ramp with four equal parts: the fit's own ranges hang on those.
        """
        return {name: self._one(name, seed, None if near is None else near[name]) for name in self.names}

    def put(self, values: dict[str, Any]) -> None:
        """Set them."""
        from blender_addon.graph_values.place import write

        for name, value in values.items():
            if name in self._inside:
                write(self._tree, self._inside[name].place, value)
            else:
                self._node.inputs[name].default_value = (*value, 1.0) if isinstance(value, tuple) else value

    def errors(self, truth: dict[str, Any]) -> dict[str, float]:
        """The largest difference of each value's numbers from the truth as a share of its range, or of a factor of 4
        where it counts by factors."""
        from blender_addon.graph_values.place import read

        found = {}
        for name, value in truth.items():
            inside = self._inside.get(name)
            held = self._node.inputs[name].default_value if inside is None else read(self._tree, inside.place)
            here, there = np.ravel(held)[: np.size(value)], np.ravel(value)
            low, high = self._limits(name)
            apart = np.log(here / there) / np.log(4.0) if self._by_factors(name) else (here - there) / (high - low)
            found[name] = float(np.abs(apart).max())
        return found

    def share(self, name: str, deviation: float, truth: Any) -> float:
        """A standard deviation of a value in the unit of its `errors`."""
        if self._by_factors(name):
            return deviation / (float(np.min(truth)) * math.log(4.0))
        low, high = self._limits(name)
        return deviation / (high - low)

    def _by_factors(self, name: str) -> bool:
        return name in self._inside and self._inside[name].range.logarithmic

    def _limits(self, name: str) -> tuple[float, float]:
        if name not in self._inside:
            return SOCKETS[name]
        if name.rpartition("/")[2] in TINTS:
            return TINTS[name.rpartition("/")[2]]
        return self._inside[name].range.lower, self._inside[name].range.upper

    def _one(self, name: str, seed: random.Random, near: Any) -> Any:
        low, high = self._limits(name)
        is_color = self._inside[name].place.size == 3 if name in self._inside else name == "Base Color"
        if near is not None and self._by_factors(name):
            return near * 3.0 ** seed.uniform(-1.0, 1.0)
        if near is not None and "/Position" in name:
            return 0.25 if name.endswith("0") else 0.75

        def number() -> float:
            share = seed.uniform(*WITHIN)
            return low * (high / low) ** share if self._by_factors(name) else low + (high - low) * share

        return tuple(number() for _ in range(3)) if is_color else number()
