# SPDX-License-Identifier: Apache-2.0
"""The series *bumps*: bumps, normal maps and displacements on a material that is plain but for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .materials import Build

WIDTH = 128  # pixels along each side of the normal maps


def _bump(tree: Any, node: Any, height: Any, strength: float, distance: float, *, invert: bool = False) -> Any:
    bump = tree.nodes.new("ShaderNodeBump")
    bump.inputs["Strength"].default_value, bump.inputs["Distance"].default_value = strength, distance
    bump.invert = invert
    tree.links.new(height, bump.inputs["Height"])
    tree.links.new(bump.outputs["Normal"], node.inputs["Normal"])
    return bump


def _texture(tree: Any, kind: str, scale: float, *, coordinates: str = "") -> Any:
    node = tree.nodes.new(f"ShaderNodeTex{kind}")
    node.inputs["Scale"].default_value = scale
    if coordinates:
        tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs[coordinates], node.inputs["Vector"])
    return node


def _height(kind: str, scale: float, strength: float, distance: float, *, at: str = "", invert: bool = False) -> Build:
    def build(tree: Any, node: Any) -> None:
        texture = _texture(tree, kind, scale, coordinates=at)
        height = next(texture.outputs[n] for n in ("Fac", "Factor", "Distance") if n in texture.outputs)
        _bump(tree, node, height, strength, distance, invert=invert)

    return build


def _normal_map(space: str, strength: float, size: float) -> Build:
    """A picture of smooth waves of about this slope, as a Normal Map; about +Z for a tangent space, else any side."""

    def build(tree: Any, node: Any) -> None:
        texture = tree.nodes.new("ShaderNodeTexImage")
        texture.image = _waves(size)
        normal = tree.nodes.new("ShaderNodeNormalMap")
        normal.space = space
        normal.inputs["Strength"].default_value = strength
        tree.links.new(texture.outputs["Color"], normal.inputs["Color"])
        tree.links.new(normal.outputs["Normal"], node.inputs["Normal"])

    return build


def _waves(slope: float) -> Any:
    import bpy

    u, v = np.meshgrid(*(np.arange(WIDTH) / WIDTH * 2.0 * np.pi for _ in "uv"))
    x, y = slope * np.sin(6.0 * u) * np.cos(4.0 * v), slope * np.cos(5.0 * u + 7.0 * v)
    normal = np.stack([x, y, np.ones_like(x)], axis=2)
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    pixels = np.concatenate([0.5 * normal + 0.5, np.ones((WIDTH, WIDTH, 1))], axis=2)
    image = bpy.data.images.new("Waves", WIDTH, WIDTH, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.pixels.foreach_set(pixels.astype(np.float32).ravel())
    image.pack()
    return image


def _bump_on_map(tree: Any, node: Any) -> None:
    """A Normal Map below a Bump."""
    _normal_map("TANGENT", 0.7, 0.4)(tree, node)
    below = node.inputs["Normal"].links[0].from_socket
    bump = _bump(tree, node, _texture(tree, "Noise", 7.0).outputs[0], 0.4, 0.05)
    tree.links.new(below, bump.inputs["Normal"])


def _two_bumps(tree: Any, node: Any) -> None:
    """Fine noise above coarse cells."""
    coarse = _bump(tree, node, _texture(tree, "Voronoi", 3.0).outputs["Distance"], 0.6, 0.1)
    fine = _bump(tree, node, _texture(tree, "Noise", 14.0).outputs[0], 0.3, 0.03)
    tree.links.new(coarse.outputs["Normal"], fine.inputs["Normal"])


def _displacement(tree: Any, height: Any, distance: float, *, method: str) -> None:
    """A Displacement node about the middle of a texture's height."""
    node = tree.nodes.new("ShaderNodeDisplacement")
    node.inputs["Scale"].default_value = distance
    tree.links.new(height, node.inputs["Height"])
    tree.links.new(node.outputs["Displacement"], tree.get_output_node("CYCLES").inputs["Displacement"])
    _material_of(tree).displacement_method = method


def _material_of(tree: Any) -> Any:
    import bpy

    return next(each for each in bpy.data.materials if each.node_tree == tree)


def _displaced(method: str, kind: str, scale: float, distance: float) -> Build:
    def build(tree: Any, node: Any) -> None:
        del node
        texture = _texture(tree, kind, scale, coordinates="Object")
        height = next(texture.outputs[n] for n in ("Fac", "Factor", "Distance") if n in texture.outputs)
        _displacement(tree, height, distance, method=method)

    return build


def _map_on_displacement(tree: Any, node: Any) -> None:
    """A Normal Map beside a displacement by bump, as sets of textures have them."""
    _normal_map("TANGENT", 0.7, 0.4)(tree, node)
    _displaced("BUMP", "Noise", 5.0, 0.1)(tree, node)


BUMPS: dict[str, Callable[[Any, Any], None]] = {
    "low noise": _height("Noise", 6.0, 0.3, 0.1),
    "noise": _height("Noise", 6.0, 1.0, 0.1),
    "fine noise": _height("Noise", 18.0, 0.5, 0.03),
    "cells inverted": _height("Voronoi", 5.0, 0.8, 0.1, invert=True),
    "waves of the object": _height("Wave", 2.0, 0.5, 0.05, at="Object"),
    "bricks over UV": _height("Brick", 6.0, 0.5, 0.02, at="UV"),
    "normal map": _normal_map("TANGENT", 1.0, 0.5),
    "weak normal map": _normal_map("TANGENT", 0.4, 0.8),
    "bump above a normal map": _bump_on_map,
    "two bumps": _two_bumps,
    "displacement by bump": _displaced("BUMP", "Noise", 6.0, 0.1),
    "displacement by bump and normal map": _map_on_displacement,
    "displacement": _displaced("DISPLACEMENT", "Noise", 3.0, 0.2),
    "displacement and bump": _displaced("BOTH", "Noise", 5.0, 0.15),
}
