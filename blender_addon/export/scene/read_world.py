# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's world as the numbers of `world_model`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import bpy
import numpy as np
from numpy.typing import NDArray

from ...versions import active_output, cycles_settings, node_tree_of
from ..audit.object_table import WORLD_CYCLES, WORLD_VISIBILITY
from ..audit.rules import name_settings
from ..findings import Findings
from ..images.color_space import to_rec709
from ..images.image_filter import equirectangular_pixels
from ..images.image_pixels import UnreadableImageError
from ..lights.negative_light import refuse_negative
from ..nodes.dependence import turns_with_camera
from ..nodes.shader_graph import (
    UnsupportedNodeError,
    group_of_output,
    has_texture_mapping,
    mapping_matrix,
    read_socket,
    source_of,
    surface_of,
)
from .world_model import World, resample

if TYPE_CHECKING:
    from .scene_bakes import SceneBakes

BLACK = World(np.zeros(3))
UNKNOWN = World(np.ones(3))  # stands in for a world that nobody has rendered yet


def read_world(scene: bpy.types.Scene, exposure: float, findings: Findings, bakes: SceneBakes | None = None) -> World:
    """Return the world's radiance times `exposure`.

    One of other nodes than a colour or an Environment Texture is asked of `bakes`, which put it into the scene when
    they are finished; without them something stands in for it.
    """
    world = scene.world
    if world is None:
        return BLACK
    name_settings(WORLD_CYCLES, cycles_settings(world), world.name, findings)
    name_settings(WORLD_VISIBILITY, getattr(world, "cycles_visibility", None), world.name, findings)
    tree = node_tree_of(world)
    if tree is None:
        return World(to_rec709(list(world.color)) * exposure)
    output = active_output(tree)
    if output is not None and source_of(output.inputs["Volume"]) is not None:
        findings.note(f"World '{world.name}': its volume is left out.")
    node = surface_of(tree)
    if node is None:
        group = group_of_output(tree)
        if group is not None:
            findings.note(
                f"World '{world.name}' has its output inside the group '{group}', where only Cycles looks for it: it "
                "is black in the fit. Move the output out of the group."
            )
        return BLACK
    visibility = getattr(world, "cycles_visibility", None)
    camera = visibility is None or visibility.camera
    try:
        return replace(_background(node, exposure, world.name, findings), camera=camera)
    except UnsupportedNodeError as problem:
        findings.note(f"World '{world.name}' uses {problem}: Cycles renders it into a panorama for the fit.")
        turning = turns_with_camera(tree)
        if turning:
            findings.note(
                f"World '{world.name}': {', '.join(turning)} follows the camera; in the fit it follows the camera that "
                "renders the panorama, so the world is another one than in Cycles."
            )
        if bakes is not None:
            bakes.ask_world(world, findings)
        return replace(UNKNOWN, camera=camera)


def _background(node: bpy.types.Node, exposure: float, name: str, findings: Findings) -> World:
    if node.bl_idname not in ("ShaderNodeBackground", "ShaderNodeEmission"):
        raise UnsupportedNodeError(f"the node '{node.name}' ({node.bl_label})")
    strength = read_socket(node.inputs["Strength"])
    if strength.texture is not None:
        raise UnsupportedNodeError("a picture on Strength")
    refuse_negative(name, np.array([float(strength.value)]), findings)
    scale = max(float(strength.value), 0.0) * exposure
    source = source_of(node.inputs["Color"])
    if source is not None and source.node.bl_idname == "ShaderNodeTexEnvironment":
        pixels, lookup = _environment(source.node)
        refuse_negative(name, pixels, findings)
        return World(np.full(3, scale), pixels.clip(0.0), lookup)
    color = read_socket(node.inputs["Color"])
    if color.texture is not None:
        raise UnsupportedNodeError("an Image Texture instead of an Environment Texture")
    constant = np.asarray(color.value, dtype=np.float64)
    refuse_negative(name, constant, findings)
    return World(constant.clip(0.0) * scale)


def _environment(node: bpy.types.Node) -> tuple[NDArray[np.float32], NDArray[np.float64] | None]:
    if node.image is None:
        raise UnsupportedNodeError(f"the node '{node.name}' without an image")
    if node.projection != "EQUIRECTANGULAR":
        raise UnsupportedNodeError(f"the node '{node.name}' with mirror ball projection")
    if has_texture_mapping(node):
        raise UnsupportedNodeError(f"the texture mapping inside the node '{node.name}'")
    try:
        pixels = equirectangular_pixels(node.image, node.interpolation)
    except UnreadableImageError as problem:
        raise UnsupportedNodeError(f"the image '{node.image.name}' that {problem}") from None
    source = source_of(node.inputs["Vector"])
    matrix = np.eye(4)
    if source is not None and source.node.bl_idname == "ShaderNodeMapping":
        matrix = mapping_matrix(source.node)
        vector = source.node.inputs["Vector"]
        source = source_of(vector)
        if source is None:
            raise UnsupportedNodeError(f"the Mapping node '{vector.node.name}' without a texture coordinate")
    if source is not None and (source.node.bl_idname, source.name) not in (
        ("ShaderNodeTexCoord", "Generated"),
        ("ShaderNodeNewGeometry", "Position"),
    ):
        raise UnsupportedNodeError(f"the coordinate '{source.name}' of the node '{source.node.name}'")
    lookup, offset = matrix[:3, :3], matrix[:3, 3]
    if np.allclose(lookup @ lookup.T, np.eye(3), atol=1e-6) and np.linalg.det(lookup) > 0.0 and not offset.any():
        return pixels, lookup
    return resample(pixels, lookup, offset), None
