# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether light goes through an object, by a look at the nodes of its materials: not how much of it."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

BENDING = ("ShaderNodeBsdfGlass", "ShaderNodeBsdfRefraction")


def bends_light(item: bpy.types.Object) -> bool:
    """Whether some of it goes on by a bend: glass, refraction, transmission."""
    return any(map(is_bending, nodes_of(item)))


def passes_light(item: bpy.types.Object) -> bool:
    """Whether some of it goes straight on: transparency, alpha."""
    return any(map(is_clear, nodes_of(item)))


def is_bending(node: bpy.types.Node) -> bool:
    """Whether light goes on by a bend through a shader, or a part of it."""
    return node.bl_idname in BENDING or _differs(node, "Transmission Weight", 0.0)


def is_clear(node: bpy.types.Node) -> bool:
    """Whether light goes straight on through a shader, or a part of it."""
    return node.bl_idname == "ShaderNodeBsdfTransparent" or _differs(node, "Alpha", 1.0)


def nodes_of(item: bpy.types.Object) -> Iterator[bpy.types.Node]:
    """The nodes of all materials of an object, those inside of groups left out."""
    for slot in item.material_slots:
        if slot.material and slot.material.node_tree:
            yield from slot.material.node_tree.nodes


def _differs(node: bpy.types.Node, name: str, opaque: float) -> bool:
    socket = node.inputs.get(name)
    return socket is not None and (socket.is_linked or socket.default_value != opaque)
