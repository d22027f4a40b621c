# SPDX-License-Identifier: Apache-2.0
"""Meshes read by whole attributes, bit by bit those read by the properties of each face and corner."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.meshes.read_mesh import flat_normals, read_mesh
from blender_addon.versions import rounds_beside_flat_faces


def flat() -> None:
    bpy.ops.mesh.primitive_monkey_add()


def smooth() -> None:
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.object.shade_smooth()


def triangles() -> None:
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    bpy.ops.object.shade_smooth()


def mixed() -> None:
    """Of several slots, with a face that is no quad."""
    bpy.ops.mesh.primitive_cylinder_add(vertices=12)
    mesh = bpy.context.object.data
    for number in range(3):
        mesh.materials.append(bpy.data.materials.new(str(number)))
    for face in mesh.polygons:
        face.use_smooth, face.material_index = face.index % 2 == 0, face.index % 3


def sharp() -> None:
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.shade_smooth()
    edges = bpy.context.object.data.edges
    edges[0].use_edge_sharp = edges[3].use_edge_sharp = True


def sharp_by_nodes() -> None:
    """Smooth by angle, as files before Blender 4.1 become: no face ever had a word of its own."""
    bpy.ops.mesh.primitive_cube_add()
    group = bpy.data.node_groups.new("Smooth by Angle", "GeometryNodeTree")
    for in_out in ("INPUT", "OUTPUT"):
        group.interface.new_socket("Geometry", in_out=in_out, socket_type="NodeSocketGeometry")
    nodes = [group.nodes.new(name) for name in ("NodeGroupInput", "GeometryNodeSetShadeSmooth", "NodeGroupOutput")]
    nodes[1].domain, nodes[1].inputs["Shade Smooth"].default_value = "EDGE", False
    for before, after in pairwise(nodes):
        group.links.new(before.outputs[0], after.inputs[0])
    bpy.context.object.data.attributes.remove(bpy.context.object.data.attributes["sharp_face"])
    bpy.context.object.modifiers.new("Smooth by Angle", "NODES").node_group = group


def custom() -> None:
    smooth()
    mesh = bpy.context.object.data
    mesh.normals_split_custom_set([(np.sin(k), np.cos(k), 0.5) for k in range(len(mesh.loops))])


def modified() -> None:
    mixed()
    bpy.context.object.modifiers.new("Subdivision", "SUBSURF").levels = 2


def text() -> None:
    bpy.ops.object.text_add()


def edited() -> None:
    mixed()
    bpy.ops.object.mode_set(mode="EDIT")


@pytest.mark.parametrize(
    "build", [flat, smooth, triangles, mixed, sharp, sharp_by_nodes, custom, modified, text, edited]
)
def test_a_mesh_is_what_its_faces_and_corners_say(build: Any, scene: Any) -> None:
    build()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    item = bpy.context.object.evaluated_get(depsgraph)
    read = read_mesh(item, depsgraph)
    assert read is not None
    mesh = item.to_mesh(preserve_all_data_layers=False, depsgraph=depsgraph)
    mesh.calc_loop_triangles()
    faces = mesh.loop_triangles
    corners = [list(face.loops) for face in faces]
    places = np.array([[mesh.vertices[mesh.loops[k].vertex_index].co for k in each] for each in corners], np.float32)
    # by vertices where Cycles rounds beside flat faces, unless normals split
    splits = mesh.has_custom_normals or any(edge.use_edge_sharp for edge in mesh.edges)
    by_vertex = mesh.normals_domain == "FACE" or (rounds_beside_flat_faces() and not splits)
    normals = [
        [mesh.vertex_normals[mesh.loops[k].vertex_index].vector if by_vertex else mesh.corner_normals[k].vector
         for k in each] for each in corners
    ]  # fmt: skip
    wanted = np.array(normals, np.float32)
    if not mesh.has_custom_normals:
        is_smooth = np.array([face.use_smooth and build is not sharp_by_nodes for face in faces])
        wanted = np.where(is_smooth[:, None, None], wanted, flat_normals(places))
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    uvs = [[tuple(layer.uv[k].vector) if layer is not None else (0.0, 0.0) for k in each] for each in corners]
    assert read.positions.tobytes() == places.tobytes()
    assert read.normals.tobytes() == wanted.tobytes()
    assert read.uvs.tobytes() == np.array(uvs, np.float32).tobytes()
    assert read.slots.tolist() == [face.material_index for face in faces]
    assert read.vertices.tolist() == [list(face.vertices) for face in faces]
