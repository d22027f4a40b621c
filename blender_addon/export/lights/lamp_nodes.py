# SPDX-License-Identifier: GPL-3.0-or-later
"""What the nodes of a lamp ask a ray of light for, which says by what their values have to be looked up."""

from __future__ import annotations

from collections.abc import Iterator

import bpy

from ...bake.lamp_layout import CONSTANT, DIRECTION, NORMAL, PLACE, Lookup
from ..nodes.dependence import GENERATED_BY_DEFAULT

# what outputs of nodes tell a lamp; "depth" changes from bounce to bounce, "camera" with the view
_ASKS = {
    "ShaderNodeTexCoord": {
        "Generated": "position",
        "Normal": "normal",
        "UV": "uv",
        "Object": "position",
        "Camera": "camera",
        "Window": "camera",
        "Reflection": "direction",
    },
    "ShaderNodeNewGeometry": {
        "Position": "position",
        "Normal": "normal",
        "Tangent": "normal",
        "True Normal": "normal",
        "Incoming": "direction",
        "Parametric": "uv",
    },
    "ShaderNodeUVMap": {"UV": "uv"},
    "ShaderNodeTangent": {"Tangent": "normal"},
    "ShaderNodeFresnel": {"Fac": "facing", "Factor": "facing"},
    "ShaderNodeLayerWeight": {"Fresnel": "facing", "Facing": "facing"},
    "ShaderNodeLightFalloff": {"Quadratic": "distance", "Linear": "distance", "Constant": "distance"},
    "ShaderNodeLightPath": {
        "Ray Length": "distance",
        "Ray Depth": "depth",
        "Diffuse Depth": "depth",
        "Glossy Depth": "depth",
        "Transparent Depth": "depth",
        "Transmission Depth": "depth",
        "Portal Depth": "depth",
    },
    "ShaderNodeCameraData": {"View Vector": "camera", "View Z Depth": "camera", "View Distance": "camera"},
}
# what textures ask for where nothing is linked to Vector
_BY_DEFAULT = {
    **dict.fromkeys(GENERATED_BY_DEFAULT, "position"),
    "ShaderNodeTexImage": "uv",
    "ShaderNodeTexIES": "direction",
    "ShaderNodeTexEnvironment": "position",
    "ShaderNodeTexSky": "position",
    "ShaderNodeTexPointDensity": "position",
}
# ask for what no table holds: bumps compare neighbours, scripts may ask for anything
_UNKNOWN = ("ShaderNodeBump", "ShaderNodeScript", "ShaderNodeAmbientOcclusion", "ShaderNodeBevel", "ShaderNodeRaycast")


class LampNodesError(Exception):
    """What a lamp's nodes ask for has no table; the message says what, as part of a sentence."""


def lookup_of(tree: bpy.types.NodeTree, kind: str, *, has_radius: bool, is_sphere: bool) -> Lookup:
    """By what the values of a lamp's nodes are looked up, for a lamp of this kind (POINT, SPOT, SUN, AREA).

    `has_radius` and `is_sphere` are of points and spots. A light with a radius that is no sphere is a disc that faces
    the lit point, so that its normal is the light's direction there.

    Raises
    ------
    LampNodesError
        If that is nothing that a table of two dimensions and one of distances hold.
    """
    asked = set(_asked(tree))
    for label in sorted(each.removeprefix("node:") for each in asked if each.startswith("node:")):
        raise LampNodesError(f"the node '{label}'")
    if "camera" in asked:
        raise LampNodesError("the camera's view")
    flat, ball = kind == "AREA", kind in ("POINT", "SPOT") and has_radius and is_sphere
    by = set[str]()
    for each in asked & {"normal", "uv", "position", "direction", "facing"}:
        if kind == "SUN":
            raise LampNodesError("places or directions on a sun")
        if each == "position" and not flat and has_radius:
            raise LampNodesError("places on a lamp with a radius")
        if each == "normal" and not flat:
            by.add(NORMAL if ball else DIRECTION)
        elif each == "uv":
            by.add(PLACE if flat else NORMAL if ball and kind == "POINT" else DIRECTION)
        elif each == "position" and flat:
            by.add(PLACE)
        elif each == "direction" or (each == "facing" and (flat or ball)):
            by |= {DIRECTION, NORMAL} if each == "facing" and ball else {DIRECTION}
    if len(by) > 1:
        raise LampNodesError("directions and places on the lamp at once")
    found = by.pop() if by else CONSTANT
    return Lookup(found, *(each in asked for each in ("distance", "depth", "texture", "position")))


def _asked(tree: bpy.types.NodeTree) -> Iterator[str]:
    for node in tree.nodes:
        if not any(output.is_linked for output in node.outputs):
            continue
        kind = node.bl_idname
        if kind == "ShaderNodeGroup":
            if node.node_tree is not None:
                yield from _asked(node.node_tree)
            continue
        outputs = _ASKS.get(kind, {})
        yield from (outputs[output.name] for output in node.outputs if output.is_linked and output.name in outputs)
        if kind in _BY_DEFAULT and ("Vector" not in node.inputs or not node.inputs["Vector"].is_linked):
            yield _BY_DEFAULT[kind]
        if kind in _BY_DEFAULT and kind != "ShaderNodeTexIES":
            yield "texture"
        if kind == "ShaderNodeVectorTransform" and "CAMERA" in (node.convert_from, node.convert_to):
            yield "camera"
        if kind in _UNKNOWN:
            yield f"node:{node.bl_label}"
