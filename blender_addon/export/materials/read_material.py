# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender materials as the numbers of `material_model`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import bpy
import numpy as np

from ...probe.graph_copy import GROUP
from ...versions import (
    DIFFUSE,
    PRINCIPLED,
    active_output,
    cycles_settings,
    default_surface_is_principled,
    has_diffuse_roughness,
    node_tree_of,
)
from ..audit.rules import name_settings
from ..audit.shading_table import MATERIAL, MATERIAL_CYCLES
from ..findings import Findings, Fix
from ..images.color_space import to_rec709
from ..images.image_pixels import without_pixels
from ..material_model import Material, Socket, grey
from ..nodes.closure_leaves import UNKNOWN, ClosureLeaf
from ..nodes.displacement import SHADING_NORMAL, bends_normals, displacement_of
from ..nodes.graph_findings import graph_problem, note_missing_pictures
from ..nodes.leaf_kinds import (
    EMISSION,
    KINDS,
    TRANSPARENT,
    UNUSED_SOCKETS,
    WITHOUT_SPECULAR,
    inputs_of,
    only_nearest,
    sockets_of,
)
from ..nodes.shader_graph import (
    UnsupportedNodeError,
    plain_value,
    read_socket,
    source_of,
    surface_of,
)
from ..nodes.target_shader import (
    DIRECTIONS,
    Place,
    TargetShader,
    fits_all_leaves,
    leaf_name,
    target_shader,
    why_no_target,
)
from .leaf_sockets import conductor_sockets, distribution_of, note_black, other_sockets

SKIPPED_SOCKETS = ("Weight",)
# what Cycles' own default surface sets of a Principled BSDF; everything else has no effect
DEFAULT_SOCKETS = {
    "Base Color": Socket((0.8, 0.8, 0.8)),
    "Metallic": Socket(0.0),
    "Roughness": Socket(0.5),
    "IOR": Socket(1.5),
    "Specular IOR Level": Socket(0.5),
}
# shaders of other objects with a simple equivalent: node -> (our model, {our socket: the node's socket}, constants)
SIMPLE_SHADERS = {
    "ShaderNodeBsdfDiffuse": ("diffuse", {"Base Color": "Color"}, {}),
    "ShaderNodeEmission": ("emission", {"Emission Color": "Color", "Emission Strength": "Strength"}, {}),
    "ShaderNodeBsdfGlossy": ("principled", {"Base Color": "Color", "Roughness": "Roughness"}, {"Metallic": 1.0}),
    "ShaderNodeBsdfAnisotropic": ("principled", {"Base Color": "Color", "Roughness": "Roughness"}, {"Metallic": 1.0}),
    "ShaderNodeBsdfMetallic": ("principled", {"Base Color": "Base Color", "Roughness": "Roughness"}, {"Metallic": 1.0}),
    "ShaderNodeBsdfGlass": (
        "principled",
        {"Base Color": "Color", "Roughness": "Roughness", "IOR": "IOR"},
        {"Transmission Weight": 1.0},
    ),
    "ShaderNodeBsdfTransparent": ("null", {}, {}),
}


def read_target(
    material: bpy.types.Material | None, owner: str, slot: int, findings: Findings, leaf: str | None = None
) -> Material | None:
    """Return the material to fit, or None with an error in `findings`; `leaf` names the one of a mix to fit."""
    if material is None:
        findings.error(f"Slot {slot + 1} of '{owner}' has no material: give it one with a Principled BSDF.",
                       Fix("new_material"))  # fmt: skip
        return None
    target = target_shader(material, leaf)
    if target is None:
        findings.error(why_no_target(material), Fix("principled"))
        return None
    note_volume(material, findings)
    note_missing_pictures(f"Material '{material.name}'", node_tree_of(material), findings)
    shared = target.shared_group([name for name, place in target.places.items() if not place.socket.is_linked])
    if shared is not None:
        findings.note(
            f"The group '{shared.name}' of material '{material.name}' is used elsewhere too: an apply gives the "
            "material a copy of its own."
        )
    found = _read_leaf(material, target, findings)
    found.node, found.labels = tuple(target.path), _labels(inputs_of(target.node))
    if target.is_mixed:
        found.weight = _read_weight(material, target.leaf, findings)
        found.leaves = tuple(_read_held(material, leaf, findings) for leaf in target.others)
        if not fits_all_leaves(material):
            note_leaves(material.name, target, findings)
    displacement = displacement_of(material)
    if displacement is not None:
        _read_displacement(material, displacement, found, findings)
    return found


