# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba texture `leaf_radiance`: what a surface emits, summed over the leaves of its closure tree.

Choose the variant before importing this. Properties are `color_0`, `strength_0`, `weight_0`, `color_1`, ..., numbers,
colours or textures, and `scale`.
"""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi

PLUGIN_NAME = "leaf_radiance"


class LeafRadiance(mi.Texture):
    """Radiance of the emitting leaves."""

    def __init__(self, props: mi.Properties) -> None:
        mi.Texture.__init__(self, props)
        self.parts: list[tuple[Any, Any, Any]] = []
        while f"color_{len(self.parts)}" in props:
            k = len(self.parts)
            self.parts.append(tuple(_kept(props[f"{name}_{k}"]) for name in ("color", "strength", "weight")))
        self.scale = dr.opaque(mi.Float, float(props.get("scale", 1.0)))

    def eval(self, si: mi.SurfaceInteraction3f, active: Any = True) -> Any:
        """Radiance at a surface point, RGB."""
        value = mi.Color3f(0)
        for color, strength, weight in self.parts:
            value += _at(color, si, active) * _at(strength, si, active) * _at(weight, si, active)
        return dr.maximum(value, 0) * self.scale

    def is_spatially_varying(self) -> bool:
        """False: lights that are take their points from the texture, and this one has none to give."""
        return False

    def to_string(self) -> str:
        """Short description."""
        return f"LeafRadiance[{len(self.parts)} leaves]"


def _kept(value: Any) -> Any:
    if isinstance(value, mi.Texture):
        return value
    colour = mi.Color3f(value)
    dr.make_opaque(colour)
    return colour


def _at(value: Any, si: Any, active: Any) -> Any:
    return mi.Color3f(value.eval(si, active)) if isinstance(value, mi.Texture) else value


def register() -> None:
    """Make `leaf_radiance` known to Mitsuba in the current variant."""
    mi.register_texture(PLUGIN_NAME, LeafRadiance)
