# SPDX-License-Identifier: GPL-3.0-or-later
"""The shader of a material that is fitted: its node, in groups and mixes to any depth, and the sockets that hold its
values."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import bpy

from ...versions import PRINCIPLED, node_tree_of
from .closure_leaves import ClosureError, ClosureLeaf, Groups, by_identifier, closure_leaves
from .displacement import displacement_in
from .graph_findings import GROUP_INPUT
from .leaf_kinds import (
    EMISSION,
    KINDS,
    TRANSPARENT,
    LeafKind,
    inputs_of,
    is_fitted,
    is_shader,
    kind_of,
    why_not_fitted,
)
from .shader_graph import Links, group_of_output
from .volumes import AbsorbingVolume, absorbing_volume, lets_light_in

ALL_LEAVES = "*"  # what a material keeps where all shaders of its mix are fitted
ALL = "all"  # and what a user calls it
DIRECTIONS = ("Normal", "Coat Normal", "Tangent")


@dataclass(frozen=True)
class Place:
    """A socket, and the group nodes it lies in."""

    socket: bpy.types.NodeSocket
    groups: Groups


@dataclass(frozen=True)
class TargetShader:
    """The leaf of a material's shaders that is fitted, a Principled BSDF or another of `leaf_kinds`, and the others, of
    which so many come `before` it in the tree. With a `volume` inside that light gets into, its values are this one's,
    too."""

    leaf: ClosureLeaf
    others: tuple[ClosureLeaf, ...] = ()
    before: int = 0
    volume: AbsorbingVolume | None = None

    @property
    def node(self) -> bpy.types.Node:
        """The shader node."""
        return self.leaf.node

    @property
    def groups(self) -> Groups:
        """The group nodes it lies in."""
        return self.leaf.groups

    @property
    def kind(self) -> LeafKind:
        """How the node is fitted."""
        kind = kind_of(self.node)
        assert kind is not None  # of other nodes it has no values
        return kind

    @property
    def is_mixed(self) -> bool:
        """Whether it is only a part of the surface."""
        return bool(self.others) or self.leaf.is_linked or self.leaf.share != 1.0

    @property
    def path(self) -> list[str]:
        """Names of the groups and of the node."""
        return self.leaf.path

    @property
    def name(self) -> str:
        """The path as one word, by which a user chooses a leaf."""
        return leaf_name(self.leaf)

    def own_name(self, name: str) -> str:
        """What the node calls the value `name` of a Principled BSDF."""
        socket = inputs_of(self.node).get(name)
        return name if socket is None else socket.name

    @property
    def displacement(self) -> bpy.types.NodeSocket | None:
        """What displaces its material is linked to."""
        return displacement_in((self.groups[0] if self.groups else self.node).id_data)

    @property
    def own_names(self) -> dict[str, str]:
        """The values' names in the Principled BSDF by what the node calls them."""
        return {self.own_name(name): name for name in self.places}

    @cached_property
    def places(self) -> dict[str, Place]:
        """Where each value is set, by its name in the Principled BSDF.

        That is the node's own socket, or the input of a group that leads to it alone.
        """
        volume, inside, below = self.volume, {}, ()
        if volume is not None and volume.leaf.groups in ((), self.groups):
            inside, below = volume.own_sockets, volume.leaf.groups
        return {
            **{name: self._place(name, socket, self.groups) for name, socket in inputs_of(self.node).items()},
            **{name: self._place(name, socket, below) for name, socket in inside.items()},
        }

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

    def _place(self, name: str, socket: bpy.types.NodeSocket, groups: Groups) -> Place:
        while groups and name not in DIRECTIONS:
            outer = _sole_input(socket, groups[-1])
            if outer is None or outer.type != socket.type:
                break
            socket, groups = outer, groups[:-1]
        return Place(socket, groups)


def target_shader(material: bpy.types.Material | None, leaf: str | None = None) -> TargetShader | None:
    """The shader that is fitted of those that Cycles shows, through groups, mixes and reroutes, or None.

    `leaf` is its name; without one it is the leaf that the user chose for the material, or else that of the largest
    share, as with `ALL_LEAVES`.
    """
    leaf = "" if leaf == ALL_LEAVES else leaf
    try:
        leaves = closure_leaves(material)
    except ClosureError:
        return None
    fitted = [each for each in leaves if is_fitted(each.node)]
    if not fitted:
        return None
    wanted = chosen_leaf(material) if leaf is None else leaf
    named = next((each for each in fitted if leaf_name(each) == wanted), None)
    if named is None and leaf:
        return None
    chosen = named or max(fitted, key=lambda each: each.share)
    others = tuple(each for each in leaves if each is not chosen)
    volume = absorbing_volume(material) if any(map(lets_light_in, leaves)) else None
    return TargetShader(chosen, others, leaves.index(chosen), volume)


def chosen_leaf(material: bpy.types.Material | None) -> str:
    """The name of the leaf that the user chose for a material, empty where it is left to the shares."""
    kept = _kept_leaf(material)
    return "" if kept == ALL_LEAVES else kept