def _read_displacement(
    material: bpy.types.Material, displacement: bpy.types.NodeSocket, found: Material, findings: Findings
) -> None:
    """Have Cycles tell what a displacement makes of the normals of all that reflects light."""
    problem = graph_problem(displacement, is_copied=True)
    if problem is not None:
        findings.error(f"Displacement of material '{material.name}' is linked to {problem}: mend or unlink it.")
    bent = (found, *found.leaves) if bends_normals(material) else ()
    for leaf in bent:
        if leaf.model == "principled":
            leaf.sockets[SHADING_NORMAL] = Socket([0.0, 0.0, 0.0], True, by_graph=True)


def note_leaves(material: str, target: TargetShader, findings: Findings) -> None:
    """Say which leaf of a mix is fitted, and how the others may be."""
    others = ", ".join(f"'{leaf_name(leaf)}' ({leaf.node.bl_label})" for leaf in target.others)
    if others:
        said = f"Material '{material}' mixes shaders: '{target.name}' is fitted; of {others} what is chosen."
        findings.note(said, explains=False)


def _labels(inputs: Mapping[str, bpy.types.NodeSocket]) -> dict[str, str]:
    """What a node calls its values, where that is not their name in the Principled BSDF."""
    return {name: socket.name for name, socket in inputs.items() if name != socket.name}


def _read_leaf(material: bpy.types.Material, target: TargetShader, findings: Findings) -> Material:
    """The fitted leaf alone."""
    if target.node.bl_idname == PRINCIPLED:
        return _read_fitted(material, target, findings)
    kind, node = target.kind, target.node
    sockets = {name: Socket(value, True) for name, value in kind.held.items()}
    sockets |= {
        name: _read(target.own_name(name), place, material.name, True, findings)
        for name, place in target.places.items()
    }
    sockets |= other_sockets(material.name, node, findings)
    if node.bl_idname == DIFFUSE and not has_diffuse_roughness():
        sockets["Diffuse Roughness"] = _no_roughness(node, material.name, findings)
    if only_nearest(node):
        findings.note(f"Material '{material.name}': {node.bl_label} is fitted as its nearest model.")
    for name in ("Normal", "Tangent"):
        if name in node.inputs:
            place = Place(node.inputs[name], target.groups)
            sockets[name] = _read_direction(name, place, material.name, findings)
    return Material(material.name, "principled", sockets, distribution_of(node), _walks_of(node), shader=kind.shader)


def _read_held(material: bpy.types.Material, leaf: ClosureLeaf, findings: Findings) -> Material:
    """A leaf that is not fitted; one without a model is black."""
    node = leaf.node

    def read(named: Mapping[str, bpy.types.NodeSocket]) -> dict[str, Socket]:
        places = {name: Place(socket, leaf.groups) for name, socket in named.items()}
        return {name: _read_at(node, place, material.name, findings) for name, place in places.items()}

    name, weight = leaf_name(leaf), _read_weight(material, leaf, findings)
    if node.bl_idname == EMISSION:
        named = {"Emission Color": node.inputs["Color"], "Emission Strength": node.inputs["Strength"]}
        return Material(name, "emission", read(named), weight=weight, node=tuple(leaf.path), labels=_labels(named))
    if node.bl_idname == TRANSPARENT:
        named = {"Base Color": node.inputs["Color"]}
        return Material(name, "null", read(named), weight=weight, node=tuple(leaf.path), labels=_labels(named))
    kind = KINDS.get(node.bl_idname)
    if kind is None:
        note_black(material.name, name, node, findings)
        sockets = {key: Socket(value, True) for key, value in {**WITHOUT_SPECULAR, "Base Color": [0.0] * 3}.items()}
        return Material(name, "principled", sockets, weight=weight, node=tuple(leaf.path), is_nearest=True)
    skipped = (*SKIPPED_SOCKETS, *UNUSED_SOCKETS, *DIRECTIONS)
    sockets = {name: Socket(value, True) for name, value in kind.held.items()}
    sockets |= read({name: socket for name, socket in inputs_of(node).items() if name not in skipped})
    sockets |= other_sockets(material.name, node, findings)
    if node.bl_idname == DIFFUSE and not has_diffuse_roughness():
        sockets["Diffuse Roughness"] = _no_roughness(node, material.name, findings)
    for direction in DIRECTIONS:
        if direction in node.inputs:
            place = Place(node.inputs[direction], leaf.groups)
            sockets[direction] = _read_direction(direction, place, material.name, findings)
    if only_nearest(node):
        findings.note(f"Material '{material.name}': '{name}' ({node.bl_label}) is held as its nearest model.")
    return Material(
        name, "principled", sockets, distribution_of(node), _walks_of(node), shader=kind.shader, weight=weight,
        node=tuple(leaf.path), labels=_labels(inputs_of(node)), is_nearest=only_nearest(node),
    )  # fmt: skip


