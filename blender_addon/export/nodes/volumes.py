# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes inside of surfaces that absorb light and scatter none: coloured glass, drinks.

Cycles takes exp(-sigma d) of light on its way d, in scene units (kernel/svm/closure.h): sigma is density (1 - colour)
of a Volume Absorption, density (1 - sqrt(absorption colour)) of a Principled Volume without scattering, and the
absorption itself of Volume Coefficients.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np

from ...versions import PRINCIPLED, active_output, node_tree_of
from .closure_leaves import ClosureError, ClosureLeaf, closure_leaves
from .leaf_kinds import OPAQUE, TRANSPARENT, sockets_of
from .shader_graph import plain_value, source_of

DENSITY, COLOR = "Absorption Density", "Absorption Color"  # what a material's values are called
ABSORPTION, PRINCIPLED_VOLUME = "ShaderNodeVolumeAbsorption", "ShaderNodeVolumePrincipled"
COEFFICIENTS = "ShaderNodeVolumeCoefficients"  # of Blenders newer than 4.3
_CLEAR = (TRANSPARENT, "ShaderNodeBsdfGlass", "ShaderNodeBsdfRefraction", "ShaderNodeBsdfTranslucent")
_Values = dict[str, Any]


@dataclass(frozen=True)
class AbsorbingVolume:
    """The one node of a volume that absorbs alike everywhere, with `density` and `color` (linear Rec.709)."""

    leaf: ClosureLeaf
    density: float
    color: list[float]

    @property
    def own_sockets(self) -> dict[str, bpy.types.NodeSocket]:
        """The sockets that hold these two as they are; none of a node that says them otherwise."""
        node = self.leaf.node
        own = node.bl_idname == ABSORPTION
        return {DENSITY: node.inputs["Density"], COLOR: node.inputs["Color"]} if own else {}


def has_volume(material: bpy.types.Material | None) -> bool:
    """Whether something is linked to Volume of the output."""
    output = active_output(node_tree_of(material)) if material is not None else None
    return output is not None and source_of(output.inputs["Volume"]) is not None


def lets_light_in(leaf: ClosureLeaf) -> bool:
    """Whether light gets through a surface shader to what is inside."""
    own = sockets_of(leaf.node)
    if leaf.node.bl_idname != PRINCIPLED:
        return leaf.node.bl_idname in _CLEAR
    return any(source_of(own[name]) is not None or plain_value(own[name]) != opaque for name, opaque in OPAQUE.items())


def absorbing_volume(material: bpy.types.Material | None) -> AbsorbingVolume | None:
    """The volume of a material; None where there is none, or one that is mixed, linked, shines or scatters."""
    if not has_volume(material):
        return None
    try:
        leaves = closure_leaves(material, "Volume")
    except ClosureError:
        return None
    if len(leaves) != 1 or leaves[0].is_linked or leaves[0].share != 1.0:
        return None
    node = leaves[0].node
    read = _READ.get(node.bl_idname)
    own = sockets_of(node)
    if read is None or any(source_of(socket) is not None for socket in own.values()):
        return None
    values = {n: plain_value(s) for n, s in own.items() if s.type in ("RGBA", "VALUE", "VECTOR")}
    found = read(values)
    return None if found is None else AbsorbingVolume(leaves[0], *found)


def _absorption(values: _Values) -> tuple[float, list[float]]:
    return max(values["Density"], 0.0), values["Color"]


def _principled(values: _Values) -> tuple[float, list[float]] | None:
    """One whose Color is black and that does not shine."""
    shines = values["Emission Strength"] > 0.0 and any(values["Emission Color"])
    if values["Density"] <= 0.0:
        return 0.0, [1.0, 1.0, 1.0]
    if any(value > 0.0 for value in values["Color"]) or shines or values["Blackbody Intensity"] > 0.0:
        return None
    return values["Density"], [float(c) for c in np.sqrt(np.maximum(values["Absorption Color"], 0.0))]


def _coefficients(values: _Values) -> tuple[float, list[float]] | None:
    """One without scattering and emission; the density is that of the channel that loses most."""
    if any(values["Scatter Coefficients"]) or any(values["Emission Coefficients"]):
        return None
    sigma = np.maximum(values["Absorption Coefficients"], 0.0)
    most = float(sigma.max())
    return most, [float(c) for c in (1.0 - sigma / most if most > 0.0 else np.ones(3))]


_READ: dict[str, Callable[[_Values], tuple[float, list[float]] | None]] = {
    ABSORPTION: _absorption,
    PRINCIPLED_VOLUME: _principled,
    COEFFICIENTS: _coefficients,
}
