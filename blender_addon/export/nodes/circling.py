# SPDX-License-Identifier: GPL-3.0-or-later
"""Tangents that circle an axis of the object, as Cycles' own do: a mesh can hold them, so that nothing is evaluated."""

from __future__ import annotations

import bpy

from .closure_leaves import ClosureError, closure_leaves
from .dependence import deforming
from .shader_graph import source_of

TURNED = ("Anisotropic", "Anisotropy")  # sockets that turn highlights along a tangent
OWN_AXIS = "Z"  # where nothing is linked to Tangent


def circled_axis(material: bpy.types.Material | None) -> str:
    """The axis, X, Y or Z, that the tangents of all shaders of a material circle; empty where there is no such one."""
    axes = {_axis(node.inputs["Tangent"]) for node in _shaders(material) if "Tangent" in node.inputs}
    return axes.pop() if len(axes) == 1 else ""


def turned_axis(material: bpy.types.Material | None) -> str:
    """The same where a shader of the material turns its highlights along the tangent, else empty."""
    return circled_axis(material) if any(map(turns_highlights, _shaders(material))) else ""


def turns_highlights(shader: bpy.types.Node) -> bool:
    """Whether the tangent of a shader counts."""
    sockets = [shader.inputs[name] for name in TURNED if name in shader.inputs]
    return any(socket.is_linked or socket.default_value != 0.0 for socket in sockets)


def keeps_place(item: bpy.types.Object) -> bool:
    """Whether the vertices of an object are where Cycles takes its Generated coordinates from."""
    return item.type == "MESH" and not deforming(item)


def _shaders(material: bpy.types.Material | None) -> list[bpy.types.Node]:
    try:
        return [leaf.node for leaf in closure_leaves(material)]
    except ClosureError:
        return []


def _axis(socket: bpy.types.NodeSocket) -> str:
    source = source_of(socket)
    if source is None:
        return OWN_AXIS
    node = source.node
    return node.axis if node.bl_idname == "ShaderNodeTangent" and node.direction_type == "RADIAL" else ""
