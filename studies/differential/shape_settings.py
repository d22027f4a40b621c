# SPDX-License-Identifier: Apache-2.0
"""Settings of a random scene's shapes and camera: instances by nodes, hair, deformation, lenses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import bmesh
import bpy

from .rig import Draw, Rig, Setting


def _scattered(rig: Rig, draw: Draw) -> None:
    """Geometry nodes that put copies of the box onto points of a grid, each of another size."""
    group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    group.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    new = group.nodes.new
    grid, put, info, size = (
        new(f"GeometryNode{kind}") for kind in ("MeshGrid", "InstanceOnPoints", "ObjectInfo", "InputPosition")
    )
    output, random = new("NodeGroupOutput"), new("FunctionNodeRandomValue")
    grid.inputs["Vertices X"].default_value = grid.inputs["Vertices Y"].default_value = 2
    grid.inputs["Size X"].default_value = grid.inputs["Size Y"].default_value = 3.0
    info.inputs[0].default_value, info.inputs["As Instance"].default_value = rig.box, True
    random.data_type = "FLOAT_VECTOR"
    random.inputs[0].default_value, random.inputs[1].default_value = (0.15,) * 3, (0.5,) * 3
    random.inputs["Seed"].default_value = int(draw.integers(100))
    group.nodes.remove(size)
    group.links.new(grid.outputs["Mesh"], put.inputs["Points"])
    group.links.new(info.outputs["Geometry"], put.inputs["Instance"])
    group.links.new(random.outputs[0], put.inputs["Scale"])
    group.links.new(put.outputs[0], output.inputs[0])
    carrier = bpy.data.objects.new("Scatter", bpy.data.meshes.new("Scatter"))
    carrier.location.z = 0.3
    rig.scene.collection.objects.link(carrier)
    carrier.modifiers.new("Scatter", "NODES").node_group = group


def _hair(rig: Rig, _: Draw) -> None:
    system = rig.floor.modifiers.new("Hair", "PARTICLE_SYSTEM").particle_system
    made = system.settings
    made.type, made.count, made.hair_length, made.root_radius = "HAIR", 40, 0.5, 2.0


def _curves(rig: Rig, _: Draw) -> None:
    made = bpy.data.hair_curves.new("Strands")
    made.add_curves([2] * 4)
    for number, point in enumerate(made.points):
        point.position, point.radius = (0.3 * (number // 2) - 1.5, -1.5, 0.8 * (number % 2)), 0.05
    rig.scene.collection.objects.link(bpy.data.objects.new("Strands", made))


def _armature(rig: Rig, draw: Draw) -> None:
    """The box bent by a bone, over a shape key and below a subdivision."""
    rig.box.shape_key_add(name="Basis")
    key = rig.box.shape_key_add(name="Wide")
    for point in key.data:
        point.co.x *= 1.5
    key.value = float(draw.uniform(0.2, 1.0))
    item = bpy.data.objects.new("Rig", bpy.data.armatures.new("Rig"))
    rig.scene.collection.objects.link(item)
    bpy.context.view_layer.objects.active = item
    bpy.ops.object.mode_set(mode="EDIT")
    bone = item.data.edit_bones.new("Bone")
    bone.head, bone.tail = (0.0, 0.0, -0.5), (0.0, 0.0, 0.5)
    bpy.ops.object.mode_set(mode="OBJECT")
    group = rig.box.vertex_groups.new(name="Bone")
    for vertex in rig.box.data.vertices:
        group.add([vertex.index], 0.5 + vertex.co.z, "REPLACE")
    item.location = rig.box.location
    item.pose.bones["Bone"].rotation_mode = "XYZ"
    item.pose.bones["Bone"].rotation_euler = tuple(draw.uniform(-0.4, 0.4, 3))
    rig.box.modifiers.new("Rig", "ARMATURE").object = item
    rig.box.modifiers.new("Subdivision", "SUBSURF").render_levels = 2
    bpy.context.view_layer.objects.active = rig.target


def _twisted(rig: Rig, draw: Draw) -> None:
    divided = rig.box.modifiers.new("Divided", "SUBSURF")
    divided.subdivision_type, divided.render_levels = "SIMPLE", 3
    made: Any = rig.box.modifiers.new("Twist", "SIMPLE_DEFORM")
    made.deform_method, made.angle, made.deform_axis = "TWIST", float(draw.uniform(0.3, 1.5)), "Z"


def _sharp_edges(rig: Rig, _: Draw) -> None:
    for edge in rig.target.data.edges:
        edge.use_edge_sharp = edge.index % 3 == 0


def _linked_copy(rig: Rig, draw: Draw) -> None:
    other = rig.box.copy()
    other.location, other.scale = (1.4, -0.6, 0.6), tuple(draw.uniform(0.3, 1.0, 3))
    rig.scene.collection.objects.link(other)


def _filter(rig: Rig, draw: Draw) -> None:
    rig.scene.cycles.pixel_filter_type = str(draw.choice(["GAUSSIAN", "BLACKMAN_HARRIS"]))
    rig.scene.cycles.filter_width = float(draw.uniform(0.5, 3.0))


def _shift(rig: Rig, draw: Draw) -> None:
    rig.camera.data.shift_x, rig.camera.data.shift_y = (float(each) for each in draw.uniform(-0.15, 0.15, 2))
    if draw.random() < 0.4:
        rig.camera.data.type, rig.camera.data.ortho_scale = "ORTHO", float(draw.uniform(4.0, 7.0))


def _far_clip(rig: Rig, draw: Draw) -> None:
    rig.camera.data.clip_end = float(draw.uniform(6.2, 8.0))


def _odd_camera(rig: Rig, draw: Draw) -> None:
    rig.camera.scale = (float(draw.choice([1.0, 2.0])), 1.0, float(draw.choice([1.0, 0.5])))


def _percentage(rig: Rig, _: Draw) -> None:
    render = rig.scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 2 * render.resolution_x, 64, 50


def _clamped(rig: Rig, draw: Draw) -> None:
    rig.scene.cycles.sample_clamp_indirect = float(draw.choice([0.5, 2.0, 10.0]))


def _blurred_gloss(rig: Rig, draw: Draw) -> None:
    rig.scene.cycles.blur_glossy = float(draw.uniform(0.3, 2.0))


def _round_terminator(rig: Rig, draw: Draw) -> None:
    """An offset of its own, on a smooth box."""
    for polygon in rig.box.data.polygons:
        polygon.use_smooth = True
    rig.box.modifiers.new("Subdivision", "SUBSURF").render_levels = 1
    rig.box.shadow_terminator_geometry_offset = float(draw.uniform(0.0, 1.0))


def _decal(rig: Rig, draw: Draw) -> None:
    """A film that is half clear on the ball and on the floor, less than a millimetre above them."""
    gap = 10.0 ** float(draw.uniform(-4.0, -3.0))
    sheet = bpy.data.meshes.new("Decal")
    corners = [(x, y, gap) for x, y in ((-2.5, -2.0), (0.5, -2.0), (0.5, 1.0), (-2.5, 1.0))]
    sheet.from_pydata(corners, [], [(0, 1, 2, 3)])
    film = rig.target.data.copy()
    film.materials.clear()
    material = rig.floor.data.materials[0].copy()
    node = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    node.inputs["Alpha"].default_value = float(draw.uniform(0.2, 0.7))
    for name, mesh in (("Decal", sheet), ("Film", film)):
        mesh.materials.append(material)
        item = bpy.data.objects.new(name, mesh)
        rig.scene.collection.objects.link(item)
        if mesh is film:
            item.location, item.scale = rig.target.location, (1.0 + gap,) * 3


def _smooth_shell(rig: Rig, draw: Draw) -> None:
    """The box without its top, with walls, and normals that lean from its facets towards their rims; little lamp."""
    bpy.context.view_layer.objects.active = rig.box
    bpy.ops.object.mode_set(mode="EDIT")
    edited = bmesh.from_edit_mesh(rig.box.data)
    edited.faces.ensure_lookup_table()
    bmesh.ops.delete(edited, geom=[max(edited.faces, key=lambda face: face.calc_center_median().z)], context="FACES")
    bmesh.update_edit_mesh(rig.box.data)
    bpy.ops.object.mode_set(mode="OBJECT")
    bpy.context.view_layer.objects.active = rig.target
    for polygon in rig.box.data.polygons:
        polygon.use_smooth = True
    rig.box.modifiers.new("Walls", "SOLIDIFY").thickness = float(draw.uniform(0.03, 0.1))
    rig.light.data.energy *= 0.1


def _all() -> Iterator[Setting]:
    exported = {
        "scattered by nodes": _scattered, "armature": _armature, "twisted": _twisted, "sharp edges": _sharp_edges,
        "linked copy": _linked_copy, "filter width": _filter, "shift and scale": _shift,
        "far clip": _far_clip, "scaled camera": _odd_camera, "percentage": _percentage,
        "blurred gloss": _blurred_gloss, "box terminator": _round_terminator, "decal": _decal,
        "smooth shell": _smooth_shell,
    }  # fmt: skip
    yield from (Setting(name, put) for name, put in exported.items())
    yield Setting("clamped", _clamped, ("lamping",))
    yield Setting("hair", _hair, ("air", "article"))
    yield Setting("hair curves", _curves, ("is a Curves",))


SHAPE_SETTINGS = tuple(_all())
