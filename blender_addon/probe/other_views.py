# SPDX-License-Identifier: GPL-3.0-or-later
"""What rays that do not come from the camera find where nodes ask for the ray, in a copied tree.

Of a bounced ray counts the angle to the normal, at which nodes are asked for several; around the normal each sample
draws a side.
"""

from __future__ import annotations

import math

import bpy

from ..export.nodes.dependence import asked_for
from .graph_copy import nodes_of
from .light_path import SCATTERED, answer_light_paths, light_path_outputs

# by the angle between the ray and the normal; by the ray's direction
OF_ANGLE = {"ShaderNodeFresnel": ("Fac", "Factor"), "ShaderNodeLayerWeight": ("Fresnel", "Facing")}
# Cycles rounds no edges for rays that a rough surface has scattered (kernel/svm/bevel.h)
BEVEL = {"ShaderNodeBevel": ("Normal",)}
OF_DIRECTION = {"ShaderNodeNewGeometry": ("Incoming",), "ShaderNodeTexCoord": ("Reflection",)}
ELSEWHERE_SCALE = 1  # subpixels along a pixel: bounces are blurred
# From along the surface to the normal, in even steps of the cosine. A ramp over Layer Weight on a head was 0.70 % too
# bright in level with their mean, 0.02 % with twelve (docs/notebook/graph_values.md). More: a render each.
ANGLES = 12


def cosine_of(angle: int) -> float:
    """The cosine between ray and normal that is the middle of a step."""
    return (angle + 0.5) / ANGLES


def cosines_of(tree: bpy.types.NodeTree) -> list[float]:
    """The cosines between ray and normal that nodes of a tree are asked at: one where they do not tell them apart."""
    return [cosine_of(angle) for angle in range(ANGLES if asked_for(tree, OF_ANGLE | OF_DIRECTION) else 1)]


def asks_ray(tree: bpy.types.NodeTree) -> bool:
    """Whether nodes of a tree or of its groups answer another ray than the camera's with other values."""
    return bool(light_path_outputs(tree)) or bool(asked_for(tree, OF_ANGLE | OF_DIRECTION | BEVEL))


def see_from_elsewhere(tree: bpy.types.NodeTree, cosine: float) -> None:
    """Let a copied tree, whose groups are its own, answer as bounced rays at an angle to the normal are answered."""
    answer_light_paths(tree, SCATTERED, own_groups=True)
    for node in list(nodes_of(tree)):
        if node.mute:
            continue
        if node.bl_idname in OF_ANGLE:
            incoming = node.id_data.nodes.new("ShaderNodeNewGeometry").outputs["Incoming"]
            node.id_data.links.new(_turned(incoming, cosine), node.inputs["Normal"])
        if node.bl_idname in BEVEL:
            _pass_normal(node)
        for name in OF_DIRECTION.get(node.bl_idname, ()):
            _put_direction(node.outputs[name], cosine, reflected=name == "Reflection")


def _pass_normal(bevel: bpy.types.Node) -> None:
    """Let what a Bevel is linked to have the normal that it would round."""
    tree = bevel.id_data
    own = [link.from_socket for link in bevel.inputs["Normal"].links]
    normal = own[0] if own else tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"]
    for target in [link.to_socket for link in bevel.outputs["Normal"].links]:
        tree.links.new(normal, target)


def _put_direction(output: bpy.types.NodeSocket, cosine: float, *, reflected: bool) -> None:
    """Put a direction at an angle to the normal, or its mirror image in the surface, where `output` is linked to."""
    targets = [link.to_socket for link in output.links]
    if not targets:
        return
    tree = output.id_data
    normal = tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"]
    direction = _turned(normal, cosine)
    if reflected:
        direction = _vector("REFLECT", _vector("SCALE", direction, -1.0), normal)
    for target in targets:
        tree.links.new(direction, target)


def _turned(axis: bpy.types.NodeSocket, cosine: float) -> bpy.types.NodeSocket:
    """A unit vector at an angle to `axis`, which is one, too, to a random side."""
    tree = axis.id_data
    random = tree.nodes.new("ShaderNodeTexWhiteNoise")
    random.noise_dimensions = "3D"
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], random.inputs["Vector"])
    middle = tree.nodes.new("ShaderNodeVectorMath")
    middle.operation = "SUBTRACT"
    middle.inputs[1].default_value = (0.5, 0.5, 0.5)
    tree.links.new(random.outputs["Color"], middle.inputs[0])
    beside = _vector("NORMALIZE", _vector("CROSS_PRODUCT", axis, middle.outputs[0]))
    sine = math.sqrt(1.0 - cosine**2)
    return _vector("ADD", _vector("SCALE", axis, cosine), _vector("SCALE", beside, sine))


def _vector(
    operation: str, first: bpy.types.NodeSocket, second: bpy.types.NodeSocket | float | None = None
) -> bpy.types.NodeSocket:
    """The result of a Vector Math node; a second number is its scale."""
    tree = first.id_data
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = operation
    tree.links.new(first, node.inputs[0])
    into = node.inputs["Scale" if operation == "SCALE" else 1]
    if isinstance(second, float):
        into.default_value = second
    elif second is not None:
        tree.links.new(second, into)
    return node.outputs[0]
