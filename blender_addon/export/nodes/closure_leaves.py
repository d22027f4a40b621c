# SPDX-License-Identifier: GPL-3.0-or-later
"""The shaders that a surface is mixed of: the leaves below Mix and Add Shader, in groups to any depth.

A leaf counts with the sum over all ways to it of the product of the Mix factors on the way, clamped to 0 to 1 as Cycles
does. A side of a Mix without a link is black.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

import bpy

from ...versions import active_output, node_tree_of
from .graph_findings import GROUP, GROUP_INPUT, group_output
from .shader_graph import source_of

Groups = tuple[bpy.types.Node, ...]  # group nodes, outermost first
MIX, ADD = "ShaderNodeMixShader", "ShaderNodeAddShader"
DEEPEST = 64  # groups and mixes within each other; more is a circle
MOST_WAYS = 256  # to leaves: nodes that are linked to several mixes multiply
OUTPUT = "Output "  # before the identifier of a node's output, where that is asked and no socket
UNKNOWN = 0.5  # what a linked factor is taken for where no picture of it is at hand


class ClosureError(Exception):
    """The shaders cannot be taken apart; the message ends a sentence that begins with the material."""


@dataclass(frozen=True)
class Factor:
    """A Mix Shader's factor on the way to a leaf, the groups it lies in, and on which side the way goes on."""

    socket: bpy.types.NodeSocket
    groups: Groups
    second: bool

    @property
    def value(self) -> float | None:
        """The share of this side; None where nodes give it."""
        if source_of(self.socket) is not None:
            return None
        fac = min(max(float(self.socket.default_value), 0.0), 1.0)
        return fac if self.second else 1.0 - fac


@dataclass(frozen=True)
class ClosureLeaf:
    """A shader node, the groups it lies in, the factors on each way to it, and the identifier of its output."""

    node: bpy.types.Node
    groups: Groups
    ways: tuple[tuple[Factor, ...], ...]
    output: str = ""

    @property
    def path(self) -> list[str]:
        """Names of the groups and of the node."""
        return [node.name for node in (*self.groups, self.node)]

    @property
    def is_linked(self) -> bool:
        """Whether nodes give some of its factors."""
        return any(factor.value is None for way in self.ways for factor in way)

    @property
    def share(self) -> float:
        """Its weight, with `UNKNOWN` for what nodes give."""
        total = 0.0
        for way in self.ways:
            product = 1.0
            for factor in way:
                product *= UNKNOWN if factor.value is None else factor.value
            total += product
        return total


def closure_leaves(material: bpy.types.Material | None, socket: str = "Surface") -> list[ClosureLeaf]:
    """The leaves of a material that count, in the order of its tree, at this `socket` of its output; none without a
    link there.

    Raises
    ------
    ClosureError
        If the tree holds a circle or too many ways.
    """
    output = active_output(node_tree_of(material)) if material is not None else None
    if output is None:
        return []
    found: dict[tuple[int | str, ...], ClosureLeaf] = {}
    for count, leaf in enumerate(_walk(output.inputs[socket], (), (), ())):
        if count == MOST_WAYS:
            raise ClosureError(f"mixes shaders in more than {MOST_WAYS} ways: simplify it")
        place = (*(node.as_pointer() for node in (*leaf.groups, leaf.node)), leaf.output)
        before = found.get(place)
        ways = leaf.ways if before is None else before.ways + leaf.ways
        found[place] = ClosureLeaf(leaf.node, leaf.groups, ways, leaf.output)
    return list(found.values())


def _walk(
    socket: bpy.types.NodeSocket | None, groups: Groups, factors: tuple[Factor, ...], above: tuple[int, ...]
) -> Iterator[ClosureLeaf]:
    """The leaves below `socket`; `above` are the nodes on the way to it."""
    if socket is not None and any(not link.is_valid and not link.is_muted for link in socket.links):
        raise ClosureError(f"has a link in a circle or of a wrong kind to the node '{socket.node.name}': unlink it")
    source = None if socket is None else source_of(socket)
    if source is None or source.node.mute:  # what goes through a muted node is found by `source_of`
        return
    node, place = source.node, hash((*(group.as_pointer() for group in groups), source.as_pointer()))
    if place in above or len(above) > DEEPEST:
        raise ClosureError(f"has shader nodes in a circle, or too deep in each other, at '{node.name}': unlink it")
    above = (*above, place)
    if node.bl_idname == GROUP:
        inner = None if node.node_tree is None else group_output(node.node_tree)
        if inner is not None:
            yield from _walk(by_identifier(inner.inputs, source.identifier), (*groups, node), factors, above)
    elif node.bl_idname == GROUP_INPUT:
        if groups:
            outer = by_identifier(groups[-1].inputs, source.identifier)
            yield from _walk(outer, groups[:-1], factors, above)
    elif node.bl_idname == MIX:
        for number, second in ((1, False), (2, True)):
            factor = Factor(node.inputs[0], groups, second)
            if factor.value != 0.0:
                yield from _walk(node.inputs[number], groups, (*factors, factor), above)
    elif node.bl_idname == ADD:
        for side in node.inputs:
            yield from _walk(side, groups, factors, above)
    else:
        yield ClosureLeaf(node, groups, (factors,), source.identifier)


def by_identifier(sockets: Collection[bpy.types.NodeSocket], identifier: str) -> bpy.types.NodeSocket | None:
    """The socket of that identifier."""
    return next((socket for socket in sockets if socket.identifier == identifier), None)
