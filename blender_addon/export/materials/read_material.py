# SPDX-License-Identifier: GPL-3.0-or-later
"""The material that is fitted, as the numbers of `material_model`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import bpy
import numpy as np

from ...graph_values.mix_values import why_no_mix_values
from ...probe.light_path import OF_CAMERA, OF_SHADOW, light_path_outputs
from ...versions import PRINCIPLED, cycles_settings, node_tree_of
from ..audit.rules import name_settings
from ..audit.shading_table import MATERIAL, MATERIAL_CYCLES
from ..findings import Findings, Fix
from ..material_model import SHADING_NORMAL, Material, Socket
from ..nodes.backs import is_displaced_hollow, turns_on_backs
from ..nodes.closure_leaves import OUTPUT, UNKNOWN, ClosureLeaf
from ..nodes.dependence import OF_SIDE, asked_for, asked_of_side
from ..nodes.displacement import bends_normals, displacement_of
from ..nodes.graph_findings import graph_problem, note_few_samples, note_missing_pictures, note_pixel_sizes
from ..nodes.leaf_kinds import (
    EMISSION,
    TRANSPARENT,
    UNUSED_SOCKETS,
    WITHOUT_SPECULAR,
    distribution_of,
    inputs_of,
    is_shader,
    kind_of,
    only_nearest,
    walks_of,
)
from ..nodes.shader_graph import UnsupportedNodeError, plain_value, read_socket, source_of
from ..nodes.target_shader import (
    DIRECTIONS,
    Place,
    TargetShader,
    fits_all_leaves,
    leaf_name,
    target_shader,
    why_no_target,
)
from ..nodes.volumes import COLOR, DENSITY, absorbing_volume, has_volume
from .leaf_sockets import is_uv_tangent, note_black, other_sockets, read_value, refuse_link

SKIPPED_SOCKETS = ("Weight",)


def read_target(
    material: bpy.types.Material | None, owner: str, slot: int, findings: Findings, leaf: str | None = None
) -> Material | None:
    """Return the material to fit, or None with an error in `findings`; `leaf` names the one of a mix to fit."""
    if material is None:
        if shown := _set_by_nodes(owner):
            findings.error(f"Slot {slot + 1} of '{owner}' has no material: put '{shown}' there, which its nodes set.")
        else:
            findings.error(f"Slot {slot + 1} of '{owner}' has no material: give it one with a Principled BSDF.",
                           Fix("new_material"))  # fmt: skip
        return None
    target = target_shader(material, leaf)
    if target is None:
        findings.error(why_no_target(material), Fix("principled"))
        return None
    name_material_settings(material, findings)
    note_missing_pictures(f"Material '{material.name}'", node_tree_of(material), findings)
    note_pixel_sizes(f"Material '{material.name}'", node_tree_of(material), findings)
    note_few_samples(material.name, node_tree_of(material), findings)
    shared = target.shared_group([name for name, place in target.places.items() if not place.socket.is_linked])
    if shared is not None:
        findings.note(
            f"The group '{shared.name}' of material '{material.name}' is used elsewhere too: an apply gives the "
            "material a copy of its own."
        )
    found = with_default_tangent(_read_leaf(material, target, findings))
    found.node, found.labels = tuple(target.path), _labels(inputs_of(target.node))
    if target.is_mixed:
        found.weight = _read_weight(material, target.leaf, findings)
        found.leaves = tuple(with_default_tangent(_read_held(material, leaf, findings)) for leaf in target.others)
        if not fits_all_leaves(material):
            note_leaves(material.name, target, findings)
    displacement = displacement_of(material)
    if displacement is not None:
        _read_displacement(material, displacement, found, findings)
    _note_rays(material, found.passes_light, findings)
    inside = volume_sockets(material, found, findings) if found.passes_light else {}
    held = {name: replace(socket, linked=True) for name, socket in inside.items() if name not in target.places}
    return replace(found, sockets=found.sockets | inside | held)


def _note_rays(material: bpy.types.Material, passes_light: bool, findings: Findings) -> None:
    """Name nodes that answer rays which are not the camera's in another way than the fit has them."""
    tree = node_tree_of(material)
    if tree is None:
        return
    if passes_light:
        asked = asked_of_side(tree)
        if asked:
            findings.note(
                f"Material '{material.name}' lets light through, and {', '.join(asked)} tell its sides or rays apart: "
                "its shadow and its inside are not as in Cycles."
            )
        return
    paths = sorted(light_path_outputs(tree).difference(OF_CAMERA, OF_SHADOW))
    if paths:
        asked = ", ".join(paths)
        findings.note(f"Material '{material.name}' asks Light Path for {asked}: bounces have it as diffuse rays do.")
    if asked_for(tree, OF_SIDE):
        findings.note(f"Material '{material.name}' asks for Backfacing: bounces have one answer for both sides.")


