# SPDX-License-Identifier: GPL-3.0-or-later
"""Gain and offset of an image texture: a node between it and its socket, which is there once a value is written."""

from __future__ import annotations

from typing import Any

import bpy

TINT_GAIN, TINT_OFFSET = "tint_gain", "tint_offset"
# the inputs of a Multiply Add, of vectors and of numbers
_INPUTS = {TINT_GAIN: 1, TINT_OFFSET: 2}
_NEUTRAL = {TINT_GAIN: 1.0, TINT_OFFSET: 0.0}
_PREFIX = "Tint "
IMAGE = "ShaderNodeTexImage"


def is_tint(node: bpy.types.Node) -> bool:
    """Whether a node is one that a tint has put there."""
    return node.name.startswith(_PREFIX) and getattr(node, "operation", "") == "MULTIPLY_ADD"


def tint_of(socket: bpy.types.NodeSocket) -> bpy.types.Node | None:
    """The node that tints what is linked to `socket`."""
    node = socket.links[0].from_node if socket.is_linked else None
    return node if node is not None and is_tint(node) else None


def tint_held(socket: bpy.types.NodeSocket, kind: str) -> float | tuple[float, ...]:
    """Gain or offset, neutral without a tint."""
    node = tint_of(socket)
    if node is None:
        return (_NEUTRAL[kind],) * 3 if socket.type == "RGBA" else _NEUTRAL[kind]
    value = node.inputs[_INPUTS[kind]].default_value
    return float(value) if isinstance(value, (int, float)) else tuple(map(float, value))


def tint_holder(socket: bpy.types.NodeSocket, kind: str) -> tuple[Any, str]:
    """What holds gain or offset, with a node put before the socket if there is none."""
    node = tint_of(socket)
    if node is None:
        tree, source = socket.id_data, socket.links[0].from_socket
        is_color = socket.type == "RGBA"
        node = tree.nodes.new("ShaderNodeVectorMath" if is_color else "ShaderNodeMath")
        node.operation = "MULTIPLY_ADD"
        node.name = node.label = _PREFIX + socket.name
        node.location = (socket.node.location.x - 180.0, socket.node.location.y)
        for other, neutral in _NEUTRAL.items():
            node.inputs[_INPUTS[other]].default_value = (neutral,) * 3 if is_color else neutral
        tree.links.new(source, node.inputs[0])
        tree.links.new(node.outputs[0], socket)
    return node.inputs[_INPUTS[kind]], "default_value"
