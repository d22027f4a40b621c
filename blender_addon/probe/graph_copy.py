# SPDX-License-Identifier: GPL-3.0-or-later
"""A material's nodes as a copy of their own, groups included, and what lies upstream of a socket."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import bpy

from ..export.nodes.read_alphas import keep_alphas
from ..export.nodes.shader_graph import NOT_IN_CYCLES

GROUP = "ShaderNodeGroup"


def own_copy(material: bpy.types.Material) -> bpy.types.Material:
    """A copy of `material` whose node groups are copies too, so that a change in them is seen nowhere else.

    Nothing in it is animated: a render would put what a keyframe or a driver says over what is written into it.
    """
    copy = material.copy()
    copy.animation_data_clear()
    _own(copy.node_tree)
    keep_alphas((copy.node_tree, *_groups_in(copy.node_tree)))  # as long as its surface reads them
    return copy


def unlink_unknown() -> None:
    """Remove the links from nodes that Cycles has not, of all trees of the file; Cycles itself takes no notice of them.

    What is put into a copy of a tree would find nothing at the end of such a link, where the socket has its own value.
    """
    owners = (*bpy.data.materials, *bpy.data.worlds, *bpy.data.lights)
    trees = [tree for owner in owners if (tree := owner.node_tree) is not None]
    for tree in (*trees, *bpy.data.node_groups):
        if tree.bl_idname == "ShaderNodeTree":
            for link in [link for link in tree.links if link.from_node.bl_idname in NOT_IN_CYCLES]:
                tree.links.remove(link)


def variant_of(tree: bpy.types.NodeTree) -> bpy.types.NodeTree:
    """A copy of a material's tree for a group node in another one, with which `remove_copy` takes it away."""
    variant = tree.copy()
    _own(variant)
    return variant


def remove_copy(material: bpy.types.Material) -> None:
    """Remove what `own_copy` made."""
    trees = list(_groups_in(material.node_tree))
    bpy.data.materials.remove(material)
    for tree in trees:
        if tree.users == 0:
            bpy.data.node_groups.remove(tree)


def node_at(tree: bpy.types.NodeTree, path: Sequence[str]) -> tuple[bpy.types.NodeTree, bpy.types.Node]:
    """The node of a path, the names of the groups that hold it and its own, and the tree that it is in."""
    *groups, name = path
    for group in groups:
        tree = tree.nodes[group].node_tree
    return tree, tree.nodes[name]


def nodes_of(tree: bpy.types.NodeTree) -> Iterator[bpy.types.Node]:
    """Every node of a tree and of the groups in it."""
    for node in tree.nodes:
        yield node
        if node.bl_idname == GROUP and node.node_tree is not None:
            yield from nodes_of(node.node_tree)


def _own(tree: bpy.types.NodeTree) -> None:
    """Give a tree copies of the groups in it, to any depth, and the values of this frame for ever."""
    tree.animation_data_clear()
    for node in tree.nodes:
        if node.bl_idname == GROUP and node.node_tree is not None:
            node.node_tree = node.node_tree.copy()
            _own(node.node_tree)


def _groups_in(tree: bpy.types.NodeTree) -> Iterator[bpy.types.NodeTree]:
    for node in tree.nodes:
        if node.bl_idname == GROUP and node.node_tree is not None:
            yield node.node_tree
            yield from _groups_in(node.node_tree)
