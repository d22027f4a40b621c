# SPDX-License-Identifier: GPL-3.0-or-later
"""Sockets of shader nodes as those of a Principled BSDF: their links, and what other nodes say in their own words."""

from __future__ import annotations

from dataclasses import replace

import bpy
import numpy as np
from numpy.typing import NDArray

from ...versions import DIFFUSE, has_diffuse_roughness
from ..findings import Findings, Fix
from ..material_model import Socket
from ..nodes.graph_findings import graph_problem
from ..nodes.leaf_kinds import TOON, sockets_of
from ..nodes.shader_graph import UnsupportedNodeError, plain_value, read_socket
from ..nodes.target_shader import Place

GLOSSY, BELOW = "ShaderNodeBsdfAnisotropic", "ShaderNodeSubsurfaceScattering"
# sockets of nodes that are held, and what is before their names in those of a material's values
HELD = {BELOW: ("Subsurface", ("IOR", "Anisotropy")), TOON: ("Toon", ("Size", "Smooth"))}


def other_sockets(material: str, node: bpy.types.Node, findings: Findings) -> dict[str, Socket]:
    """What a node other than the Principled BSDF says in words of its own: held."""
    if node.bl_idname == DIFFUSE and not has_diffuse_roughness():
        rough = node.inputs["Roughness"]
        if rough.is_linked or plain_value(rough) > 0.0:
            findings.note(f"Material '{material}': Roughness of a Diffuse BSDF is taken for 0 in this Blender.")
        return {"Diffuse Roughness": Socket(0.0, True)}
    if node.bl_idname == GLOSSY:
        return _stretched(material, node, findings)
    held = HELD.get(node.bl_idname)
    if held is not None:
        before, names = held
        own = {name: sockets_of(node)[name] for name in names}
        for name, socket in own.items():
            if socket.enabled and socket.is_linked:
                findings.note(f"Material '{material}': what is linked to {name} of '{node.name}' is left out.")
        return {f"{before} {name}": Socket(plain_value(socket), True) for name, socket in own.items()}
    return conductor_sockets(node)


def _stretched(material: str, node: bpy.types.Node, findings: Findings) -> dict[str, Socket]:
    """Anisotropy and Rotation of a Glossy BSDF; what is linked to them is left out, with a note."""
    anisotropy, rotation = (node.inputs.get(name) for name in ("Anisotropy", "Rotation"))
    if anisotropy is None or rotation is None:
        return {}
    for socket in (anisotropy, rotation):
        if socket.is_linked:
            findings.note(f"Material '{material}': what is linked to {socket.name} of '{node.name}' is left out.")
    if anisotropy.is_linked:
        return {}
    return stretched(float(anisotropy.default_value), float(rotation.default_value))


def stretched(amount: float, rotation: float) -> dict[str, Socket]:
    """Anisotropy and Rotation of a Glossy BSDF as those of a Principled BSDF; nothing of none.

    Cycles divides and multiplies alpha by 1 - a there (a > 0 widens across the tangent), and by sqrt(1 - 0.9 A) here:
    A goes beyond 1, which a Glossy BSDF of the backend takes.
    """
    if amount == 0.0:
        return {}
    wide = (1.0 - (1.0 - min(abs(amount), 0.99)) ** 2) / 0.9
    turn = rotation + (0.25 if amount > 0.0 else 0.0)
    return {"Anisotropic": Socket(wide, True), "Anisotropic Rotation": Socket(turn % 1.0, True)}


def conductor_sockets(node: bpy.types.Node) -> dict[str, Socket]:
    """A Metallic BSDF by index and extinction as colour and edge tint: its reflectance at cos 1 and 1/7.

    Nothing of another node.
    """
    if getattr(node, "fresnel_type", "F82") != "PHYSICAL_CONDUCTOR":
        return {}
    n, k = (np.array(node.inputs[name].default_value, dtype=np.float64)[:3] for name in ("IOR", "Extinction"))
    f0, tint = conductor_colors(n, k)
    return {"Base Color": Socket(f0.tolist(), True), "Specular Tint": Socket(tint.tolist(), True)}


def conductor_colors(n: NDArray[np.float64], k: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Colour and edge tint, in the shape of `n`, of a metal by index and extinction."""
    f0, edge = (_conductor_fresnel(c, n, k) for c in (1.0, 1.0 / 7.0))
    plain = f0 + (1.0 - f0) * (6.0 / 7.0) ** 5
    return f0, np.clip(edge / np.maximum(plain, 1e-6), 0.0, 1.0)


def _conductor_fresnel(c: float, n: NDArray[np.float64], k: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unpolarised reflectance of a conductor of complex index n + i k at a cosine."""
    index = n + 1j * k
    inside = np.sqrt(index**2 - (1.0 - c**2))
    s = np.abs((c - inside) / (c + inside)) ** 2
    p = np.abs((index**2 * c - inside) / (index**2 * c + inside)) ** 2
    return 0.5 * (s + p)


def note_black(material: str, name: str, node: bpy.types.Node, findings: Findings) -> None:
    """Say that a part of a mix, of this name, has no model."""
    findings.note(f"Material '{material}': '{name}' ({node.bl_label}) is held as black.")


def is_uv_tangent(node: bpy.types.Node) -> bool:
    """Whether a node gives the tangent of the object's active UV map."""
    return node.bl_idname == "ShaderNodeTangent" and node.direction_type == "UV_MAP" and not node.uv_map


def read_value(name: str, place: Place, material: str, is_target: bool, findings: Findings) -> Socket:
    """A socket and what is linked to it; what no picture can say Cycles evaluates, of the target, or is named."""
    try:
        read = read_socket(place.socket)
        if is_target:
            refuse_link(name, place, material, findings, is_copied=False)
            if place.socket.is_linked and not read.linked:  # by a link that Cycles leaves out: nothing is written here
                return replace(read, linked=True)
        return read
    except UnsupportedNodeError as problem:
        if is_target:
            refuse_link(name, place, material, findings, is_copied=True)
        else:
            findings.note(
                f"{name} of material '{material}' is linked to {problem}, which cannot be exported; the "
                "socket's own value is used."
            )
        return Socket(plain_value(place.socket), True, by_graph=is_target)


def refuse_link(name: str, place: Place, material: str, findings: Findings, *, is_copied: bool) -> None:
    """An error where Cycles could not evaluate what feeds a socket of the target."""
    problem = graph_problem(place.socket, groups=place.groups, is_copied=is_copied)
    if problem is not None:
        findings.error(
            f"{name} of material '{material}' is linked to {problem}: mend or unlink it.",
            Fix("unlink", name),
        )
