# SPDX-License-Identifier: GPL-3.0-or-later
"""What shader nodes other than the Principled BSDF say in words of their own, as sockets of a Principled BSDF."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ..findings import Findings
from ..material_model import Socket
from ..nodes.leaf_kinds import is_shader, sockets_of
from ..nodes.shader_graph import plain_value

GLOSSY, BELOW = "ShaderNodeBsdfAnisotropic", "ShaderNodeSubsurfaceScattering"


def other_sockets(material: str, node: bpy.types.Node, findings: Findings) -> dict[str, Socket]:
    """What a node other than the Principled BSDF says in words of its own: held."""
    if node.bl_idname == GLOSSY:
        return _stretched(material, node, findings)
    if node.bl_idname == BELOW:
        own = {name: sockets_of(node)[name] for name in ("IOR", "Anisotropy")}
        for name, socket in own.items():
            if socket.enabled and socket.is_linked:
                findings.note(f"Material '{material}': what is linked to {name} of '{node.name}' is left out.")
        return {f"Subsurface {name}": Socket(plain_value(socket), True) for name, socket in own.items()}
    return conductor_sockets(node)


def _stretched(material: str, node: bpy.types.Node, findings: Findings) -> dict[str, Socket]:
    """Anisotropy of a Glossy BSDF as that of a Principled BSDF.

    Cycles divides and multiplies alpha by 1 - a there (a > 0 widens across the tangent), and by sqrt(1 - 0.9 A) here:
    A goes beyond 1, which a Glossy BSDF of the backend takes.
    """
    anisotropy, rotation = (node.inputs.get(name) for name in ("Anisotropy", "Rotation"))
    if anisotropy is None or rotation is None:
        return {}
    if anisotropy.is_linked or rotation.is_linked:
        findings.note(f"Material '{material}': what is linked to Anisotropy of '{node.name}' is left out.")
    amount = float(anisotropy.default_value)
    if anisotropy.is_linked or amount == 0.0:
        return {}
    wide = (1.0 - (1.0 - min(abs(amount), 0.99)) ** 2) / 0.9
    turn = float(rotation.default_value) + (0.25 if amount > 0.0 else 0.0)
    return {"Anisotropic": Socket(wide, True), "Anisotropic Rotation": Socket(turn % 1.0, True)}


def conductor_sockets(node: bpy.types.Node) -> dict[str, Socket]:
    """A Metallic BSDF by index and extinction as colour and edge tint: its reflectance at cos 1 and 1/7.

    Nothing of another node.
    """
    if getattr(node, "fresnel_type", "F82") != "PHYSICAL_CONDUCTOR":
        return {}
    n, k = (np.array(node.inputs[name].default_value, dtype=np.float64)[:3] for name in ("IOR", "Extinction"))
    f0, edge = (_conductor_fresnel(c, n, k) for c in (1.0, 1.0 / 7.0))
    plain = f0 + (1.0 - f0) * (6.0 / 7.0) ** 5
    tint = np.clip(edge / np.maximum(plain, 1e-6), 0.0, 1.0)
    return {"Base Color": Socket(f0.tolist(), True), "Specular Tint": Socket(tint.tolist(), True)}


def _conductor_fresnel(c: float, n: NDArray[np.float64], k: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unpolarised reflectance of a conductor of complex index n + i k at a cosine."""
    index = n + 1j * k
    inside = np.sqrt(index**2 - (1.0 - c**2))
    s = np.abs((c - inside) / (c + inside)) ** 2
    p = np.abs((index**2 * c - inside) / (index**2 * c + inside)) ** 2
    return 0.5 * (s + p)


def distribution_of(node: bpy.types.Node) -> str:
    """The microfacet distribution of a node, or the one that stands in for it."""
    found = getattr(node, "distribution", "")
    return found if found in ("GGX", "MULTI_GGX") else "GGX"


def note_black(material: str, name: str, node: bpy.types.Node, findings: Findings) -> None:
    """Say that a part of a mix, of this name, has no model."""
    if is_shader(node):
        findings.note(f"Material '{material}': '{name}' ({node.bl_label}) is held as black.")
        return
    findings.note(
        f"Material '{material}': '{name}' ({node.bl_label}) is a colour in the place of a shader, which shines in "
        "Cycles and is held as black: link an Emission between them."
    )
