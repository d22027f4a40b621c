# SPDX-License-Identifier: GPL-3.0-or-later
"""Outputs of Light Path and Object Info answered with constants, in a copy of a tree and of the groups within it."""

from __future__ import annotations

from collections.abc import Callable

import bpy

# What a ray that left a diffuse surface is told; everything else is 0. Light over a first bounce is most of the light.
SCATTERED = {"Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0, "Diffuse Depth": 1.0}
CAMERA = {"Is Camera Ray": 1.0}
GLOSSY = {"Is Glossy Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Depth": 1.0, "Glossy Depth": 1.0}
# a bend through a surface is glossy, too (Cycles 5.0: kernel/integrator/path_state.h)
BENT = {"Is Glossy Ray": 1.0, "Is Transmission Ray": 1.0, "Ray Depth": 1.0, "Transmission Depth": 1.0}
SHADOW = {"Is Shadow Ray": 1.0, "Ray Depth": 1.0}
# by the words of the backend's plugin `by_ray`
BEHIND = "behind"  # that of what any ray finds at the back of a surface
ANSWERS = {"scattered": SCATTERED, "glossy": GLOSSY, "transmission": BENT, "shadow": SHADOW, "camera": CAMERA}
# outputs that tell the camera's rays from all others, and nothing else
OF_CAMERA = ("Is Camera Ray",)
OF_SHADOW = ("Is Shadow Ray",)  # the same of rays that ask a surface for nothing but how much light it lets through
# those that surfaces answer by the kind of the ray
OF_RAYS = tuple(f"Is {kind} Ray" for kind in ("Camera", "Diffuse", "Glossy", "Transmission", "Reflection", "Shadow"))


def light_path_outputs(tree: bpy.types.NodeTree) -> set[str]:
    """Return the names of the Light Path outputs that something in `tree` or its groups is linked to."""
    found = set()
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeLightPath":
            found |= {output.name for output in node.outputs if output.is_linked}
        elif node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            found |= light_path_outputs(node.node_tree)
    return found


def other_looks(tree: bpy.types.NodeTree) -> dict[str, str]:
    """The kinds of rays of `ANSWERS` that find another surface than scattered ones, each with the kind to ask for it.

    Of kinds that are told the same the first stands for all.
    """
    asked = light_path_outputs(tree)
    told = {kind: tuple(answers.get(name, 0.0) for name in asked) for kind, answers in ANSWERS.items()}
    first = {answer: kind for kind, answer in reversed(told.items())}
    return {kind: first[answer] for kind, answer in told.items() if first[answer] != "scattered"}


def answer_light_paths(
    tree: bpy.types.NodeTree, answers: dict[str, float], *, own_groups: bool = False
) -> list[bpy.types.NodeTree]:
    """Replace every Light Path output by its number in `answers`, or 0; returns the groups that were copied for it.

    None is where the tree has its `own_groups` already.
    """
    return _answered(tree, "ShaderNodeLightPath", lambda name: answers.get(name, 0.0), own_groups=own_groups)


def answer_backfacing(tree: bpy.types.NodeTree) -> list[bpy.types.NodeTree]:
    """Have every Geometry node say that the back is met; returns the groups that were copied for it."""
    return _answered(tree, "ShaderNodeNewGeometry", {"Backfacing": 1.0}.get, own_groups=False)


def answer_random(tree: bpy.types.NodeTree, number: float) -> list[bpy.types.NodeTree]:
    """Replace Random of every Object Info by that of one instance; returns the groups that were copied for it."""
    return _answered(tree, "ShaderNodeObjectInfo", {"Random": number}.get, own_groups=False)


def _answered(
    tree: bpy.types.NodeTree, kind: str, answer: Callable[[str], float | None], *, own_groups: bool
) -> list[bpy.types.NodeTree]:
    """Replace outputs of nodes of a kind by their answers, where they have one; returns the groups copied for it."""
    copied: list[bpy.types.NodeTree] = []
    for node in list(tree.nodes):
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None and _holds(node.node_tree, kind):
            if not own_groups:
                node.node_tree = node.node_tree.copy()
                copied.append(node.node_tree)
            copied += _answered(node.node_tree, kind, answer, own_groups=own_groups)
        if node.bl_idname != kind:
            continue
        for output in node.outputs:
            targets = [link.to_socket for link in output.links]
            number = answer(output.name)
            if not targets or number is None:
                continue
            constant = tree.nodes.new("ShaderNodeValue")
            constant.outputs[0].default_value = number
            for target in targets:
                tree.links.new(constant.outputs[0], target)
    return copied


def _holds(tree: bpy.types.NodeTree, kind: str) -> bool:
    """Whether something in `tree` or its groups is linked to a node of a kind."""
    for node in tree.nodes:
        if node.bl_idname == kind and any(output.is_linked for output in node.outputs):
            return True
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None and _holds(node.node_tree, kind):
            return True
    return False
