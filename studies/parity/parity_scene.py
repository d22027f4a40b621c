# SPDX-License-Identifier: Apache-2.0
"""Scenes of `cycles_parity.py`, run by a Python with `bpy`: build one, export it, render it twice with Cycles.

    python -m studies.parity.parity_scene MATERIAL LIGHT FOLDER --size 128 --samples 512

writes FOLDER/job and the scene-linear pictures FOLDER/cycles_0.exr and cycles_1.exr, two seeds of the same scene.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

MATERIALS: dict[str, dict[str, Any]] = {
    "rough metal": {"Base Color": (0.9, 0.6, 0.3), "Metallic": 1.0, "Roughness": 0.5, "Specular Tint": (1.0, 0.9, 0.8)},
    "coated plastic": {
        "Base Color": (0.1, 0.25, 0.6),
        "Roughness": 0.45,
        "Coat Weight": 0.8,
        "Coat Roughness": 0.2,
        "Coat Tint": (1.0, 0.85, 0.7),
    },
    "sheen cloth": {
        "Base Color": (0.35, 0.08, 0.12),
        "Roughness": 0.9,
        "Diffuse Roughness": 0.5,
        "Sheen Weight": 0.8,
        "Sheen Roughness": 0.4,
        "Sheen Tint": (1.0, 0.8, 0.7),
    },
    "glass": {"Base Color": (0.9, 0.97, 0.95), "Roughness": 0.35, "Transmission Weight": 1.0, "IOR": 1.45},
}
LIGHTS = ("point", "area", "environment")
BOUNCES = 8


def build(material: str, light: str, size: int) -> Any:
    """Make the scene of a ball on a floor; returns the ball."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    _set_up_render(scene, size)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location, camera.rotation_euler = (0.0, -5.5, 2.2), (math.radians(72), 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.mesh.primitive_plane_add(size=8.0)
    _give(bpy.context.object, "Floor", {"Base Color": (0.4, 0.4, 0.4), "Roughness": 0.7})
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=1.0, location=(0.0, 0.0, 1.05))
    ball = bpy.context.object
    for polygon in ball.data.polygons:
        polygon.use_smooth = True
    _give(ball, "Ball", MATERIALS[material])
    {"point": _point, "area": _area, "environment": _environment}[light](scene)
    return ball


def _set_up_render(scene: Any, size: int) -> None:
    scene.render.engine = "CYCLES"
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.use_compositing = scene.render.use_sequencer = False
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_indirect = cycles.sample_clamp_direct = cycles.blur_glossy = 0.0
    cycles.light_sampling_threshold = 0.0
    for kind in ("max", "diffuse", "glossy", "transmission"):
        setattr(cycles, f"{kind}_bounces", BOUNCES)


def _give(item: Any, name: str, sockets: dict[str, Any]) -> None:
    import bpy

    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # before Blender 5.0 a new material has no nodes
        material.use_nodes = True
    node = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    for socket, value in sockets.items():
        node.inputs[socket].default_value = (*value, 1.0) if isinstance(value, tuple) else value
    item.data.materials.append(material)


def _light(scene: Any, kind: str, **settings: Any) -> None:
    import bpy

    data = bpy.data.lights.new("Light", kind)
    for name, value in settings.items():
        setattr(data, name, value)
    item = bpy.data.objects.new("Light", data)
    item.location = (2.0, -2.5, 4.0)
    item.rotation_euler = (math.radians(40), 0.0, math.radians(39))
    scene.collection.objects.link(item)


def _point(scene: Any) -> None:
    _light(scene, "POINT", energy=800.0, shadow_soft_size=0.8, use_soft_falloff=False)


def _area(scene: Any) -> None:
    _light(scene, "AREA", energy=400.0, shape="RECTANGLE", size=2.5, size_y=2.0)


def _environment(scene: Any) -> None:
    import bpy

    scene.world = world = bpy.data.worlds.new("World")
    if world.node_tree is None:
        world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = next(node for node in nodes if node.type == "BACKGROUND")
    picture = nodes.new("ShaderNodeTexEnvironment")
    folder = Path(bpy.utils.system_resource("DATAFILES")) / "studiolights" / "world"
    picture.image = bpy.data.images.load(str(folder / "courtyard.exr"))
    links.new(picture.outputs["Color"], background.inputs["Color"])


def main() -> None:
    """Build, export, render."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("material", choices=MATERIALS)
    parser.add_argument("light", choices=LIGHTS)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--samples", type=int, default=512)
    chosen = parser.parse_args()
    import bpy

    from blender_addon.export.job import export_job

    ball = build(chosen.material, chosen.light, chosen.size)
    scene = bpy.context.scene
    scene.cycles.samples = chosen.samples // 2
    for seed in range(2):
        scene.cycles.seed = seed
        scene.render.filepath = str(chosen.folder / f"cycles_{seed}.exr")
        bpy.ops.render.render(write_still=True)
    reference = chosen.folder / "cycles_0.exr"
    job = export_job(bpy.context, ball, chosen.folder / "job", reference=reference, fit={})
    print("\n" + json.dumps({"notes": job.notes}))


if __name__ == "__main__":
    main()
