# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials of what is not fitted: other objects, and other slots of the target."""

from __future__ import annotations

from dataclasses import replace

import bpy

from ...versions import DIFFUSE, PRINCIPLED, default_surface_is_principled, node_tree_of
from ..findings import Findings
from ..images.color_space import to_rec709
from ..images.image_pixels import without_pixels
from ..material_model import Material, Socket, grey
from ..nodes.circling import turned_axis, turns_highlights
from ..nodes.displacement import bends_normals
from ..nodes.leaf_kinds import (
    EMISSION,
    KINDS,
    TRANSPARENT,
    distribution_of,
    inputs_of,
    kind_of,
    only_nearest,
    walks_of,
)
from ..nodes.shader_graph import UnsupportedNodeError, group_of_output, plain_value, read_socket, source_of, surface_of
from ..nodes.target_shader import DIRECTIONS, Place
from ..nodes.volumes import has_volume
from .leaf_sockets import is_uv_tangent, other_sockets, read_value
from .read_material import SKIPPED_SOCKETS, name_material_settings, volume_sockets

# what Cycles' own default surface sets of a Principled BSDF; everything else has no effect
DEFAULT_SOCKETS = {
    "Base Color": Socket((0.8, 0.8, 0.8)),
    "Metallic": Socket(0.0),
    "Roughness": Socket(0.5),
    "IOR": Socket(1.5),
    "Specular IOR Level": Socket(0.5),
}


def read_context(material: bpy.types.Material | None, owner: str, findings: Findings) -> Material:
    """Return the material of something that is not fitted; what is unknown becomes grey, with a note."""
    if material is None:
        name = f"{owner} without material"
        return Material(name, "principled", dict(DEFAULT_SOCKETS)) if default_surface_is_principled() else grey(name)
    tree = node_tree_of(material)
    if tree is None:
        color = [float(value) for value in to_rec709(list(material.diffuse_color)[:3])]
        return Material(material.name, "diffuse", {"Base Color": Socket(color)})
    name_material_settings(material, findings)
    found = _read_surface(material, tree, owner, findings)
    inside = volume_sockets(material, found, findings) if found.passes_light else {}
    return replace(found, sockets=found.sockets | inside)


def _read_surface(material: bpy.types.Material, tree: bpy.types.NodeTree, owner: str, findings: Findings) -> Material:
    """The shader at the output's Surface. Without one a volume has nothing around it, and all else is black."""
    node = surface_of(tree)
    if node is None:
        black = Material(material.name, "diffuse", {"Base Color": Socket((0.0, 0.0, 0.0))})
        group = group_of_output(tree)
        if group is not None:
            findings.note(
                f"Material '{material.name}' has its output inside the group '{group}', where only Cycles looks for "
                "it: it is black in the fit. Move the output out of the group."
            )
        return Material(material.name, "null") if has_volume(material) else black
    if node.bl_idname == PRINCIPLED:
        return _read_principled(material, node, findings)
    if node.bl_idname == TRANSPARENT:
        color = node.inputs["Color"]
        if color.is_linked or list(color.default_value)[:3] != [1.0, 1.0, 1.0]:
            findings.note(f"Material '{material.name}': {node.bl_label} is taken for white.")
        return Material(material.name, "null")
    named = _context_inputs(node)
    if named is None:
        findings.note(
            f"Material '{material.name}' of '{owner}' starts with the node '{node.name}' ({node.bl_label}), which is "
            "not exported; it is shown as grey."
        )
        return grey(material.name)
    places = {name: Place(socket, ()) for name, socket in named.items()}
    sockets = {n: read_value(at.socket.name, at, material.name, False, findings) for n, at in places.items()}
    if node.bl_idname == EMISSION:
        return Material(material.name, "emission", sockets)
    return _read_other(material, node, sockets, findings)


def _context_inputs(node: bpy.types.Node) -> dict[str, bpy.types.NodeSocket] | None:
    """The sockets of a shader that is not fitted by the names of their values; None where it has no model."""
    if node.bl_idname == EMISSION:
        return {"Emission Color": node.inputs["Color"], "Emission Strength": node.inputs["Strength"]}
    if node.bl_idname == TRANSPARENT:
        return {}
    if node.bl_idname not in KINDS:
        return None
    return {name: socket for name, socket in inputs_of(node).items() if name not in DIRECTIONS}


def _read_other(
    material: bpy.types.Material, node: bpy.types.Node, sockets: dict[str, Socket], findings: Findings
) -> Material:
    """A shader of `KINDS` that is not fitted, from the values of its sockets."""
    sockets |= other_sockets(material.name, node, findings)
    rough = sockets.get("Diffuse Roughness", Socket(0.0))
    if node.bl_idname == DIFFUSE and not (rough.varies or rough.value):
        return Material(material.name, "diffuse", {"Base Color": sockets["Base Color"]})
    kind = kind_of(node)
    assert kind is not None  # `_context_inputs` has none of others
    if only_nearest(node):
        findings.note(f"Material '{material.name}': {node.bl_label} is approximated by its nearest model.")
    sockets = {name: Socket(value) for name, value in kind.held.items()} | sockets
    found = Material(
        material.name, "principled", sockets, distribution_of(node), walks_of(node), shader=kind.shader,
        transparent_shadows=material.use_transparent_shadow,
    )  # fmt: skip
    return replace(found, sockets=found.sockets | _directions(material, node, findings))


def needs_bake(material: bpy.types.Material | None) -> bool:
    """Whether a material holds more than the simple equivalents of `read_context` can say; looks at no pixel."""
    node = surface_of(node_tree_of(material)) if material is not None else None
    if node is None:
        return False
    named = _context_inputs(node)
    if bends_normals(material) or named is None:
        return True
    names = {socket.name for socket in named.values()}
    with without_pixels():
        for socket in node.inputs:
            if socket.name in DIRECTIONS:
                if socket.name == "Normal" and source_of(socket) is not None:
                    return True
            elif socket.name in names:
                try:
                    read_socket(socket)
                except UnsupportedNodeError:
                    return True
    return False


def _read_principled(material: bpy.types.Material, node: bpy.types.Node, findings: Findings) -> Material:
    """A Principled BSDF that is not fitted."""
    sockets: dict[str, Socket] = {}
    for socket in node.inputs:
        if socket.name in (*SKIPPED_SOCKETS, *DIRECTIONS):
            continue
        sockets[socket.name] = read_value(socket.name, Place(socket, ()), material.name, False, findings)
    found = Material(material.name, "principled", sockets, node.distribution, walks_of(node))
    found.transparent_shadows = material.use_transparent_shadow
    return replace(found, sockets=found.sockets | _directions(material, node, findings))


def _directions(material: bpy.types.Material, node: bpy.types.Node, findings: Findings) -> dict[str, Socket]:
    """The directions of a shader, of which the mesh may hold the tangent; others that are linked are named."""
    by_mesh = bool(turned_axis(material))
    found = {}
    for socket in (node.inputs[name] for name in DIRECTIONS if name in node.inputs):
        source, is_tangent = source_of(socket), socket.name == "Tangent"
        found[socket.name] = Socket(plain_value(socket), source is not None, by_mesh=is_tangent and by_mesh)
        if source is None or (is_tangent and (by_mesh or is_uv_tangent(source.node) or not turns_highlights(node))):
            continue
        findings.note(f"Material '{material.name}': what is linked to {socket.name} is left out.")
    return found
