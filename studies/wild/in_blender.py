# SPDX-License-Identifier: Apache-2.0
"""Blender's part of the study: what the export says of each material of a file, and a recovery prepared from it.

    python -m studies.wild.in_blender read FILE
    python -m studies.wild.in_blender prepare FILE --object NAME --slot N --view N --seed N --out DIR
        [--size 96] [--inside]
    python -m studies.wild.in_blender render FILE --out EXR --seed N [--samples 64]

Needs bpy. The answer is the last line of stdout, one JSON object.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import random
import shutil
import sys
from pathlib import Path
from typing import Any

import bpy
from mathutils import Vector  # pyright: ignore[reportMissingImports]

from blender_addon.export.job import export_findings
from blender_addon.headless import _open

from .rows import UNSEEN, how_read

# values of reflecting shaders that are moved for the start, with the range they are drawn from
MOVED = {
    "Base Color": (0.1, 0.9),
    "Color": (0.1, 0.9),
    "Roughness": (0.2, 0.8),
    "Metallic": (0.0, 0.6),
}
OWN = -1  # the view of the file's own camera; others are those of VIEWS
# from where a camera looks that the study has to add
VIEWS = [Vector(v) for v in ((0.6, -1.0, 0.5), (-0.6, 1.0, 0.5), (1.0, 0.6, -0.5), (-1.0, -0.6, -0.5), (0.1, 0.0, 1.0))]
CANDIDATES = 4  # objects of a material that are tried, the largest first
FIELD = 40.0  # degrees, of that camera
LEAST_SHARE = 0.05  # of the frame's width and height that a target's bounds must span


def read(path: Path) -> dict[str, Any]:
    """What the export says of every material on a rendered mesh of a file, each once, where a camera sees it best.

    The file's own camera comes first, over the material's objects from large to small, then cameras around them.
    """
    _open(path)
    context = bpy.context
    own = context.scene.camera
    rows = []
    for material, users in sorted(_users(context).items(), key=lambda item: item[0].name):
        rows.append({"material": material.name, "sort": _sort(material)})
        rows[-1] |= {"errors": [f"{UNSEEN} '{material.name}': it is nowhere."], "notes": []}
        for view, (obj, slot) in [(v, user) for v in (OWN, *range(len(VIEWS))) for user in users]:
            context.scene.camera = own
            obj.active_material_index = slot
            if not _look_at(context.scene, obj, view):
                continue
            findings = export_findings(context, obj)
            rows[-1] |= {"object": obj.name, "slot": slot, "view": view}
            rows[-1] |= {"errors": findings.errors, "notes": findings.left_out}
            if how_read(rows[-1]) != "not seen":
                break
    return {"version": list(bpy.data.version), "engine": context.scene.render.engine, "materials": rows}


def prepare(chosen: argparse.Namespace) -> dict[str, Any]:
    """Render the reference and a picture of other noise; save the file with other values on the material."""
    _open(chosen.file)
    scene, obj = bpy.context.scene, bpy.data.objects[chosen.object]
    obj.active_material_index = chosen.slot
    material = obj.material_slots[chosen.slot].material
    _look_at(scene, obj, chosen.view)
    _make_small(scene, chosen.size)
    chosen.out.mkdir(parents=True, exist_ok=True)
    for name, seed in (("reference", 0), ("floor", 1)):
        _render(scene, chosen.out / f"{name}.exr", chosen.samples, seed)
    draw = random.Random(chosen.seed)
    moved = _move_values(material, draw) + (_move_inside(material, draw) if chosen.inside else [])
    _render(scene, chosen.out / "before.exr", chosen.samples, 2)
    bpy.ops.wm.save_as_mainfile(filepath=str(chosen.out / "start.blend"), copy=True, relative_remap=True)
    return {"moved": moved}


def render(chosen: argparse.Namespace) -> dict[str, Any]:
    """Render a saved file as `prepare` did."""
    _open(chosen.file)
    _render(bpy.context.scene, chosen.out, chosen.samples, chosen.seed)
    return {}


def _users(context: bpy.types.Context) -> dict[bpy.types.Material, list[tuple[bpy.types.Object, int]]]:
    """Materials of rendered meshes, each with the slots of the largest objects that have faces of it."""
    found: dict[bpy.types.Material, list[tuple[bpy.types.Object, int]]] = {}
    meshes = [o for o in context.view_layer.objects if o.type == "MESH" and not o.hide_render and o.data.polygons]
    for obj in sorted(meshes, key=lambda obj: -obj.dimensions.length):
        used = {polygon.material_index for polygon in obj.data.polygons}
        for slot, entry in enumerate(obj.material_slots):
            if entry.material is not None and slot in used:
                found.setdefault(entry.material, []).append((obj, slot))
    return {material: users[:CANDIDATES] for material, users in found.items()}


def _sort(material: bpy.types.Material) -> str:
    """The shader at the output: `principled`, `mix`, `emission`, another node's type, or `none`."""
    tree = material.node_tree
    output = tree.get_output_node("CYCLES") if tree else None
    links = output.inputs["Surface"].links if output else ()
    if not links:
        return "none"
    kind = str(links[0].from_node.bl_idname).removeprefix("ShaderNode").removeprefix("Bsdf").lower()
    return {"mixshader": "mix", "addshader": "mix"}.get(kind, kind)