def _read_displacement(
    material: bpy.types.Material, displacement: bpy.types.NodeSocket, found: Material, findings: Findings
) -> None:
    """Have Cycles tell what a displacement makes of the normals of all that reflects light."""
    problem = graph_problem(displacement, is_copied=True)
    if problem is not None:
        findings.error(f"Displacement of material '{material.name}' is linked to {problem}: mend or unlink it.")
    bent, turned = (found, *found.leaves) if bends_normals(material) else (), is_displaced_hollow(material)
    for leaf in bent:
        if leaf.model == "principled":
            leaf.sockets[SHADING_NORMAL] = Socket([0.0, 0.0, 0.0], True, by_graph=True, turned=turned)


def note_leaves(material: str, target: TargetShader, findings: Findings) -> None:
    """Say which leaf of a mix is fitted, and how the others may be."""
    others = ", ".join(f"'{leaf_name(leaf)}' ({leaf.node.bl_label})" for leaf in target.others)
    if not others:
        return
    said = f"Material '{material}' mixes shaders: '{target.name}' is fitted; of {others} what is chosen."
    problem = why_no_mix_values(target)
    if problem is not None:
        said = f"Material '{material}' mixes shaders: '{target.name}' is fitted; {others} is held, for {problem}."
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
        name: read_value(target.own_name(name), place, material.name, True, findings)
        for name, place in target.places.items()
    }
    sockets |= other_sockets(material.name, node, findings)
    if only_nearest(node):
        findings.note(f"Material '{material.name}': {node.bl_label} is fitted as its nearest model.")
    for name in ("Normal", "Tangent"):
        if name in node.inputs:
            place = Place(node.inputs[name], target.groups)
            sockets[name] = _read_direction(name, place, material.name, findings)
    return Material(material.name, "principled", sockets, distribution_of(node), walks_of(node), shader=kind.shader)


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
    if not is_shader(node):
        return _read_colour(material, leaf, weight, findings)
    kind = kind_of(node)
    if kind is None:
        note_black(material.name, name, node, findings)
        sockets = {key: Socket(value, True) for key, value in {**WITHOUT_SPECULAR, "Base Color": [0.0] * 3}.items()}
        return Material(name, "principled", sockets, weight=weight, node=tuple(leaf.path), is_nearest=True)
    skipped = (*SKIPPED_SOCKETS, *UNUSED_SOCKETS, *DIRECTIONS)
    sockets = {name: Socket(value, True) for name, value in kind.held.items()}
    sockets |= read({name: socket for name, socket in inputs_of(node).items() if name not in skipped})
    sockets |= other_sockets(material.name, node, findings)
    for direction in DIRECTIONS:
        if direction in node.inputs:
            place = Place(node.inputs[direction], leaf.groups)
            sockets[direction] = _read_direction(direction, place, material.name, findings)
    if only_nearest(node):
        findings.note(f"Material '{material.name}': '{name}' ({node.bl_label}) is held as its nearest model.")
    return Material(
        name, "principled", sockets, distribution_of(node), walks_of(node), shader=kind.shader, weight=weight,
        node=tuple(leaf.path), labels=_labels(inputs_of(node)), is_nearest=only_nearest(node),
    )  # fmt: skip


def _read_colour(material: bpy.types.Material, leaf: ClosureLeaf, weight: Socket, findings: Findings) -> Material:
    """A colour in the place of a shader, which shines (ShaderGraph::connect); Cycles evaluates it."""
    for socket in leaf.node.inputs:
        refuse_link(socket.name, Place(socket, leaf.groups), material.name, findings, is_copied=True)
    sockets = {"Emission Color": Socket([1.0, 1.0, 1.0], True, by_graph=True), "Emission Strength": Socket(1.0, True)}
    labels = {"Emission Color": f"{OUTPUT}{leaf.output}"}
    return Material(leaf_name(leaf), "emission", sockets, weight=weight, node=tuple(leaf.path), labels=labels)


def _read_at(node: bpy.types.Node, place: Place, material: str, findings: Findings) -> Socket:
    """A socket of a held leaf; pictures whose place the backend would not find are Cycles' to evaluate."""
    found = read_value(f"{place.socket.name} of '{node.name}'", place, material, True, findings)
    if found.texture is None or found.texture.is_plain:
        return found
    return Socket(plain_value(place.socket), True, by_graph=True)


