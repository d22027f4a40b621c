# SPDX-License-Identifier: GPL-3.0-or-later
"""What the outputs of nodes depend on beside a point of a surface: the view, other objects, the object's own place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import bpy

from .clear_objects import is_bending, is_clear

Outputs = Mapping[str, tuple[str, ...]]  # names of outputs by kind of node

# look at what is around an object, while a bake is of one object alone
OF_SURROUNDINGS = {"ShaderNodeAmbientOcclusion": ("Color", "AO"), "ShaderNodeRaycast": ("Is Hit", "Hit Distance")}
# depend on where a surface is looked at from
OF_VIEW = {
    "ShaderNodeFresnel": ("Fac", "Factor"),
    "ShaderNodeLayerWeight": ("Fresnel", "Facing"),
    "ShaderNodeCameraData": ("View Vector", "View Z Depth", "View Distance"),
    "ShaderNodeNewGeometry": ("Incoming",),
    "ShaderNodeTexCoord": ("Camera", "Window", "Reflection"),
}
# differ between the two sides of a surface, while a bake looks at the front
OF_SIDE = {"ShaderNodeNewGeometry": ("Backfacing",)}
# differ between the two sides of a surface, from wherever each is looked at; so does what pictures by BOX show
OF_BACK = {
    "ShaderNodeNewGeometry": ("Normal", "True Normal", "Backfacing"),
    "ShaderNodeTexCoord": ("Normal",),
    "ShaderNodeBevel": ("Normal",),
}
# differ between the two sides of a surface wherever it is looked at from
OF_FACING = {
    "ShaderNodeNewGeometry": ("Normal", "True Normal", "Incoming", "Backfacing"),
    "ShaderNodeTexCoord": ("Normal", "Reflection"),
    "ShaderNodeFresnel": ("Fac", "Factor"),
    "ShaderNodeLayerWeight": ("Fresnel", "Facing"),
    "ShaderNodeBevel": ("Normal",),
}
# instances of one object have each their own of
OF_PLACE = {
    "ShaderNodeNewGeometry": ("Position", "Normal", "True Normal", "Tangent"),
    "ShaderNodeObjectInfo": ("Location", "Random"),
    "ShaderNodeVectorTransform": ("Vector",),
    "ShaderNodeBevel": ("Normal",),
}
# that of what shows an instance: of an instancer, whatever the object's own is
OF_INSTANCER_COLOR = {"ShaderNodeObjectInfo": ("Color",)}
# bend normals by slopes, which are others where an instance is stretched in another way; those of a bump, whose
# distance is in metres, also where it is larger
OF_SIZE = {"ShaderNodeBump": ("Normal",)}
OF_STRETCH = {"ShaderNodeNormalMap": ("Normal",)}
# a world's that turn with the camera
OF_CAMERA_TURN = {
    "ShaderNodeCameraData": ("View Vector", "View Z Depth", "View Distance"),
    "ShaderNodeTexCoord": ("Camera", "Window"),
}
# textures that take Generated coordinates where nothing is linked to Vector
GENERATED_BY_DEFAULT = frozenset(
    f"ShaderNodeTex{kind}" for kind in ("Brick", "Checker", "Gabor", "Gradient", "Magic", "Noise", "Voronoi", "Wave")
)
# modifiers that move vertices; Generated coordinates stay where those were before (`MeshVertex.undeformed_co`)
DEFORMING = (
    *("ARMATURE", "CAST", "CLOTH", "CORRECTIVE_SMOOTH", "CURVE", "DISPLACE", "HOOK", "LAPLACIANDEFORM"),
    *("LAPLACIANSMOOTH", "LATTICE", "MESH_CACHE", "MESH_DEFORM", "MESH_SEQUENCE_CACHE", "SHRINKWRAP", "SIMPLE_DEFORM"),
    *("SMOOTH", "SOFT_BODY", "SURFACE_DEFORM", "WARP", "WAVE"),
)


def asked_for(tree: bpy.types.NodeTree, outputs: Outputs) -> list[str]:
    """Labels of nodes in `tree` and its groups that something asks for one of these outputs."""
    return sorted({node.bl_label for node in _nodes(tree) if _is_asked(node, outputs)})


def asked_of_place(tree: bpy.types.NodeTree) -> list[str]:
    """Labels of nodes that something asks for what each instance of an object has of its own."""
    others = {node.bl_label for node in _nodes(tree) if getattr(node, "object", None) is not None}
    return sorted({*asked_for(tree, OF_PLACE), *others})


def asked_of_instancer(tree: bpy.types.NodeTree) -> list[str]:
    """Labels of nodes that something asks for what particles, points or other instancers say of an instance."""
    return sorted({node.bl_label for node in _nodes(tree) if _asks_instancer(node)})


def differs_behind(tree: bpy.types.NodeTree) -> bool:
    """Whether something asks for what a bake of the front does not know of the back."""
    return bool(asked_for(tree, OF_BACK)) or any(map(_projects_by_normals, _nodes(tree)))


def lets_light_through(tree: bpy.types.NodeTree) -> bool:
    """Whether light goes through the surface, or a part of it."""
    nodes = list(_nodes(tree))
    return any(is_clear(node) or is_bending(node) or node.bl_idname == "ShaderNodeBsdfTranslucent" for node in nodes)


def asked_of_side(tree: bpy.types.NodeTree) -> list[str]:
    """Labels of nodes that answer a ray that meets the back of a surface with other values than one at its front."""
    kinds = ("ShaderNodeLightPath", *OF_SURROUNDINGS)
    others = {
        node.bl_label
        for node in _nodes(tree)
        if (node.bl_idname in kinds and any(output.is_linked for output in node.outputs)) or _projects_by_normals(node)
    }
    return sorted({*asked_for(tree, OF_FACING), *others})


def turns_with_camera(tree: bpy.types.NodeTree) -> list[str]:
    """Labels of nodes in a world's tree whose values depend on which way the camera looks."""
    found = {node.bl_label for node in _nodes(tree) if _is_asked(node, OF_CAMERA_TURN)}
    spaces = {
        node.bl_label
        for node in _nodes(tree)
        if node.bl_idname == "ShaderNodeVectorTransform" and "CAMERA" in (node.convert_from, node.convert_to)
    }
    return sorted(found | spaces)


