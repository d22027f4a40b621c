# SPDX-License-Identifier: GPL-3.0-or-later
"""Light Path nodes answered with constants, in a copy of a tree and of the groups within it."""

from __future__ import annotations

import bpy

# What a ray that left a diffuse surface is told; everything else is 0. Light over a first bounce is most of the light.
SCATTERED = {"Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0, "Diffuse Depth": 1.0}
CAMERA = {"Is Camera Ray": 1.0}
# outputs that tell the camera's rays from all others, and nothing else
OF_CAMERA = ("Is Camera Ray",)


def light_path_outputs(tree: bpy.types.NodeTree) -> set[str]:
    """Return the names of the Light Path outputs that something in `tree` or its groups is linked to."""
    found = set()
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeLightPath":
            found |= {output.name for output in node.outputs if output.is_linked}
        elif node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            found |= light_path_outputs(node.node_tree)
    return found


def answer_light_paths(
    tree: bpy.types.NodeTree, answers: dict[str, float], *, own_groups: bool = False
) -> list[bpy.types.NodeTree]:
    """Replace every Light Path output by its number in `answers`, or 0; returns the groups that were copied for it.

    None is where the tree has its `own_groups` already.
    """
    copied: list[bpy.types.NodeTree] = []
    for node in list(tree.nodes):
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None and light_path_outputs(node.node_tree):
            if not own_groups:
                node.node_tree = node.node_tree.copy()
                copied.append(node.node_tree)
            copied += answer_light_paths(node.node_tree, answers, own_groups=own_groups)
        if node.bl_idname != "ShaderNodeLightPath":
            continue
        for output in node.outputs:
            targets = [link.to_socket for link in output.links]
            if not targets:
                continue
            constant = tree.nodes.new("ShaderNodeValue")
            constant.outputs[0].default_value = answers.get(output.name, 0.0)
            for target in targets:
                tree.links.new(constant.outputs[0], target)
    return copied