def _look_at(scene: bpy.types.Scene, obj: bpy.types.Object, view: int) -> bool:
    """Give the scene the camera of a view; False where it is the file's own and does not show enough of the object."""
    corners = [obj.matrix_world @ Vector(corner) for corner in obj.bound_box]
    if not all(math.isfinite(x) for corner in corners for x in corner):
        return False
    if view == OWN:
        return scene.camera is not None and scene.camera.type == "CAMERA" and _spans(scene, corners)
    centre = sum(corners, Vector()) / len(corners)
    radius = max((corner - centre).length for corner in corners) or 1.0
    camera = bpy.data.objects.new("Study Camera", bpy.data.cameras.new("Study Camera"))
    _link(scene, camera)
    camera.data.angle = FIELD * 3.14159265 / 180
    camera.data.clip_start, camera.data.clip_end = radius * 0.01, radius * 100
    direction = VIEWS[view].normalized()
    camera.location = centre + direction * radius * 2.6
    camera.rotation_euler = direction.to_track_quat("Z", "Y").to_euler()
    scene.camera = camera
    if not any(o.type == "LIGHT" and not o.hide_render for o in scene.objects) and scene.world is None:
        sun = bpy.data.objects.new("Study Sun", bpy.data.lights.new("Study Sun", "SUN"))
        sun.data.energy = 3.0
        sun.rotation_euler = (0.6, 0.3, 0.5)
        _link(scene, sun)
    bpy.context.view_layer.update()
    return True


def _link(scene: bpy.types.Scene, obj: bpy.types.Object) -> None:
    """Put an object into the scene, also where the scene's own collection comes from another file."""
    collections = (scene.collection, *scene.collection.children_recursive)
    own = next((c for c in collections if c.library is None and not scene.library), None)
    (own or scene.collection).objects.link(obj)


def _spans(scene: bpy.types.Scene, corners: list[Vector]) -> bool:
    """Whether the bounds of an object fill enough of the frame, and no corner is behind the camera."""
    from bpy_extras.object_utils import world_to_camera_view  # pyright: ignore[reportMissingImports]

    if abs(scene.camera.matrix_world.determinant()) < 1e-12:
        return False
    seen = [world_to_camera_view(scene, scene.camera, corner) for corner in corners]
    if any(point.z <= 0 for point in seen):
        return False
    return all(
        min(max(getattr(p, axis) for p in seen), 1.0) - max(min(getattr(p, axis) for p in seen), 0.0) >= LEAST_SHARE
        for axis in "xy"
    )


