# SPDX-License-Identifier: GPL-3.0-or-later
"""Colours of pictures whose Alpha is read, too: Cycles divides them by it, and a copy that asks for one has both."""

from __future__ import annotations

from collections.abc import Iterable

import bpy

from ...versions import active_output
from .merged_nodes import IMAGE, are_alike
from .shader_graph import source_of

# Of alpha, added to the colour: nothing, and yet no zero, with which Cycles would leave Alpha out
TRACE = 1e-30


def keep_alphas(trees: Iterable[bpy.types.NodeTree]) -> None:
    """Let whatever reads Color of an Image Texture node in these trees read its Alpha, where something else does.

    Cycles leaves out what a bake does not ask for, and divides by alpha where Alpha is linked
    (`ImageTextureNode::compile`).
    """
    for tree in trees:
        for color, alpha, ends in _divided(tree):
            both = tree.nodes.new("ShaderNodeMix")
            both.data_type, both.blend_type, both.clamp_factor = "RGBA", "ADD", False
            both.inputs[0].default_value = TRACE
            first, second = (socket for socket in both.inputs if socket.type == "RGBA")
            tree.links.new(color, first)
            tree.links.new(alpha, second)
            for end in ends:
                tree.links.new(next(socket for socket in both.outputs if socket.type == "RGBA"), end)


def _divided(
    tree: bpy.types.NodeTree,
) -> list[tuple[bpy.types.NodeSocket, bpy.types.NodeSocket, list[bpy.types.NodeSocket]]]:
    """Color and Alpha of each Image Texture that is read by both, and where its Color goes."""
    links = list(tree.links)  # which are no more once a new one takes the place of any
    shown, found = _reaching(tree, links), []
    read = [node for node in tree.nodes if node.bl_idname == IMAGE and node.outputs["Alpha"].is_linked]
    for node in tree.nodes:
        if node.bl_idname == IMAGE:
            color, alpha = node.outputs["Color"], node.outputs["Alpha"]
            like = {alpha, *(each.outputs["Alpha"] for each in read if are_alike(node, each, source_of))}
            if any(link.from_socket in like and link.to_node.as_pointer() in shown for link in links):
                found.append((color, alpha, [link.to_socket for link in links if link.from_socket == color]))
    return found


def _reaching(tree: bpy.types.NodeTree, links: list[bpy.types.NodeLink]) -> set[int]:
    """The nodes on which an output of the tree, or of a group, hangs."""
    outputs = [active_output(tree), *(node for node in tree.nodes if node.bl_idname == "NodeGroupOutput")]
    waiting = [node for node in outputs if node is not None]
    found = {node.as_pointer() for node in waiting}
    while waiting:
        node = waiting.pop()
        for link in links:
            before = link.from_node
            if link.to_node == node and not link.is_muted and before.as_pointer() not in found:
                found.add(before.as_pointer())
                waiting.append(before)
    return found
