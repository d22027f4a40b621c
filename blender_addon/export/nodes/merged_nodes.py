# SPDX-License-Identifier: GPL-3.0-or-later
"""Nodes of one tree that Cycles takes for one, since they are alike (`ShaderGraph::deduplicate_nodes`).

What is linked to an output of one is linked to that of all: a picture's colours are divided by alpha where Alpha of
another node that shows it in the same way is read.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import bpy

Source = Callable[[bpy.types.NodeSocket], bpy.types.NodeSocket | None]  # what feeds a socket: `shader_graph.source_of`

IMAGE = "ShaderNodeTexImage"
_OF_ALL = frozenset(each.identifier for each in bpy.types.ShaderNode.bl_rna.properties)
_DEPTH = 32  # nodes one after another that are looked at


def is_alpha_read(node: bpy.types.Node, source_of: Source) -> bool:
    """Whether Cycles reads Alpha of an Image Texture: a link to it, or to that of a like one, that is not muted."""
    if _is_read(node.outputs["Alpha"]):
        return True
    return any(
        _is_read(other.outputs["Alpha"]) and are_alike(node, other, source_of)
        for other in node.id_data.nodes
        if other.bl_idname == IMAGE and other != node and not other.mute
    )


def are_alike(first: bpy.types.Node, second: bpy.types.Node, source_of: Source, depth: int = _DEPTH) -> bool:
    """Whether two nodes are of one kind, with the same settings, and their inputs have the same values or links."""
    if first == second:
        return True
    if depth == 0 or first.bl_idname != second.bl_idname or first.mute or second.mute:
        return False
    own = [name for name in _names(first) if name not in _OF_ALL]
    if any(_value(getattr(first, name)) != _value(getattr(second, name)) for name in own):
        return False
    return all(_feed_alike(a, b, source_of, depth - 1) for a, b in zip(first.inputs, second.inputs, strict=True))


def _feed_alike(first: bpy.types.NodeSocket, second: bpy.types.NodeSocket, source_of: Source, depth: int) -> bool:
    before, other = source_of(first), source_of(second)
    if before is None or other is None:
        own = (_value(getattr(socket, "default_value", None)) for socket in (first, second))
        return before == other and next(own) == next(own)
    return before.identifier == other.identifier and are_alike(before.node, other.node, source_of, depth)


def _value(value: Any) -> Any:
    """What of a setting can be compared: of an image its file and how it is read, of a group of settings those."""
    if isinstance(value, bpy.types.Image):
        if value.packed_file is None and value.source == "FILE" and not value.is_dirty:
            place = bpy.path.abspath(value.filepath, library=value.library)
            return place, value.colorspace_settings.name, value.alpha_mode
        return value.as_pointer()
    if isinstance(value, bpy.types.ID):
        return value.as_pointer()
    if isinstance(value, bpy.types.bpy_struct):
        return [_value(getattr(value, name)) for name in _names(value) if name != "rna_type"]
    return [_value(each) for each in value] if hasattr(value, "__len__") and not isinstance(value, str) else value


def _names(owner: Any) -> list[str]:
    return [each.identifier for each in owner.bl_rna.properties]


def _is_read(output: bpy.types.NodeSocket) -> bool:
    return any(not link.is_muted for link in output.links)