def _make_small(scene: bpy.types.Scene, size: int) -> None:
    settings = scene.render
    sides = settings.resolution_x, settings.resolution_y
    settings.resolution_x, settings.resolution_y = (max(8, round(side * size / max(sides))) for side in sides)
    settings.resolution_percentage = 100
    settings.pixel_aspect_x = settings.pixel_aspect_y = 1.0  # as the pictures of a job, which `mfo judge` compares


def _move_values(material: bpy.types.Material, draw: random.Random) -> list[str]:
    """Give unlinked values of every reflecting shader of the material others; returns which."""
    moved = []
    for node in material.node_tree.nodes if material.node_tree else ():
        if not node.bl_idname.startswith("ShaderNodeBsdf") or node.bl_idname == "ShaderNodeBsdfTransparent":
            continue
        for name, (low, high) in MOVED.items():
            socket = node.inputs.get(name)
            if socket is None or socket.is_linked:
                continue
            drawn = [draw.uniform(low, high) for _ in range(3)]
            socket.default_value = (*drawn, 1.0) if socket.type == "RGBA" else drawn[0]
            moved.append(name)
    return moved


def _move_inside(material: bpy.types.Material, draw: random.Random) -> list[str]:
    """Give factors of mixes, a stop of each ramp, strengths of bumps and RGB nodes other values; returns which."""
    moved = []
    for node in material.node_tree.nodes if material.node_tree else ():
        kind = node.bl_idname.removeprefix("ShaderNode")
        if kind in ("MixShader", "MixRGB", "Mix"):
            factor = node.inputs[0]
            if factor.type != "VALUE" or factor.is_linked or not 0.0 < factor.default_value < 1.0:
                continue
            factor.default_value = draw.uniform(0.2, 0.8)
        elif kind == "ValToRGB":
            stop = draw.choice(list(node.color_ramp.elements))
            stop.color = [*(min(c * draw.uniform(0.6, 1.4) + draw.uniform(0.0, 0.1), 1.0) for c in stop.color[:3]), 1.0]
        elif kind in ("Bump", "NormalMap"):
            strength = node.inputs["Strength"]
            if strength.is_linked:
                continue
            strength.default_value = min(strength.default_value * draw.uniform(0.4, 1.3), 1.0)
        elif kind == "RGB":
            node.outputs[0].default_value = [*(draw.uniform(0.1, 0.9) for _ in range(3)), 1.0]
        else:
            continue
        moved.append(f"{node.name} (inside)")
    return moved


def _render(scene: bpy.types.Scene, out: Path, samples: int, seed: int) -> None:
    scene.render.engine = "CYCLES"
    cycles, settings = scene.cycles, scene.render.image_settings
    cycles.samples, cycles.seed, cycles.use_adaptive_sampling, cycles.use_denoising = samples, seed, False, False
    cycles.device = "CPU"
    scene.render.use_compositing = scene.render.use_sequencer = False
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGBA"
    scene.render.use_border = False
    scene.render.filepath, scene.render.use_file_extension = str(out.absolute()), False
    bpy.ops.render.render(write_still=True)


def main() -> None:
    """Do one command and leave at once."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=["read", "prepare", "render"])
    parser.add_argument("file", type=Path)
    parser.add_argument("--object", default="")
    parser.add_argument("--slot", type=int, default=0)
    parser.add_argument("--view", type=int, default=OWN)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size", type=int, default=96)
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--inside", action="store_true")
    parser.add_argument("--out", type=Path, default=Path())
    chosen = parser.parse_args()
    answer = {"read": lambda: read(chosen.file), "prepare": lambda: prepare(chosen), "render": lambda: render(chosen)}
    print("\n" + json.dumps(answer[chosen.command]()), flush=True)
    shutil.rmtree(bpy.app.tempdir, ignore_errors=True)
    sys.stdout.flush()
    os._exit(0)  # Blender's destructors may wait for ever after a render


if __name__ == "__main__":
    main()
