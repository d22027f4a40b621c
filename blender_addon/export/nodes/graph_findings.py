# SPDX-License-Identifier: GPL-3.0-or-later
"""What feeds a socket and cannot be evaluated by a second Blender on a copy of the file, and what is missing in it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import bpy

from ...versions import active_output
from ..findings import Findings
from ..images.image_pixels import is_missing
from .shader_graph import Links

GROUP, GROUP_INPUT = "ShaderNodeGroup", "NodeGroupInput"
# rays of a Bevel node: on a box with rounded edges a block under a highlight was 10 % too bright with 4, Blender's own
# number, and 1 % with 16 (the level 0.3 % either way)
STEADY_BEVEL = 16
PICTURES = ("ShaderNodeTexImage", "ShaderNodeTexEnvironment")
Groups = tuple[bpy.types.Node, ...]
_Place = tuple[int, ...]  # pointers: the same node in two places of a group is two


def graph_problem(socket: bpy.types.NodeSocket, *, groups: Groups = (), is_copied: bool) -> str | None:
    """What is wrong with the nodes that feed `socket`, said as what it is linked to; None if nothing is.

    `groups` are the group nodes it lies in, and `is_copied` says that a copy of the file is evaluated, which does not
    hold pixels that are not saved.
    """
    ways = [_Way(None, iter([(socket, groups)]))]
    on_the_way: set[_Place] = set()
    links = Links()
    good: set[_Place] = set()
    while ways:
        way = ways[-1]
        further, within = next(way.further, (None, ()))
        if further is None:
            ways.pop()
            if way.place is not None:
                on_the_way.discard(way.place)
                good.add(way.place)
            continue
        link = links.any_into(further)
        if link is None or link.is_muted or _is_of_wrong_kind(link):
            continue
        node, output = link.from_node, link.from_socket
        place = (*(group.as_pointer() for group in within), node.as_pointer(), output.as_pointer())
        if not link.is_valid or place in on_the_way:
            return f"the node '{node.name}' by a link in a circle"
        if place in good:
            continue
        problem = _problem(node, is_copied)
        if problem is not None:
            return problem
        on_the_way.add(place)
        ways.append(_Way(place, iter(feeding(node, output, within))))
    return None


def _is_of_wrong_kind(link: bpy.types.NodeLink) -> bool:
    """Whether a link ties a shader to a value, which Cycles leaves out (ShaderGraph::connect)."""
    return (link.from_socket.type == "SHADER") != (link.to_socket.type == "SHADER")


@dataclass(frozen=True)
class _Way:
    """An output that is looked at, and what of the sockets that feed it is still to come: graphs have any depth."""

    place: _Place | None
    further: Iterator[tuple[bpy.types.NodeSocket, Groups]]


def feeding(
    node: bpy.types.Node, output: bpy.types.NodeSocket, groups: Groups
) -> Iterator[tuple[bpy.types.NodeSocket, Groups]]:
    """The sockets that an output depends on, and the groups they are in."""
    if node.bl_idname == GROUP:
        inner = None if node.node_tree is None else group_output(node.node_tree)
        yield from ((s, (*groups, node)) for s in (inner.inputs if inner else ()) if s.identifier == output.identifier)
    elif node.bl_idname == GROUP_INPUT:
        outer = groups[-1].inputs if groups else ()
        yield from ((s, groups[:-1]) for s in outer if s.identifier == output.identifier)
    else:
        yield from ((s, groups) for s in node.inputs)


def group_output(tree: bpy.types.NodeTree) -> bpy.types.Node | None:
    """The node of a group whose inputs are what the group gives."""
    outputs = [node for node in tree.nodes if node.bl_idname == "NodeGroupOutput"]
    return next((node for node in outputs if node.is_active_output), outputs[0] if outputs else None)


def _problem(node: bpy.types.Node, is_copied: bool) -> str | None:
    if node.mute:  # passes its inputs on, whatever it is
        return None
    if node.bl_idname == "NodeUndefined" or not node.is_registered_node_type():
        return f"the node '{node.name}', which this Blender does not know"
    if node.bl_idname == "ShaderNodeScript":
        return f"the script '{node.name}', which is not evaluated"
    if node.bl_idname == GROUP:
        if node.node_tree is None:
            return f"the group '{node.name}' without nodes"
        if group_output(node.node_tree) is None:
            return f"the group '{node.node_tree.name}' without an output"
    image = getattr(node, "image", None) if node.bl_idname.startswith("ShaderNodeTex") else None
    if image is not None:
        return _image_problem(image, is_copied)
    return None


def _image_problem(image: bpy.types.Image, is_copied: bool) -> str | None:
    if is_copied and image.is_dirty and image.packed_file is None and image.source in ("FILE", "GENERATED"):
        return f"the image '{image.name}' with changes that are not saved (save or pack it)"
    return None


def note_missing_pictures(owner: str, tree: bpy.types.NodeTree | None, findings: Findings) -> None:
    """Name pictures without pixels that feed the output of a material or world, which Cycles shows as magenta."""
    output = active_output(tree)
    for node in _nodes_before(output.inputs) if output is not None else ():
        if node.bl_idname not in PICTURES or not is_missing(node.image):
            continue
        named = "image" if node.image is None else f"image '{node.image.name}'"
        findings.note(
            f"{owner}: the {named} of the node '{node.name}' is missing; it is magenta, as in Cycles. If the reference "
            "shows it, find it first: File > External Data > Find Missing Files."
        )


def note_pixel_sizes(owner: str, tree: bpy.types.NodeTree | None, findings: Findings) -> None:
    """Name nodes that measure in pixels of the picture, which are others where their values are looked at."""
    output = active_output(tree)
    for node in _nodes_before(output.inputs) if output is not None else ():
        if node.bl_idname == "ShaderNodeWireframe" and node.use_pixel_size:
            findings.note(
                f"{owner}: the node '{node.name}' measures in pixels, which are finer in the fit: its lines are "
                "thinner. Turn its Pixel Size off, and render the reference anew."
            )


def note_few_samples(material: str, tree: bpy.types.NodeTree | None, findings: Findings) -> None:
    """Name Bevel nodes whose normals are mostly noise, which the fit has the mean of."""
    output = active_output(tree)
    for node in _nodes_before(output.inputs) if output is not None else ():
        if node.bl_idname == "ShaderNodeBevel" and node.samples < STEADY_BEVEL:
            findings.note(
                f"Material '{material}': each sample of Cycles draws another normal from the {node.samples} rays of "
                f"the node '{node.name}', and the fit has their mean. Set its Samples to {STEADY_BEVEL}, and render "
                "the reference anew."
            )


def _nodes_before(sockets: Iterable[bpy.types.NodeSocket]) -> Iterator[bpy.types.Node]:
    """Every node that is not muted and feeds `sockets`, each as often as `outputs_before` has it."""
    return (output.node for output in outputs_before(sockets))


def outputs_before(sockets: Iterable[bpy.types.NodeSocket], groups: Groups = ()) -> Iterator[bpy.types.NodeSocket]:
    """Every output that feeds `sockets`, of nodes that are not muted, each once for each place it is used in.

    `groups` are the group nodes that the sockets lie in.
    """
    left = [(socket, groups) for socket in sockets]
    links = Links()
    met: set[_Place] = set()
    while left:
        socket, within = left.pop()
        link = links.any_into(socket)
        if link is None or link.is_muted or not link.is_valid:
            continue
        node, output = link.from_node, link.from_socket
        place = (*(group.as_pointer() for group in within), node.as_pointer(), output.as_pointer())
        if place not in met:
            met.add(place)
            if not node.mute:
                yield output
            left += feeding(node, output, within)
