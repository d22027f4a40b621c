# SPDX-License-Identifier: GPL-3.0-or-later
"""Which bent normals have the opposite direction on the back of a surface; Cycles mirrors all others there."""

from __future__ import annotations

import bpy

from ..findings import Findings
from .displacement import bends_normals, displacement_of, moves_faces
from .graph_findings import GROUP, GROUP_INPUT, Groups, feeding, outputs_before
from .shader_graph import source_of

# What Cycles differentiates by the place itself (`dP`). All else, as UV and Generated coordinates, attributes and
# textures of them, it differentiates between vertices, with the other sign on back faces (`shader_setup_from_ray`
# negates `dPdu` and `dPdv`, in 4.2 as in 5.2): a Bump of those is hollow there. Of 20 heights that 5.0 rendered from
# both sides three bent nothing, and all others but those by these outputs were hollow.
BY_PLACE = {"ShaderNodeNewGeometry": ("Position",), "ShaderNodeTexCoord": ("Object", "Camera", "Window")}


def turns_on_backs(source: bpy.types.NodeSocket, groups: Groups = ()) -> bool:
    """Whether the normal that an output gives is the opposite on back faces: that of a Normal Map or of most Bumps.

    `groups` are the group nodes it lies in.
    """
    node = source.node
    if node.bl_idname in (GROUP, GROUP_INPUT):
        socket, within = next(feeding(node, source, groups), (None, ()))
        inner = None if socket is None else source_of(socket)
        return inner is not None and turns_on_backs(inner, within)
    if node.bl_idname != "ShaderNodeBump":
        return node.bl_idname == "ShaderNodeNormalMap"
    below = source_of(node.inputs["Normal"])
    return is_hollow_behind(node.inputs["Height"], groups) and (below is None or turns_on_backs(below, groups))


def is_displaced_hollow(material: bpy.types.Material, *, by_language: bool = False) -> bool:
    """Whether what a displacement bends normals by is hollow on back faces where it is raised.

    Where it moves faces, too, Cycles holds the height against the places before that, which it differentiates between
    vertices (`svm_node_enter_bump_eval`, in 4.2 as in 5.2): such heights have the sign of those places. What it
    differentiates by `dP` has not, but by Open Shading Language, which knows no other derivative of a place.
    """
    displacement = displacement_of(material)
    if displacement is None:
        return False
    is_hollow = is_hollow_behind(displacement)
    return not (is_hollow or by_language) if moves_faces(material) else is_hollow


def note_displaced_backs(material: bpy.types.Material, owner: str, findings: Findings, *, by_language: bool) -> None:
    """Name a material on an object of uneven scale whose back Cycles mirrors before that scale.

    The fit mirrors it in the world: outside of a vase scaled by 0.7, 1 and 1.2 a block of 8 x 8 pixels was 14 % of the
    picture's mean off.
    """
    both = moves_faces(material) and bends_normals(material)
    if both and not is_displaced_hollow(material, by_language=by_language):
        findings.note(
            f"Material '{material.name}': on back faces of '{owner}', whose axes have different scales, Displacement "
            "and Bump bends normals in another way than in Cycles. Apply the scale, or turn the faces round, and "
            "render the reference anew."
        )


def is_hollow_behind(height: bpy.types.NodeSocket, groups: Groups = ()) -> bool:
    """Whether a bump by this height, or a displacement in place of one, is hollow on back faces where it is raised."""
    outputs = outputs_before((height,), groups)
    return not any(output.name in BY_PLACE.get(output.node.bl_idname, ()) for output in outputs)