def _read_weight(material: bpy.types.Material, leaf: ClosureLeaf, findings: Findings) -> Socket:
    """The share of a leaf: a number, the picture of the one factor that has one, or what Cycles evaluates."""
    linked = [factor for way in leaf.ways for factor in way if factor.value is None]
    for factor in linked:
        refuse_link("Factor", Place(factor.socket, factor.groups), material.name, findings, is_copied=True)
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


def _read_fitted(material: bpy.types.Material, target: TargetShader, findings: Findings) -> Material:
    sockets = {}
    for name, place in target.places.items():
        if name in DIRECTIONS:
            sockets[name] = _read_direction(name, place, material.name, findings)
        elif name not in SKIPPED_SOCKETS:
            sockets[name] = read_value(name, place, material.name, name not in UNUSED_SOCKETS, findings)
    found = Material(material.name, "principled", sockets, target.node.distribution, walks_of(target.node))
    found.transparent_shadows = material.use_transparent_shadow
    return found


def _set_by_nodes(owner: str) -> str:
    """A material that Geometry Nodes of an object set, by name; empty without one.

    What is in a slot as well is found on their faces, too.
    """
    modifiers = bpy.data.objects[owner].modifiers if owner in bpy.data.objects else ()
    todo = [each.node_group for each in modifiers if each.type == "NODES" and each.node_group is not None]
    seen: set[str] = set()
    while todo:
        tree = todo.pop()
        if tree.name_full in seen:
            continue
        seen.add(tree.name_full)
        for node in tree.nodes:
            inner, material = getattr(node, "node_tree", None), node.inputs.get("Material")
            todo += [inner] if inner is not None else []
            if node.bl_idname == "GeometryNodeSetMaterial" and material.default_value is not None:
                return material.default_value.name
    return ""


def with_default_tangent(material: Material, *, is_fitted: bool = False) -> Material:
    """The target's leaf, whose Tangent circles the object's Z axis where it has no link and highlights turn along it.

    The mesh holds it, or Cycles evaluates it. `is_fitted` says that a fit changes the anisotropy, which may be zero.
    What a mesh holds is told in any case, for a fit may begin again from a brushed surface.
    """
    tangent, amount = (material.sockets.get(name) for name in ("Tangent", "Anisotropic"))
    if tangent is None or tangent.linked or amount is None:
        return material
    by_mesh, turns = bool(material.circling), bool(is_fitted or amount.varies or amount.value)
    if not (by_mesh or turns):
        return material
    given = replace(tangent, by_graph=turns and not by_mesh, by_mesh=by_mesh, linked=turns)
    return replace(material, sockets=material.sockets | {"Tangent": given})


def with_circling_tangents(material: Material, axis: str) -> Material:
    """The target's material, whose tangents circle an axis of its object: meshes hold them, and no graph does."""
    tangent = material.sockets.get("Tangent")
    given = {"Tangent": replace(tangent, by_graph=False, by_mesh=True)} if tangent and tangent.by_graph else {}
    leaves = tuple(with_circling_tangents(leaf, axis) for leaf in material.leaves)
    return replace(material, sockets=material.sockets | given, leaves=leaves, circling=axis)


def _read_direction(name: str, place: Place, material: str, findings: Findings) -> Socket:
    """What is linked to Normal, Coat Normal or Tangent of the target; Cycles evaluates it."""
    socket, source = place.socket, source_of(place.socket)
    by_graph = source is not None and not (name == "Tangent" and is_uv_tangent(source.node))
    if by_graph:
        refuse_link(name, place, material, findings, is_copied=True)
    turned = by_graph and turns_on_backs(source)
    return Socket(plain_value(socket), source is not None, by_graph=by_graph, turned=turned)


def name_material_settings(material: bpy.types.Material, findings: Findings) -> None:
    """Name settings of a material that are not exported."""
    name_settings(MATERIAL, material, material.name, findings)
    name_settings(MATERIAL_CYCLES, cycles_settings(material), material.name, findings)


def volume_sockets(material: bpy.types.Material, surface: Material, findings: Findings) -> dict[str, Socket]:
    """What a volume absorbs inside of a surface that light gets through; one that the fit does not have is named."""
    if not has_volume(material):
        return {}
    found = absorbing_volume(material)
    if found is None or surface.model != "principled":
        findings.note(f"Material '{material.name}': its volume is left out.")
        return {}
    return {DENSITY: Socket(found.density), COLOR: Socket(found.color)}