def fits_all_leaves(material: bpy.types.Material | None) -> bool:
    """Whether all shaders of a mix are fitted: the user chose so, or what is beside the one that reflects glows.

    The largest has the plain names then.
    """
    if _kept_leaf(material) == ALL_LEAVES:
        return True
    nodes = [leaf.node for leaf in _leaves(material)]
    return len([node for node in nodes if is_fitted(node)]) == 1 and any(node.bl_idname == EMISSION for node in nodes)


def _kept_leaf(material: bpy.types.Material | None) -> str:
    kept = getattr(material, "mfo", None)
    return "" if kept is None else kept.leaf


def leaf_name(leaf: ClosureLeaf) -> str:
    """What a leaf is called where a user chooses one: its node, after the groups it lies in."""
    return "/".join(leaf.path)


def leaf_called(material: bpy.types.Material, wanted: str) -> str:
    """The name of the one leaf that a user calls `wanted`: by its name, its node's, its label or its kind's.

    That of all of them is `ALL_LEAVES`.

    Raises
    ------
    ClosureError
        If there is none, or there are several; the message is one sentence.
    """
    leaves = fitted_leaves(material)
    called = [(leaf_name(leaf), leaf.node.name, leaf.node.label, leaf.node.bl_label) for leaf in leaves]
    for names in zip(*called, strict=True):
        if names.count(wanted) == 1:
            return leaf_name(leaves[names.index(wanted)])
    if wanted.lower() == ALL and leaves:
        return ALL_LEAVES
    listed = ", ".join(f"'{leaf_name(leaf)}'" for leaf in leaves) or "none"
    raise ClosureError(f"Material '{material.name}' has no shader '{wanted}' that can be fitted: give one of {listed}.")


def fitted_leaves(material: bpy.types.Material | None) -> list[ClosureLeaf]:
    """The leaves of which a user may choose one."""
    return [leaf for leaf in _leaves(material) if is_fitted(leaf.node)]


def _leaves(material: bpy.types.Material | None) -> list[ClosureLeaf]:
    """All leaves, none of what cannot be taken apart."""
    try:
        return closure_leaves(material)
    except ClosureError:
        return []


def why_no_target(material: bpy.types.Material) -> str:
    """The sentence for a material of which no shader can be fitted."""
    try:
        leaves = closure_leaves(material)
    except ClosureError as error:
        return f"Material '{material.name}' {error}."
    tree = node_tree_of(material)
    muted = (
        next((each.name for each in tree.nodes if each.bl_idname == PRINCIPLED and each.mute), None) if tree else None
    )
    if muted is not None:
        return f"Node '{muted}' of material '{material.name}' is muted: press M over it in the Shader Editor."
    for leaf in leaves:
        problem = why_not_fitted(leaf.node) if leaf.node.bl_idname in KINDS else None
        if problem is not None:
            return f"'{leaf.node.name}' ({leaf.node.bl_label}) of material '{material.name}' {problem}."
    reflecting = [leaf.node for leaf in leaves if is_shader(leaf.node)]
    shown = ", ".join(
        dict.fromkeys(node.bl_label for node in reflecting if node.bl_idname not in (EMISSION, TRANSPARENT))
    )
    if shown:
        return (
            f"Material '{material.name}' shows {shown}, which no model of the fit has: link a Principled BSDF or "
            "another shader of its kind."
        )
    if leaves:
        return (
            f"Material '{material.name}' shows {' and '.join(dict.fromkeys(leaf.node.bl_label for leaf in leaves))} "
            "alone, which reflects no light: link a Principled BSDF, directly, in a group or in a mix."
        )
    group = group_of_output(node_tree_of(material))
    if group is not None:
        return f"Material '{material.name}' has its output inside the group '{group}': move it out of the group."
    return (
        f"Material '{material.name}' has no Principled BSDF linked to Surface of its output: link one, directly, in a "
        "group or in a mix."
    )


def make_own(material: bpy.types.Material, names: Collection[str], leaf: str | None = None) -> list[str]:
    """Give `material` copies of the groups that hold values `names` and are used elsewhere; returns what was done.

    `leaf` names the shader of a mix that the values belong to.
    """
    target = target_shader(material, leaf)
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
    links = Links()
    while socket.is_linked:
        link = links.into(socket)
        if link.is_muted or not link.is_valid or links.count_from(link.from_socket) != 1:
            return None
        if link.from_node.bl_idname == "NodeReroute":
            socket = link.from_node.inputs[0]
            continue
        if link.from_node.bl_idname != GROUP_INPUT:
            return None
        identifier = link.from_socket.identifier
        inside = [node for node in group.node_tree.nodes if node.bl_idname == GROUP_INPUT]
        twins = [by_identifier(node.outputs, identifier) for node in inside]
        if sum(len(twin.links) for twin in twins if twin is not None) != 1:
            return None
        return by_identifier(group.inputs, identifier)
    return None


def is_shared(tree: bpy.types.NodeTree) -> bool:
    """Whether a group is used elsewhere too, so that a change in it would be seen there."""
    return tree.library is not None or tree.users - int(tree.use_fake_user) > 1
