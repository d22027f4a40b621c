# SPDX-License-Identifier: Apache-2.0
"""One material of a `closure_tree`, and its weight. Choose the variant before importing this."""

# pyright: reportArgumentType=false, reportCallIssue=false, reportOperatorIssue=false
# Mitsuba's stubs describe its scalar variant, where a vector is no array of vectors.

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from ..principled.mix_values import Way, amount_of
from .principled_plugin import BlenderPrincipled


@dataclass(frozen=True)
class Leaf:
    """A material and its weight, a number or a texture, times what the `factors` of the tree make of its `ways`.

    Textures of one that `varies` change.
    """

    material: BlenderPrincipled
    weight: Any
    ways: tuple[Way, ...]
    factors: Sequence[Any]
    varies: bool

    def weight_at(self, si: Any, active: Any = True) -> Any:
        """The weight at a surface point."""
        weight = at(self.weight, si, active)
        return weight * amount_of(self.ways, self.factors) if self.ways else weight

    def plain_weight_at(self, si: Any, active: Any = True) -> Any:
        """The same without the factors."""
        return at(self.weight, si, active)

    @property
    def is_free(self) -> bool:
        """Whether something of it may change."""
        return bool(self.ways or self.material.free or self.varies)

    @property
    def glows(self) -> bool:
        """Whether it has light of its own, or may have."""
        return self.material.fixed["emission_strength"] != 0.0 or "emission_strength" in self.material.free

    @property
    def only_glows(self) -> bool:
        """Whether it scatters nothing."""
        return self.material.model.shader == "emission"

    def emitted(self, si: mi.SurfaceInteraction3f, active: Any, *, sampled: bool) -> mi.Color3f:
        """Its part of the surface's own light towards `si.wi`, perhaps to a light sample."""
        return self.weight_at(si, active) * self.material.emitted(si, active, sampled=sampled)


def number_or_texture(value: Any) -> Any:
    """A number that no kernel knows, or a texture."""
    return value if isinstance(value, mi.Texture) else dr.opaque(mi.Float, float(value))


def colour_or_texture(value: Any) -> Any:
    """A colour that no kernel knows, or a texture."""
    if isinstance(value, mi.Texture):
        return value
    colour = mi.Color3f(value)
    dr.make_opaque(colour)
    return colour


def at(value: Any, si: Any, active: Any) -> Any:
    """The number at a surface point."""
    return value.eval_1(si, active) if isinstance(value, mi.Texture) else value
