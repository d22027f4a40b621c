# SPDX-License-Identifier: GPL-3.0-or-later
"""The shader of a material that is fitted: its node, in groups to any depth, and the sockets that hold its values."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import bpy

from ...versions import DIFFUSE, PRINCIPLED, active_output, node_tree_of
from .graph_findings import GROUP, GROUP_INPUT, group_output
from .shader_graph import source_of

Groups = tuple[bpy.types.Node, ...]  # group nodes, outermost first
# what a Diffuse BSDF calls the values of the Principled BSDF that it is fitted as
_DIFFUSE_NAMES = {"Base Color": "Color", "Diffuse Roughness": "Roughness"}
DIRECTIONS = ("Normal", "Coat Normal", "Tangent")
DEEPEST = 64  # groups within each other; more is a circle


@dataclass(frozen=True)
class Place:
    """A socket, and the group nodes it lies in."""

    socket: bpy.types.NodeSocket
    groups: Groups


@dataclass(frozen=True)
class TargetShader:
    """A Principled or Diffuse BSDF and the group nodes it lies in."""

    node: bpy.types.Node
    groups: Groups

    @property
    def is_diffuse(self) -> bool:
        """Whether it is a Diffuse BSDF, which is fitted as a Principled BSDF without specular."""
        return self.node.bl_idname == DIFFUSE

    @property
    def path(self) -> list[str]:
        """Names of the groups and of the node."""
        return [node.name for node in (*self.groups, self.node)]

    def own_name(self, name: str) -> str:
        """What the node calls the value `name` of a Principled BSDF."""
        return _DIFFUSE_NAMES.get(name, name) if self.is_diffuse else name

    @property
    def own_names(self) -> dict[str, str]:
        """The values' names in the Principled BSDF by what the node calls them."""
        return {self.own_name(name): name for name in self.places}

    @cached_property
    def places(self) -> dict[str, Place]:
        """Where each value is set, by its name in the Principled BSDF.

        That is the node's own socket, or the input of a group that leads to it alone.
        """
        if self.is_diffuse:
            named = {name: self.node.inputs[own] for name, own in _DIFFUSE_NAMES.items()}
        else:
            named = {socket.name: socket for socket in self.node.inputs}
        return {name: self._place(name, socket) for name, socket in named.items()}

    @property
    def sockets(self) -> dict[str, bpy.types.NodeSocket]:
        """The sockets of `places`."""
        return {name: place.socket for name, place in self.places.items()}

    def depth_of(self, names: Collection[str]) -> int:
        """How many of the groups have to be the material's own for `names` to change nowhere else."""
        return max((len(self.places[name].groups) for name in names if name in self.places), default=0)

    def shared_group(self, names: Collection[str]) -> bpy.types.NodeTree | None:
        """The outermost group in which new values for `names` would change something else too."""
        trees = [group.node_tree for group in self.groups[: self.depth_of(names)]]
        return next((tree for tree in trees if is_shared(tree)), None)

    def _place(self, name: str, socket: bpy.types.NodeSocket) -> Place:
        groups = self.groups
        while groups and name not in DIRECTIONS:
            outer = _sole_input(socket, groups[-1])
            if outer is None or outer.type != socket.type:
                break
            socket, groups = outer, groups[:-1]
        return Place(socket, groups)


def target_shader(material: bpy.types.Material | None) -> TargetShader | None:
    """The shader linked to the output that Cycles uses, through groups and reroutes, if it is one that is fitted."""
    output = active_output(node_tree_of(material)) if material is not None else None
    socket, groups = None if output is None else output.inputs["Surface"], ()
    while socket is not None and len(groups) <= DEEPEST:
        source = source_of(socket)
        if source is None:
            return None
        node = source.node
        if node.bl_idname == GROUP:
            inner = None if node.node_tree is None else group_output(node.node_tree)
            socket, groups = None if inner is None else _by_identifier(inner.inputs, source.identifier), (*groups, node)
        elif node.bl_idname == GROUP_INPUT and groups:
            socket, groups = _by_identifier(groups[-1].inputs, source.identifier), groups[:-1]
        else:
            is_fitted = node.bl_idname in (PRINCIPLED, DIFFUSE) and not node.mute
            return TargetShader(node, groups) if is_fitted else None
    return None


def make_own(material: bpy.types.Material, names: Collection[str]) -> list[str]:
    """Give `material` copies of the groups that hold values `names` and are used elsewhere; returns what was done."""
    target = target_shader(material)
    first = None if target is None else target.shared_group(names)
    if target is None or first is None:
        return []
    name, tree = first.name, node_tree_of(material)
    assert tree is not None  # it holds the target
    for step in target.path[: target.depth_of(names)]:
        group = tree.nodes[step]
        if is_shared(group.node_tree):  # by now also what lies in a group that was just copied
            group.node_tree = group.node_tree.copy()
        tree = group.node_tree
    return [f"The group '{name}' is used elsewhere too: material '{material.name}' got a copy of its own."]


def _sole_input(socket: bpy.types.NodeSocket, group: bpy.types.Node) -> bpy.types.NodeSocket | None:
    """The input of `group` that feeds `socket` inside it as it is, and nothing else."""
    while socket.is_linked:
        link = socket.links[0]
        if link.is_muted or not link.is_valid or len(link.from_socket.links) != 1:
            return None
        if link.from_node.bl_idname == "NodeReroute":
            socket = link.from_node.inputs[0]
            continue
        if link.from_node.bl_idname != GROUP_INPUT:
            return None
        identifier = link.from_socket.identifier
        inside = [node for node in group.node_tree.nodes if node.bl_idname == GROUP_INPUT]
        twins = [_by_identifier(node.outputs, identifier) for node in inside]
        if sum(len(twin.links) for twin in twins if twin is not None) != 1:
            return None
        return _by_identifier(group.inputs, identifier)
    return None


def is_shared(tree: bpy.types.NodeTree) -> bool:
    """Whether a group is used elsewhere too, so that a change in it would be seen there."""
    return tree.library is not None or tree.users - int(tree.use_fake_user) > 1


def _by_identifier(sockets: Collection[bpy.types.NodeSocket], identifier: str) -> bpy.types.NodeSocket | None:
    return next((socket for socket in sockets if socket.identifier == identifier), None)
