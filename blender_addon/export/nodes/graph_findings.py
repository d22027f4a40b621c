# SPDX-License-Identifier: GPL-3.0-or-later
"""What feeds a socket and cannot be evaluated by a second Blender on a copy of the file; known before one starts."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import bpy

from .shader_graph import Links

GROUP, GROUP_INPUT = "ShaderNodeGroup", "NodeGroupInput"
_Groups = tuple[bpy.types.Node, ...]
_Place = tuple[int, ...]  # pointers: the same node in two places of a group is two


def graph_problem(socket: bpy.types.NodeSocket, *, groups: _Groups = (), is_copied: bool) -> str | None:
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
        if link is None or link.is_muted:
            continue
        node, output = link.from_node, link.from_socket
        place = (*(group.as_pointer() for group in within), node.as_pointer(), output.as_pointer())
        if not link.is_valid or place in on_the_way:
            return f"the node '{node.name}' by a link in a circle or of a wrong kind"
        if place in good:
            continue
        problem = _problem(node, is_copied)
        if problem is not None:
            return problem
        on_the_way.add(place)
        ways.append(_Way(place, iter(feeding(node, output, within))))
    return None


@dataclass(frozen=True)
class _Way:
    """An output that is looked at, and what of the sockets that feed it is still to come: graphs have any depth."""

    place: _Place | None
    further: Iterator[tuple[bpy.types.NodeSocket, _Groups]]


def feeding(
    node: bpy.types.Node, output: bpy.types.NodeSocket, groups: _Groups
) -> Iterator[tuple[bpy.types.NodeSocket, _Groups]]:
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
    if image.source != "TILED" and not image.has_data and not image.packed_file and not any(image.size):
        where = "use File > External Data > Find Missing Files"
        return f"the image '{image.name}' that has no pixels (is its file missing? {where})"
    return None
