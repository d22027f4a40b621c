# SPDX-License-Identifier: GPL-3.0-or-later
"""Groups on the way to values inside nodes: which are used elsewhere, and copies of them for one material."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import bpy

from ..export.nodes.target_shader import is_shared
from .place import Place


def shared_groups(material: bpy.types.Material, places: Iterable[Place]) -> list[str]:
    """Names of the groups in which a change of the values would change something else, too."""
    found: dict[str, None] = {}
    for place in places:
        shared = next((tree for tree in _groups(material, place.path[:-1]) if is_shared(tree)), None)
        if shared is not None:
            found[shared.name] = None
    return list(found)


def make_groups_own(material: bpy.types.Material, places: Sequence[Place]) -> list[str]:
    """Give `material` copies of these groups; returns what was done."""
    names = shared_groups(material, places)
    for place in places:
        tree = material.node_tree
        for step in place.path[:-1]:
            assert tree is not None
            node = tree.nodes[step]
            if is_shared(node.node_tree):  # by now also what lies in a group that was just copied
                node.node_tree = node.node_tree.copy()
            tree = node.node_tree
    return [
        f"The group '{name}' is used elsewhere too: material '{material.name}' got a copy of its own." for name in names
    ]


def _groups(material: bpy.types.Material, steps: Sequence[str]) -> list[bpy.types.NodeTree]:
    found, tree = [], material.node_tree
    for step in steps:
        assert tree is not None
        tree = tree.nodes[step].node_tree
        found.append(tree)
    return found
