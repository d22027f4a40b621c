# SPDX-License-Identifier: GPL-3.0-or-later
"""The closures a surface is mixed of, with everything that feeds them brought to the top of a copy of its tree.

Nothing is evaluated here: what a number hangs on becomes an output socket that Cycles can bake.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import bpy

from ..export.nodes.leaf_kinds import EMISSION
from ..export.nodes.shader_graph import Links
from ..versions import active_output

Path = tuple[bpy.types.Node, ...]  # group nodes, outermost first
Value = Any  # a number, or an output socket of the top tree
# sockets of shaders whose numbers Cycles keeps within bounds, beside all colours, which are above zero
FROM_ZERO_TO_ONE = (
    *("Alpha", "Roughness", "Metallic", "Diffuse Roughness", "Transmission Weight", "Subsurface Weight"),
    *("Coat Roughness", "Sheen Roughness"),
)
ABOVE_ZERO = ("Coat Weight", "Sheen Weight", "Specular IOR Level")
DEEPEST = 64  # group nodes and mixes within each other; a tree that is deeper holds a circle


@dataclass(frozen=True)
class Leaf:
    """One closure: its node, the group nodes it lies in, and its weight."""

    node: bpy.types.Node
    path: Path
    weight: Value


class ClosureTree:
    """The leaves of a tree that nobody else uses, nor the groups in it."""

    def __init__(self, tree: bpy.types.NodeTree) -> None:
        self._tree = tree
        self._at_tops: dict[tuple[int, ...], bpy.types.NodeSocket] = {}
        self._bounded: dict[tuple[int, str], bpy.types.NodeSocket] = {}
        output = active_output(tree)
        self.leaves: list[Leaf] = []
        if output is not None:
            self._walk((), output.inputs["Surface"], 1.0, 0)

    def value(self, path: Path, socket: bpy.types.NodeSocket) -> Value:
        """What feeds an input socket: its own value, or an output socket of the top tree."""
        while True:
            source = _source(socket)
            if source is None:
                return _plain(socket)
            if source.node.bl_idname != "NodeGroupInput" or not path:
                return self._at_top(path, source)
            socket, path = _by_identifier(path[-1].inputs, source.identifier), path[:-1]

    def bounded(self, leaf: Leaf, socket: bpy.types.NodeSocket) -> Value:
        """What feeds a socket of a leaf, within the bounds that Cycles keeps; its own value as it is."""
        value = self.value(leaf.path, socket)
        if not hasattr(value, "is_output"):
            return value
        place = value.as_pointer(), _bounds(leaf.node, socket)
        if place not in self._bounded:
            self._bounded[place] = within_bounds(self._tree, leaf.node, socket, value)
        return self._bounded[place]

    def _walk(self, path: Path, socket: bpy.types.NodeSocket, weight: Value, depth: int) -> None:
        source = _source(socket)
        if source is None or (isinstance(weight, float) and weight == 0.0):
            return
        if depth > DEEPEST:
            raise RecursionError("its shader nodes form a circle or lie too deep in each other")
        node, depth = source.node, depth + 1
        if node.mute:
            for link in node.internal_links:
                if link.to_socket == source:
                    self._walk(path, link.from_socket, weight, depth)
        elif node.bl_idname == "ShaderNodeMixShader":
            share = self._clamped(self.value(path, node.inputs[0]))
            self._walk(path, node.inputs[1], self._times(weight, self._rest(share)), depth)
            self._walk(path, node.inputs[2], self._times(weight, share), depth)
        elif node.bl_idname == "ShaderNodeAddShader":
            self._walk(path, node.inputs[0], weight, depth)
            self._walk(path, node.inputs[1], weight, depth)
        elif node.bl_idname == "ShaderNodeGroup":
            output = _group_output(node.node_tree)
            if output is not None:
                self._walk((*path, node), _by_identifier(output.inputs, source.identifier), weight, depth)
        elif node.bl_idname == "NodeGroupInput":
            if path:
                self._walk(path[:-1], _by_identifier(path[-1].inputs, source.identifier), weight, depth)
        else:
            self.leaves.append(Leaf(node, path, weight))

    def _at_top(self, path: Path, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        """The output of the top tree that gives what one in groups does, always the same one."""
        place = tuple(each.as_pointer() for each in (*path, socket))
        if place not in self._at_tops:
            self._at_tops[place] = self._led_up(path, socket)
        return self._at_tops[place]

    @staticmethod
    def _led_up(path: Path, socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket:
        for group in reversed(path):
            tree = group.node_tree
            output = _group_output(tree) or tree.nodes.new("NodeGroupOutput")
            kind = {"VALUE": "NodeSocketFloat", "INT": "NodeSocketFloat", "BOOLEAN": "NodeSocketFloat",
                    "VECTOR": "NodeSocketVector"}.get(socket.type, "NodeSocketColor")  # fmt: skip
            made = tree.interface.new_socket("material_fit", in_out="OUTPUT", socket_type=kind)
            group.node_tree = tree  # in a tree that no material has it does not follow the interface by itself
            tree.links.new(socket, _by_identifier(output.inputs, made.identifier))
            socket = _by_identifier(group.outputs, made.identifier)
        return socket

    def _math(self, operation: str, *values: Value) -> bpy.types.NodeSocket:
        node = self._tree.nodes.new("ShaderNodeMath")
        node.operation, node.use_clamp = operation, True
        for value, socket in zip(values, node.inputs, strict=False):
            if isinstance(value, float):
                socket.default_value = value
            else:
                self._tree.links.new(value, socket)
        return node.outputs[0]

    def _clamped(self, value: Value) -> Value:
        return min(max(value, 0.0), 1.0) if isinstance(value, float) else self._math("ADD", value, 0.0)

    def _rest(self, value: Value) -> Value:
        return 1.0 - value if isinstance(value, float) else self._math("SUBTRACT", 1.0, value)

    def _times(self, first: Value, second: Value) -> Value:
        if isinstance(first, float) and isinstance(second, float):
            return first * second
        if isinstance(first, float) and first == 1.0:
            return second
        if isinstance(second, float) and second == 1.0:
            return first
        return self._math("MULTIPLY", first, second)


def within_bounds(
    tree: bpy.types.NodeTree, shader: bpy.types.Node, socket: bpy.types.NodeSocket, source: bpy.types.NodeSocket
) -> bpy.types.NodeSocket:
    """The source of a shader's socket as Cycles takes it, sample by sample: a mean of what is beyond is not the same.

    An emission below zero is left, as it is refused.
    """
    bounds = _bounds(shader, socket)
    if not bounds:
        return source
    node: Any = tree.nodes.new("ShaderNodeVectorMath" if bounds == "colour" else "ShaderNodeMath")
    node.operation = "MAXIMUM"
    node.inputs[1].default_value = (0.0, 0.0, 0.0) if bounds == "colour" else 0.0
    if bounds == "share":
        node.use_clamp = True
    tree.links.new(source, node.inputs[0])
    return node.outputs[0]


def _bounds(shader: bpy.types.Node, socket: bpy.types.NodeSocket) -> str:
    """Which bounds a socket has: those of a `colour`, of a `share` or an `amount`; nothing without any."""
    if shader.bl_idname == EMISSION or socket.name.startswith("Emission"):
        return ""
    if socket.type == "RGBA":
        return "colour"
    if socket.name in FROM_ZERO_TO_ONE:
        return "share"
    return "amount" if socket.name in ABOVE_ZERO else ""


def own_groups(tree: bpy.types.NodeTree, depth: int = 0) -> list[bpy.types.NodeTree]:
    """Give each group node of `tree` a group of its own, to any depth; returns them."""
    made: list[bpy.types.NodeTree] = []
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None and depth < DEEPEST:
            node.node_tree = node.node_tree.copy()
            made += [node.node_tree, *own_groups(node.node_tree, depth + 1)]
    return made


def _source(socket: bpy.types.NodeSocket) -> bpy.types.NodeSocket | None:
    """The output socket that feeds `socket`, reroutes skipped; muted nodes are left to Blender."""
    links = None  # of a longer way
    while socket is not None and socket.is_linked:
        link = socket.links[0] if links is None else links.into(socket)
        if link.is_muted or not link.is_valid:
            return None
        if link.from_node.bl_idname != "NodeReroute":
            return link.from_socket
        socket, links = link.from_node.inputs[0], links or Links()
    return None


def _plain(socket: bpy.types.NodeSocket) -> Value:
    value = socket.default_value
    return [float(number) for number in list(value)[:3]] if hasattr(value, "__len__") else float(value)


def _group_output(tree: bpy.types.NodeTree | None) -> bpy.types.Node | None:
    outputs = [] if tree is None else [node for node in tree.nodes if node.bl_idname == "NodeGroupOutput"]
    return next((node for node in outputs if node.is_active_output), outputs[0] if outputs else None)


def _by_identifier(sockets: Sequence[bpy.types.NodeSocket], identifier: str) -> bpy.types.NodeSocket:
    return next((socket for socket in sockets if socket.identifier == identifier), None)
