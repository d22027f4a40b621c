# SPDX-License-Identifier: Apache-2.0
"""Settings of a random scene as artists' files have them: parents, modifiers, instances, nodes, odd cameras."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix  # pyright: ignore[reportMissingImports]

from .rig import Draw, Rig, Setting, background, principled


def _empty(rig: Rig, name: str) -> Any:
    made = bpy.data.objects.new(name, None)
    rig.scene.collection.objects.link(made)
    return made


def _sheared(rig: Rig, draw: Draw) -> None:
    """A turned child of a stretched parent."""
    parent = _empty(rig, "Parent")
    parent.scale = (float(draw.uniform(0.6, 1.4)), 1.0, float(draw.uniform(0.6, 1.0)))
    rig.box.parent, rig.box.rotation_euler = parent, tuple(draw.uniform(0.2, 1.0, 3))


def _scaled_scene(rig: Rig, draw: Draw) -> None:
    """Everything smaller or larger, light and camera too."""
    parent = _empty(rig, "Scale")
    factor = float(draw.choice([0.02, 0.2, 20.0]))
    for item in (rig.target, rig.box, rig.floor, rig.light, rig.camera):
        item.parent = parent
    parent.scale = (factor,) * 3
    rig.light.data.energy *= factor**2
    rig.camera.data.clip_start, rig.camera.data.clip_end = 0.01 * factor, 1000.0 * factor
    if hasattr(rig.light.data, "shadow_soft_size"):
        rig.light.data.shadow_soft_size *= factor


def _stretched_lamp(rig: Rig, draw: Draw) -> None:
    rig.light.scale = tuple(draw.uniform(0.5, 2.0, 3))


def _mirrored_lamp(rig: Rig, _: Draw) -> None:
    rig.light.scale = (-1.0, 1.0, 1.0)


def _glowing_mesh(size: float, *, inwards: bool) -> Any:
    def put(rig: Rig, draw: Draw) -> None:
        """A box that glows: around everything, or a lamp inside out."""
        bpy.ops.mesh.primitive_cube_add(size=size, location=(0.0, 0.0, 0.0 if size > 1.0 else 3.5))
        item = bpy.context.object
        item.data.materials.append(rig.box.data.materials[0].copy())
        principled(item).inputs["Alpha"].default_value = 1.0  # a note says that Alpha does not dim a glow
        principled(item).inputs["Emission Strength"].default_value = float(draw.uniform(0.2, 1.0)) / min(size, 1.0) ** 2
        if inwards:
            item.data.flip_normals()

    return put


def _slot_of_object(rig: Rig, draw: Draw) -> None:
    other = rig.box.data.materials[0].copy()
    rig.box.material_slots[0].link = "OBJECT"
    rig.box.material_slots[0].material = other
    node = next(node for node in other.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    node.inputs["Base Color"].default_value = (*draw.uniform(0.1, 0.9, 3), 1.0)


def _two_materials(rig: Rig, _: Draw) -> None:
    rig.target.data.materials.append(rig.box.data.materials[0])
    for polygon in rig.target.data.polygons:
        polygon.material_index = int(polygon.center.z > 0.2)


def _border(rig: Rig, draw: Draw) -> None:
    """A region with half of the frame or more in each direction, so that the target is in it."""
    render = rig.scene.render
    render.use_border, render.use_crop_to_border = True, bool(draw.random() < 0.5)
    render.border_min_x, render.border_min_y = draw.uniform(0.0, 0.25, 2)
    render.border_max_x, render.border_max_y = draw.uniform(0.75, 1.0, 2)


def _vertical_sensor(rig: Rig, draw: Draw) -> None:
    rig.camera.data.sensor_fit, rig.camera.data.sensor_height = "VERTICAL", float(draw.uniform(20.0, 40.0))


def _clipped(rig: Rig, _: Draw) -> None:
    """Near clipping inside the ball, so that its inside is seen."""
    rig.camera.data.clip_start = 5.6


def _depth_of_field(rig: Rig, draw: Draw) -> None:
    dof = rig.camera.data.dof
    dof.use_dof, dof.focus_distance, dof.aperture_fstop = True, float(draw.uniform(4.0, 7.0)), 0.4


def _modifier(kind: str, **values: Any) -> Any:
    def put(rig: Rig, _: Draw) -> None:
        made = rig.box.modifiers.new(kind.title(), kind)
        for name, value in values.items():
            setattr(made, name, value)

    return put


def _particles(rig: Rig, draw: Draw) -> None:
    """Boxes on the floor by a particle system."""
    system = rig.floor.modifiers.new("Particles", "PARTICLE_SYSTEM").particle_system
    made = system.settings
    made.type, made.count, made.use_advanced_hair = "HAIR", 8, True
    made.render_type, made.instance_object = "OBJECT", rig.box
    made.particle_size = float(draw.uniform(0.05, 0.1))
    system.seed = int(draw.integers(100))


def _on_faces(rig: Rig, _: Draw) -> None:
    """The floor's faces carry copies of the box, and the floor itself is not rendered as the instancer."""
    carrier = rig.floor.copy()
    carrier.data = rig.floor.data.copy()
    rig.scene.collection.objects.link(carrier)
    carrier.location, carrier.scale = (0.5, 1.5, 0.2), (0.1, 0.1, 0.1)
    carrier.instance_type, carrier.show_instancer_for_render = "FACES", False
    rig.box.parent = carrier