def _read_at(node: bpy.types.Node, place: Place, material: str, findings: Findings) -> Socket:
    """A socket of a held leaf; pictures whose place the backend would not find are Cycles' to evaluate."""
    found = _read(f"{place.socket.name} of '{node.name}'", place, material, True, findings)
    if found.texture is None or found.texture.is_plain:
        return found
    return Socket(plain_value(place.socket), True, by_graph=True)


def _read_weight(material: bpy.types.Material, leaf: ClosureLeaf, findings: Findings) -> Socket:
    """The share of a leaf: a number, the picture of the one factor that has one, or what Cycles evaluates."""
    linked = [factor for way in leaf.ways for factor in way if factor.value is None]
    for factor in linked:
        _refuse("Factor", Place(factor.socket, factor.groups), material.name, findings, is_copied=True)
    if not linked:
        return Socket(leaf.share, leaf.share != 1.0)
    if len(linked) == 1 and len(leaf.ways) == 1:
        try:
            read = read_socket(linked[0].socket)
        except UnsupportedNodeError:
            read = Socket(UNKNOWN, True)
        if read.texture is not None and read.texture.is_plain:
            rest = leaf.share / UNKNOWN
            pixels = np.clip(read.texture.pixels, 0.0, 1.0)
            pixels = np.float32(rest) * (pixels if linked[0].second else 1.0 - pixels)
            return Socket(float(pixels.mean()), True, replace(read.texture, pixels=pixels))
    return Socket(leaf.share, True, by_graph=True)


def _no_roughness(node: bpy.types.Node, material: str, findings: Findings) -> Socket:
    rough = node.inputs["Roughness"]
    if rough.is_linked or plain_value(rough) > 0.0:
        findings.note(f"Material '{material}': Roughness of a Diffuse BSDF is taken for 0 in this Blender.")
    return Socket(0.0, True)


def _read_fitted(material: bpy.types.Material, target: TargetShader, findings: Findings) -> Material:
    sockets = {}
    for name, place in target.places.items():
        if name in DIRECTIONS:
            sockets[name] = _read_direction(name, place, material.name, findings)
        elif name not in SKIPPED_SOCKETS:
            sockets[name] = _read(name, place, material.name, name not in UNUSED_SOCKETS, findings)
    found = Material(material.name, "principled", sockets, target.node.distribution, _walks_of(target.node))
    found.transparent_shadows = material.use_transparent_shadow
    _note_default_tangent(found, findings)
    return found


def _walks_of(node: bpy.types.Node) -> str:
    """How light goes below the surface of a shader node, by the Principled BSDF's words."""
    return getattr(node, "subsurface_method", None) or getattr(node, "falloff", "RANDOM_WALK")


def _read_direction(name: str, place: Place, material: str, findings: Findings) -> Socket:
    """What is linked to Normal, Coat Normal or Tangent of the target; Cycles evaluates it."""
    socket, source = place.socket, source_of(place.socket)
    by_graph = source is not None and not (name == "Tangent" and _is_uv_tangent(source.node))
    if by_graph:
        _refuse(name, place, material, findings, is_copied=True)
    turned = by_graph and _maker(source).bl_idname == "ShaderNodeNormalMap"
    return Socket(plain_value(socket), source is not None, by_graph=by_graph, turned=turned)


def _maker(source: bpy.types.NodeSocket) -> bpy.types.Node:
    """The node that makes what an output gives, inside of groups where it is a group's."""
    node = source.node
    if node.bl_idname != GROUP or node.node_tree is None:
        return node
    end = next((n for n in node.node_tree.nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output), None)
    inner = None if end is None else source_of(end.inputs[source.identifier])
    return node if inner is None or inner.node.bl_idname == "NodeGroupInput" else _maker(inner)


def read_context(material: bpy.types.Material | None, owner: str, findings: Findings) -> Material:
    """Return the material of something that is not fitted; what is unknown becomes grey, with a note."""
    if material is None:
        name = f"{owner} without material"
        return Material(name, "principled", dict(DEFAULT_SOCKETS)) if default_surface_is_principled() else grey(name)
    tree = node_tree_of(material)
    if tree is None:
        color = [float(value) for value in to_rec709(list(material.diffuse_color)[:3])]
        return Material(material.name, "diffuse", {"Base Color": Socket(color)})
    note_volume(material, findings)
    node = surface_of(tree)
    if node is None:
        return Material(material.name, "diffuse", {"Base Color": Socket((0.0, 0.0, 0.0))})
    if node.bl_idname == PRINCIPLED:
        return _read_principled(material, node, findings)
    if node.bl_idname not in SIMPLE_SHADERS:
        findings.note(
            f"Material '{material.name}' of '{owner}' starts with the node '{node.name}' ({node.bl_label}), which is "
            "not exported; it is shown as grey."
        )
        return grey(material.name)
    model, renamed, constants = SIMPLE_SHADERS[node.bl_idname]
    sockets = {name: Socket(value) for name, value in constants.items()}
    for name, theirs in renamed.items():
        sockets[name] = _read(theirs, Place(sockets_of(node)[theirs], ()), material.name, False, findings)
    sockets |= conductor_sockets(node)
    if model == "null" and list(node.inputs["Color"].default_value)[:3] != [1.0, 1.0, 1.0]:
        findings.note(f"Material '{material.name}': {node.bl_label} is taken for white.")
    if model == "principled" or (model == "diffuse" and node.inputs["Roughness"].default_value > 0.0):
        findings.note(f"Material '{material.name}': {node.bl_label} is approximated by its closest simple equivalent.")
    return Material(material.name, model, sockets)


