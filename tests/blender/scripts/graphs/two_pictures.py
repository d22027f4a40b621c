# SPDX-License-Identifier: Apache-2.0
"""Inside Blender: the colours inside a ball's nodes from two listed pictures, with the real backend; apply and undo."""

import json
import sys
from pathlib import Path

import bpy
import mathutils

folder = Path(sys.argv[sys.argv.index("--") + 1])
TRUTH = [(0.8, 0.1, 0.05), (0.05, 0.2, 0.7), 0.3]  # of both stops, and the roughness
START = [(0.4, 0.4, 0.4), (0.4, 0.4, 0.4), 0.6]
NAMES = "Roughness, Color Ramp/Stop 0, Color Ramp/Stop 1"


def nodes():
    return bpy.data.objects["Ball"].active_material.node_tree.nodes


def rough():
    return next(n for n in nodes() if n.type == "BSDF_PRINCIPLED").inputs["Roughness"]


def values():
    stops = nodes()["Color Ramp"].color_ramp.elements
    return [*(tuple(stop.color)[:3] for stop in stops), rough().default_value]


def put(wanted):
    for stop, color in zip(nodes()["Color Ramp"].color_ramp.elements, wanted[:2], strict=True):
        stop.color = (*color, 1.0)
    rough().default_value = wanted[2]


def build():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="bl_ext.user_default.material_fit_mfo")
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 128
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.view_settings.view_transform = "Standard"
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24)
    bpy.ops.object.shade_smooth()
    ball, material = bpy.context.object, bpy.data.materials.new("Paint")
    ball.name = "Ball"
    if material.node_tree is None:
        material.use_nodes = True
    ball.data.materials.append(material)
    tree = material.node_tree
    noise, ramp, place = (tree.nodes.new("ShaderNode" + kind) for kind in ("TexNoise", "ValToRGB", "TexCoord"))
    noise.inputs["Scale"].default_value = 2.0
    ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.4, 0.6
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    tree.links.new(place.outputs["Object"], noise.inputs["Vector"])
    tree.links.new(noise.outputs[0], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], shader.inputs["Base Color"])
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    lamp.data.energy, lamp.data.size = 400.0, 2.0
    items = {lamp: (2.0, -3.0, 4.0)}
    for name, at in (("Front", (0.0, -5.0, 1.0)), ("Side", (4.5, -2.0, 1.0))):
        items[bpy.data.objects.new(name, bpy.data.cameras.new(name))] = at
    for item, at in items.items():
        item.location = at
        item.rotation_euler = (-mathutils.Vector(at)).to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(item)
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    put(TRUTH)
    for name in ("Side", "Front"):
        scene.camera, scene.render.filepath = scene.objects[name], str(folder / f"{name}.exr")
        bpy.ops.render.render(write_still=True)
    put(START)
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "ball.blend"))


build()
settings = bpy.context.scene.mfo
settings.reference_path, settings.preset = str(folder / "Front.exr"), "fast"
assert bpy.ops.mfo.add_picture() == {"FINISHED"}
settings.pictures[0].camera, settings.pictures[0].path = bpy.data.objects["Side"], str(folder / "Side.exr")
before = values()
assert bpy.ops.mfo.fit(job_folder=str(folder / "job"), parameters=NAMES) == {"FINISHED"}
assert values() == before
bpy.ops.ed.undo_push(message="before apply")
assert bpy.ops.mfo.apply("EXEC_DEFAULT", True) == {"FINISHED"}
applied = values()
bpy.ops.ed.undo()
assert values() == before, "one step takes all back"
bpy.ops.ed.redo()
assert values() == applied
(folder / "values.json").write_text(json.dumps({"truth": TRUTH, "applied": applied}))
print("ALL GOOD")