def _curve(rig: Rig, draw: Draw) -> None:
    made = bpy.data.curves.new("Wire", "CURVE")
    made.dimensions, made.bevel_depth = "3D", float(draw.uniform(0.05, 0.2))
    made.resolution_u, made.render_resolution_u = 2, 8
    spline = made.splines.new("BEZIER")
    spline.bezier_points.add(1)
    for point, place in zip(spline.bezier_points, ((-1.5, -1.2, 0.3), (1.5, -1.0, 0.8)), strict=True):
        point.co, point.handle_left_type, point.handle_right_type = place, "AUTO", "AUTO"
    item = bpy.data.objects.new("Wire", made)
    made.materials.append(rig.box.data.materials[0])
    rig.scene.collection.objects.link(item)


def _text(rig: Rig, _: Draw) -> None:
    made = bpy.data.curves.new("Text", "FONT")
    made.body, made.extrude, made.size = "M", 0.1, 1.2
    item = bpy.data.objects.new("Text", made)
    item.location, item.rotation_euler = (0.8, -1.2, 0.1), (math.pi / 2, 0.0, 0.0)
    made.materials.append(rig.box.data.materials[0])
    rig.scene.collection.objects.link(item)


def _metaball(rig: Rig, draw: Draw) -> None:
    made = bpy.data.metaballs.new("Blob")
    made.resolution, made.render_resolution = 0.4, 0.15
    made.elements.new().radius = float(draw.uniform(0.8, 1.2))
    item = bpy.data.objects.new("Blob", made)
    item.location = (1.4, -0.8, 0.4)
    made.materials.append(rig.box.data.materials[0])
    rig.scene.collection.objects.link(item)


def _simplified(rig: Rig, _: Draw) -> None:
    rig.scene.render.use_simplify, rig.scene.render.simplify_subdivision_render = True, 1
    modifier = rig.box.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 2, 3


def _hidden(rig: Rig, draw: Draw) -> None:
    """Hidden in the viewport and not in the render, or the other way round."""
    if draw.random() < 0.5:
        rig.box.hide_render = True
    else:
        rig.box.hide_viewport = True


def _shape_key(rig: Rig, draw: Draw) -> None:
    rig.box.shape_key_add(name="Basis")
    key = rig.box.shape_key_add(name="Tall")
    for point in key.data:
        point.co.z *= 1.8
    key.value = float(draw.uniform(0.3, 1.0))