def deformed_generated(item: bpy.types.Object, tree: bpy.types.NodeTree) -> list[str]:
    """What deforms `item`, as `deforming`, where nodes of `tree` ask for Generated coordinates."""
    return deforming(item) if any(_asks_generated(node) for node in _nodes(tree)) else []


def deforming(item: bpy.types.Object) -> list[str]:
    """What deforms an object: names of modifiers and "shape keys"."""
    found = [each.name for each in item.modifiers if each.show_render and each.type in DEFORMING]
    keys = getattr(item.data, "shape_keys", None)
    if keys is not None and any(key.value != 0.0 and not key.mute for key in keys.key_blocks[1:]):
        found.append("shape keys")
    return found


def _nodes(tree: bpy.types.NodeTree) -> Iterator[bpy.types.Node]:
    for node in tree.nodes:
        if node.bl_idname == "ShaderNodeGroup" and node.node_tree is not None:
            yield from _nodes(node.node_tree)
        else:
            yield node


def _projects_by_normals(node: bpy.types.Node) -> bool:
    return getattr(node, "projection", "") == "BOX"


def _is_asked(node: bpy.types.Node, outputs: Outputs) -> bool:
    return any(output.is_linked and output.name in outputs.get(node.bl_idname, ()) for output in node.outputs)


def _asks_instancer(node: bpy.types.Node) -> bool:
    if getattr(node, "attribute_type", "") == "INSTANCER" or node.bl_idname == "ShaderNodeParticleInfo":
        return any(output.is_linked for output in node.outputs)
    return getattr(node, "from_instancer", False) and _is_asked(
        node, {"ShaderNodeTexCoord": ("Generated", "UV"), "ShaderNodeUVMap": ("UV",)}
    )


def _asks_generated(node: bpy.types.Node) -> bool:
    if node.bl_idname in GENERATED_BY_DEFAULT:
        return not node.inputs["Vector"].is_linked and any(output.is_linked for output in node.outputs)
    if node.bl_idname == "ShaderNodeTangent":
        return node.direction_type == "RADIAL" and node.outputs[0].is_linked
    return _is_asked(node, {"ShaderNodeTexCoord": ("Generated",)})