def needs_bake(material: bpy.types.Material | None) -> bool:
    """Whether a material holds more than the simple equivalents of `read_context` can say; looks at no pixel."""
    node = surface_of(node_tree_of(material)) if material is not None else None
    if node is None:
        return False
    if bends_normals(material) or (node.bl_idname != PRINCIPLED and node.bl_idname not in SIMPLE_SHADERS):
        return True
    names = SIMPLE_SHADERS[node.bl_idname][1].values() if node.bl_idname != PRINCIPLED else None
    with without_pixels():
        for socket in node.inputs:
            if socket.name in DIRECTIONS:
                if socket.name == "Normal" and source_of(socket) is not None:
                    return True
            elif names is None or socket.name in names:
                try:
                    read_socket(socket)
                except UnsupportedNodeError:
                    return True
    return False


def _read_principled(material: bpy.types.Material, node: bpy.types.Node, findings: Findings) -> Material:
    """A Principled BSDF that is not fitted."""
    sockets: dict[str, Socket] = {}
    for socket in node.inputs:
        if socket.name in SKIPPED_SOCKETS:
            continue
        if socket.name in DIRECTIONS:
            source = source_of(socket)
            sockets[socket.name] = Socket(plain_value(socket), source is not None)
            if source is not None and not (socket.name == "Tangent" and _is_uv_tangent(source.node)):
                findings.note(f"Material '{material.name}': what is linked to {socket.name} is left out.")
            continue
        sockets[socket.name] = _read(socket.name, Place(socket, ()), material.name, False, findings)
    found = Material(material.name, "principled", sockets, node.distribution, _walks_of(node))
    found.transparent_shadows = material.use_transparent_shadow
    _note_default_tangent(found, findings)
    return found


def _note_default_tangent(material: Material, findings: Findings) -> None:
    """Without a link Blender's tangent circles the object's Z axis, and that of the fit follows the UV map."""
    if not material.sockets["Tangent"].linked and material.value("Anisotropic", 0.0) != 0.0:
        findings.note(
            f"Material '{material.name}': Tangent has no link, so that Cycles turns the anisotropy about the object's "
            "Z axis, and the fit along the UV map: link a Tangent node of direction UV Map."
        )


def _is_uv_tangent(node: bpy.types.Node) -> bool:
    """Whether a node gives the tangent of the object's active UV map."""
    return node.bl_idname == "ShaderNodeTangent" and node.direction_type == "UV_MAP" and not node.uv_map


def _read(name: str, place: Place, material: str, is_target: bool, findings: Findings) -> Socket:
    try:
        read = read_socket(place.socket)
        if is_target:
            _refuse(name, place, material, findings, is_copied=False)
            if place.socket.is_linked and not read.linked:  # by a link that Cycles leaves out: nothing is written here
                return replace(read, linked=True)
        return read
    except UnsupportedNodeError as problem:
        if is_target:
            _refuse(name, place, material, findings, is_copied=True)
        else:
            findings.note(
                f"{name} of material '{material}' is linked to {problem}, which cannot be exported; the "
                "socket's own value is used."
            )
        return Socket(plain_value(place.socket), True, by_graph=is_target)


def _refuse(name: str, place: Place, material: str, findings: Findings, *, is_copied: bool) -> None:
    """An error where Cycles could not evaluate what feeds a socket of the target."""
    problem = graph_problem(place.socket, groups=place.groups, is_copied=is_copied)
    if problem is not None:
        findings.error(
            f"{name} of material '{material}' is linked to {problem}: mend or unlink it.",
            Fix("unlink", name),
        )


def note_volume(material: bpy.types.Material, findings: Findings) -> None:
    """Name what lies below a surface, which is not exported."""
    name_settings(MATERIAL, material, material.name, findings)
    name_settings(MATERIAL_CYCLES, cycles_settings(material), material.name, findings)
    output = active_output(node_tree_of(material))
    if output is None:
        return
    if source_of(output.inputs["Volume"]) is not None:
        findings.note(f"Material '{material.name}': its volume is left out.")
