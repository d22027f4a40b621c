# SPDX-License-Identifier: Apache-2.0
"""Settings of a random scene that belong to an object's data: shared and odd meshes, drivers, other types."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import bpy

from .rig import Draw, Rig, Setting, color_of, principled, put_socket


def _shared_mesh(rig: Rig, _: Draw) -> None:
    """Another object of the box's mesh, with a modifier and a material of its own."""
    other = rig.box.copy()
    other.location = (1.5, -0.9, 0.52)
    rig.scene.collection.objects.link(other)
    other.modifiers.new("Bevel", "BEVEL").width = 0.3
    other.material_slots[0].link = "OBJECT"
    other.material_slots[0].material = rig.floor.data.materials[0]


def _odd_slots(rig: Rig, draw: Draw) -> None:
    """Slots without a material, and faces that name slots which are not there."""
    rig.box.data.materials.append(None)
    rig.box.data.materials.append(rig.floor.data.materials[0])
    for polygon in rig.box.data.polygons:
        polygon.material_index = int(draw.integers(0, 5))


def _other_map(rig: Rig, _: Draw) -> None:
    """A texture by a map that is rendered and not the one that is edited."""
    mesh = rig.box.data
    other = mesh.uv_layers.new(name="Rendered")
    for loop in other.uv:
        loop.vector = loop.vector * 2.3
    other.active_render = True
    mesh.uv_layers.active = mesh.uv_layers[0]
    tree = rig.box.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.interpolation = bpy.data.images.new("Grid", 64, 64), "Closest"
    node.image.generated_type = "COLOR_GRID"
    color_of(rig, node.outputs[0])


def _texture_space(rig: Rig, draw: Draw) -> None:
    mesh = rig.box.data
    mesh.use_auto_texspace = False
    mesh.texspace_location, mesh.texspace_size = (0.3, 0.2, 0.1), tuple(draw.uniform(0.4, 2.0, 3))
    tree = mesh.materials[0].node_tree
    color_of(rig, tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"])


def _driven(rig: Rig, draw: Draw) -> None:
    """A value by a driver of the frame, another by keyframes."""
    rig.scene.frame_set(int(draw.integers(2, 20)))
    socket = principled(rig.box).inputs["Roughness"]
    socket.driver_add("default_value").driver.expression = "0.1 + 0.02 * frame"
    lamp: Any = rig.light.data
    for frame, energy in ((1, 100.0), (21, 700.0)):
        lamp.energy = energy
        lamp.keyframe_insert("energy", frame=frame)
    rig.scene.frame_set(rig.scene.frame_current)


def _bright_base(rig: Rig, draw: Draw) -> None:
    put_socket(rig.box, "Base Color", (float(draw.uniform(1.0, 1.6)), 0.8, 0.9, 1.0))


def _dark_glow(rig: Rig, _: Draw) -> None:
    """A box that takes light away."""
    put_socket(rig.box, "Emission Strength", -0.5)


def _focused(rig: Rig, draw: Draw) -> None:
    rig.camera.data.dof.use_dof, rig.camera.data.dof.aperture_fstop = True, 0.3
    rig.camera.data.dof.focus_object = rig.box
    rig.camera.scale = (float(draw.choice([1.0, 2.0])),) * 3


def _of_another_type(kind: str) -> Callable[[Rig, Draw], Rig]:
    """What is fitted is no mesh."""

    def put(rig: Rig, draw: Draw) -> Rig:
        material = rig.target.data.materials[0]
        if kind == "FONT":
            made: Any = bpy.data.curves.new("Word", "FONT")
            made.body, made.extrude, made.bevel_depth, made.size = "B", 0.3, 0.05, 2.4
        elif kind == "META":
            made = bpy.data.metaballs.new("Drop")
            made.resolution, made.render_resolution = 0.4, 0.12
            made.elements.new().radius = 1.6
        elif kind == "SURFACE":
            made = bpy.data.curves.new("Sheet", "SURFACE")
            made.resolution_u = made.resolution_v = 3
            made.render_resolution_u = made.render_resolution_v = 6
        else:
            made = bpy.data.curves.new("Tube", "CURVE")
            made.dimensions, made.bevel_depth, made.use_fill_caps = "3D", 0.4, True
            made.resolution_u, made.render_resolution_u = 2, int(draw.integers(4, 12))
            spline = made.splines.new("BEZIER")
            spline.bezier_points.add(1)
            for point, place in zip(spline.bezier_points, ((-0.7, 0.0, -0.6), (0.7, 0.3, 0.7)), strict=True):
                point.co, point.handle_left_type, point.handle_right_type = place, "AUTO", "AUTO"
        if kind == "SURFACE":
            bpy.ops.surface.primitive_nurbs_surface_sphere_add(location=(0.0, 0.0, 1.0))
            item = bpy.context.object
            item.data.resolution_u = item.data.resolution_v = 2
            item.data.render_resolution_u = item.data.render_resolution_v = 6
            made = item.data
        else:
            item = bpy.data.objects.new("Fitted", made)
            item.location = (0.0, 0.0, 1.0)
            rig.scene.collection.objects.link(item)
        if kind == "FONT":
            item.location, item.rotation_euler = (-0.8, 0.0, 0.3), (math.pi / 2, 0.0, 0.0)
        made.materials.append(material)
        bpy.data.objects.remove(rig.target)
        bpy.context.view_layer.objects.active = item
        return replace(rig, target=item)

    return put


def _all() -> Iterator[Setting]:
    yield Setting("shared mesh", _shared_mesh)
    yield Setting("odd slots", _odd_slots)
    yield Setting("other map", _other_map)
    yield Setting("texture space", _texture_space)
    yield Setting("driven", _driven)
    yield Setting("bright base", _bright_base)
    yield Setting("dark glow", _dark_glow)
    yield Setting("focused", _focused)
    for kind in ("FONT", "META", "SURFACE", "CURVE"):  # last: other settings change the ball's mesh
        yield Setting(f"target of type {kind.lower()}", _of_another_type(kind))


DATA_SETTINGS = tuple(_all())