def _world_group(rig: Rig, draw: Draw) -> None:
    """A colour from a node group, and a Background mixed for the camera."""
    group = bpy.data.node_groups.new("Inside", "ShaderNodeTree")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    color, output = group.nodes.new("ShaderNodeRGB"), group.nodes.new("NodeGroupOutput")
    color.outputs[0].default_value = (*draw.uniform(0.2, 1.0, 3), 1.0)
    group.links.new(color.outputs[0], output.inputs[0])
    tree = rig.scene.world.node_tree
    node = tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    tree.links.new(node.outputs[0], background(rig.scene.world).inputs["Color"])


def _world_for_camera(rig: Rig, draw: Draw) -> None:
    tree = rig.scene.world.node_tree
    output = next(node for node in tree.nodes if node.type == "OUTPUT_WORLD")
    other, path, mix = (tree.nodes.new(f"ShaderNode{k}") for k in ("Background", "LightPath", "MixShader"))
    other.inputs["Color"].default_value = (*draw.uniform(0.0, 0.5, 3), 1.0)
    tree.links.new(path.outputs["Is Camera Ray"], mix.inputs[0])
    tree.links.new(background(rig.scene.world).outputs[0], mix.inputs[1])
    tree.links.new(other.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])


def _color_attribute(rig: Rig, draw: Draw) -> None:
    made = rig.box.data.color_attributes.new("Col", "FLOAT_COLOR", "CORNER")
    values = np.ones((len(rig.box.data.loops), 4), np.float32)
    values[:, :3] = np.repeat(draw.uniform(0.1, 0.9, (len(rig.box.data.loops) // 4, 3)), 4, axis=0)
    made.data.foreach_set("color", values.ravel())
    tree = rig.box.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeVertexColor")
    node.layer_name = "Col"
    tree.links.new(node.outputs["Color"], principled(rig.box).inputs["Base Color"])


def bumped_box(rig: Rig, _: Draw) -> None:
    """Waves as a bump on the box."""
    tree = rig.box.data.materials[0].node_tree
    waves, bump = tree.nodes.new("ShaderNodeTexWave"), tree.nodes.new("ShaderNodeBump")
    waves.inputs["Scale"].default_value, bump.inputs["Distance"].default_value = 1.0, 0.1
    tree.links.new(waves.outputs["Fac"], bump.inputs["Height"])
    tree.links.new(bump.outputs["Normal"], principled(rig.box).inputs["Normal"])


def displaced(draw: Draw, item: Any, method: str) -> None:
    """Waves on Displacement of an object's material, over enough faces to move."""
    tree = item.data.materials[0].node_tree
    waves, moved = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeDisplacement")
    waves.inputs["Scale"].default_value = float(draw.uniform(1.0, 3.0))
    moved.inputs["Scale"].default_value = float(draw.uniform(0.05, 0.4))
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], waves.inputs["Vector"])
    tree.links.new(waves.outputs[0], moved.inputs["Height"])
    tree.links.new(moved.outputs[0], tree.get_output_node("CYCLES").inputs["Displacement"])
    item.data.materials[0].displacement_method = method
    divided = item.modifiers.new("Divided", "SUBSURF")
    divided.subdivision_type, divided.levels = "SIMPLE", 0
    divided.render_levels = 4 if len(item.data.polygons) < 100 else 1


def _displaced_target(rig: Rig, draw: Draw) -> None:
    displaced(draw, rig.target, str(draw.choice(["BUMP", "DISPLACEMENT", "BOTH"])))


def _displaced_box(rig: Rig, draw: Draw) -> None:
    displaced(draw, rig.box, "DISPLACEMENT")


def _normal_map(rig: Rig, draw: Draw) -> None:
    """A floor of waves that is seen from the side: some normals turn away from the camera."""
    tree = rig.floor.data.materials[0].node_tree
    where, waves, join, bent = (
        tree.nodes.new(f"ShaderNode{k}") for k in ("TexCoord", "VectorMath", "Mix", "NormalMap")
    )
    waves.operation = "SINE"
    scaled = tree.nodes.new("ShaderNodeVectorMath")
    scaled.operation, scaled.inputs["Scale"].default_value = "SCALE", float(draw.uniform(2.0, 6.0))
    tree.links.new(where.outputs["Object"], scaled.inputs[0])
    tree.links.new(scaled.outputs[0], waves.inputs[0])
    join.data_type, join.inputs[0].default_value = "VECTOR", float(draw.uniform(0.1, 0.35))
    join.inputs[4].default_value = (0.5, 0.5, 1.0)
    tree.links.new(waves.outputs[0], join.inputs[5])
    tree.links.new(join.outputs[1], bent.inputs["Color"])
    tree.links.new(bent.outputs[0], principled(rig.floor).inputs["Normal"])


def _smooth_beside_flat(rig: Rig, draw: Draw) -> None:
    """One side of ball and box is smooth and the other flat, as Booleans leave them."""
    edge = float(draw.uniform(-0.3, 0.3))
    for item in (rig.target, rig.box):
        for polygon in item.data.polygons:
            polygon.use_smooth = polygon.center.x > edge


def _far_away(rig: Rig, draw: Draw) -> None:
    """Everything in a corner of a map."""
    parent = _empty(rig, "Far")
    for item in (rig.target, rig.box, rig.floor, rig.light, rig.camera):
        if item.parent is None:
            item.parent = parent
    parent.location = (float(draw.uniform(50.0, 2000.0)), float(draw.uniform(-2000.0, 2000.0)), 0.0)


def _layer_attribute(rig: Rig, draw: Draw) -> None:
    rig.scene["tint"] = tuple(draw.uniform(0.1, 0.9, 3))
    tree = rig.box.data.materials[0].node_tree
    node = tree.nodes.new("ShaderNodeAttribute")
    node.attribute_type, node.attribute_name = "VIEW_LAYER", "tint"
    tree.links.new(node.outputs["Color"], principled(rig.box).inputs["Base Color"])


def _lamp_nodes(rig: Rig, draw: Draw) -> None:
    data: Any = rig.light.data
    if data.node_tree is None:
        data.use_nodes = True
    tree: Any = data.node_tree
    node = next(node for node in tree.nodes if node.type == "EMISSION")
    node.inputs["Color"].default_value = (*draw.uniform(0.3, 1.0, 3), 1.0)
    node.inputs["Strength"].default_value = float(draw.uniform(0.5, 2.0))


def _custom_normals(rig: Rig, _: Draw) -> None:
    mesh = rig.box.data
    mesh.normals_split_custom_set([(0.6, -0.6, 0.52)] * len(mesh.loops))


def _linked_light(rig: Rig, _: Draw) -> None:
    linking = getattr(rig.light, "light_linking", None)
    if linking is not None:
        made = bpy.data.collections.new("Lit")
        made.objects.link(rig.floor)
        linking.receiver_collection = made


def _motion_blur(rig: Rig, _: Draw) -> None:
    rig.scene.render.use_motion_blur = True
    for frame, x in ((0, -0.6), (2, 0.6)):
        rig.box.location.x = -1.4 + x
        rig.box.keyframe_insert("location", frame=frame)
    rig.scene.frame_set(1)


def _two_sided_target(rig: Rig, _: Draw) -> None:
    """Half a ball, whose inside is in view."""
    mesh = rig.target.data
    import bmesh  # pyright: ignore[reportMissingImports]

    cut = bmesh.new()
    cut.from_mesh(mesh)
    bmesh.ops.delete(cut, geom=[v for v in cut.verts if v.co.y < -0.35], context="VERTS")
    cut.to_mesh(mesh)
    cut.free()


def _delta(rig: Rig, draw: Draw) -> None:
    rig.box.delta_location, rig.box.delta_scale = (0.3, 0.0, 0.3), tuple(draw.uniform(0.5, 1.2, 3))
    rig.box.matrix_parent_inverse = Matrix.Translation((0.0, 0.2, 0.0))


def _stack(rig: Rig, draw: Draw) -> None:
    """Clear panes before the ball, as many as light passes or more."""
    rig.scene.cycles.transparent_max_bounces = int(draw.integers(0, 5))
    pane = rig.floor.copy()
    pane.modifiers.clear()  # panes with the same particles would have faces in one plane
    pane.data = rig.floor.data.copy()
    material = rig.floor.data.materials[0].copy()
    pane.data.materials[0] = material
    node = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    node.inputs["Alpha"].default_value = 0.3
    pane.scale, pane.rotation_euler = (0.1, 0.1, 0.1), (math.pi / 2, 0.0, 0.0)
    rig.scene.collection.objects.link(pane)
    for k in range(int(draw.integers(1, 5))):
        other = pane.copy()
        other.location = (0.3, -1.6 - 0.1 * k, 1.2)
        rig.scene.collection.objects.link(other)
    bpy.data.objects.remove(pane)


def _background_set(rig: Rig, _: Draw) -> None:
    """The box and a lamp of another scene."""
    other = bpy.data.scenes.new("Set")
    for owner in list(rig.box.users_collection):
        owner.objects.unlink(rig.box)
    other.collection.objects.link(rig.box)
    lamp = bpy.data.objects.new("Other", bpy.data.lights.new("Other", "POINT"))
    lamp.data.energy, lamp.location = 200.0, (-3.0, -2.0, 2.0)
    other.collection.objects.link(lamp)
    rig.scene.background_set = other


def _all() -> Iterator[Setting]:
    exported = {
        "sheared": _sheared, "scaled scene": _scaled_scene, "stretched lamp": _stretched_lamp,
        "glowing room": _glowing_mesh(40.0, inwards=False), "lamp inside out": _glowing_mesh(0.5, inwards=True),
        "mirrored lamp": _mirrored_lamp, "slot of object": _slot_of_object, "two materials": _two_materials,
        "render border": _border, "vertical sensor": _vertical_sensor,
        "clipped": _clipped, "particles": _particles, "on faces": _on_faces,
        "curve": _curve, "text": _text, "metaball": _metaball, "simplified": _simplified, "hidden": _hidden,
        "shape key": _shape_key, "world group": _world_group, "world for camera": _world_for_camera,
        "color attribute": _color_attribute, "lamp nodes": _lamp_nodes,
        "two-sided target": _two_sided_target, "stack": _stack, "background set": _background_set, "delta": _delta,
        "mirror modifier": _modifier("MIRROR", use_axis=(False, False, True), use_bisect_axis=(False, False, True)),
        "array modifier": _modifier("ARRAY", count=2, relative_offset_displace=(1.2, 0.3, 0.0)),
        "bevel modifier": _modifier("BEVEL", width=0.2, segments=3),
        "bumped box": bumped_box, "normal map": _normal_map, "smooth beside flat": _smooth_beside_flat,
        "far away": _far_away, "layer attribute": _layer_attribute,
        "displaced target": _displaced_target, "displaced box": _displaced_box,
        "solidify modifier": _modifier("SOLIDIFY", thickness=0.1),
    }  # fmt: skip
    yield from (Setting(name, put) for name, put in exported.items())
    yield Setting("depth of field", _depth_of_field, ("depth of field is left out",))
    yield Setting("custom normals", _custom_normals, ("has custom normals",))
    yield Setting("faces twice", _modifier("MIRROR", use_axis=(True, True, False)), ("twice in the same place",))
    yield Setting("linked light", _linked_light, ("Light linking",))
    yield Setting("motion blur", _motion_blur, ("Motion blur",))


ARTIST_SETTINGS = tuple(_all())
