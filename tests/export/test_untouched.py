# SPDX-License-Identifier: Apache-2.0
"""An export, done or refused, leaves the .blend as it was."""

from __future__ import annotations

import difflib
import hashlib
import pprint
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.job import ExportError, check_export, export_job

from .scenes import add_camera, add_light, add_quad, diffuse_material, new_material, world_color

SKIPPED = {
    "rna_type",
    "original",
    "is_evaluated",
    "session_uid",
    "tag",
    "preview",
    "bound_box",
    "bindcode",
    "pixels",
    "use_nodes",
    "uv_sculpt",  # reading it crashes Blender 4.2
}


def describe(value: Any, depth: int = 0) -> Any:
    """A text of every readable property below `value`, three levels deep."""
    if isinstance(value, bpy.types.bpy_prop_collection):
        return [describe(item, depth) for item in value]
    if isinstance(value, bpy.types.bpy_struct):
        if depth > 2 or (depth and isinstance(value, bpy.types.ID)):
            return getattr(value, "name", type(value).__name__)
        found = {}
        for name in value.bl_rna.properties.keys():  # noqa: SIM118
            if name not in SKIPPED and not name.startswith("is_runtime"):
                try:
                    found[name] = describe(getattr(value, name), depth + 1)
                except (AttributeError, TypeError, RuntimeError):
                    continue
        return found
    if hasattr(value, "__len__") and not isinstance(value, str):
        return [repr(item) for item in value]
    return repr(value)


def fingerprint() -> dict[str, str]:
    """A text for each datablock, the view layer and the mode."""
    blocks = {
        f"{group}/{item.name_full}": describe(item)
        for group in ("scenes", "objects", "meshes", "materials", "lights", "cameras", "worlds", "images",
                      "collections", "curves", "metaballs", "node_groups", "textures")
        for item in getattr(bpy.data, group)
    }  # fmt: skip
    layer = bpy.context.view_layer
    blocks["selection"] = [(item.name, item.select_get(), item.hide_get()) for item in layer.objects]
    blocks["active"] = (layer.objects.active and layer.objects.active.name, bpy.context.mode)
    blocks["layers"] = describe(layer.layer_collection)
    blocks["dirty"] = (bpy.data.is_dirty, bpy.data.filepath)
    blocks["pixels"] = [hashlib.sha256(np.array(image.pixels).tobytes()).hexdigest() for image in bpy.data.images]
    return {name: pprint.pformat(block) for name, block in blocks.items()}


def changes(before: dict[str, str], after: dict[str, str]) -> list[str]:
    """The lines that differ, with the name of their datablock."""
    found = list(before.keys() ^ after.keys())
    for name in before.keys() & after.keys():
        lines = (
            difflib.ndiff(before[name].splitlines(), after[name].splitlines()) if before[name] != after[name] else ()
        )
        found += [f"{name}: {line}" for line in lines if line[0] in "+-"]
    return found


@pytest.fixture
def target(scene: Any) -> Any:
    """A scene that makes the exporter touch all it can: modifiers, hidden things, curves, pictures, simplify."""
    world_color(scene, 1.0)
    add_camera("ORTHO", ortho_scale=4.0)
    add_light("AREA")
    material = new_material("Target")
    image = bpy.data.images.new("Picture", 4, 4)
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    principled = material.node_tree.get_output_node("CYCLES").inputs["Surface"].links[0].from_node
    material.node_tree.links.new(node.outputs["Color"], principled.inputs["Base Color"])
    target = add_quad("Target", 1.0, 0.0, material)
    for levels, render_levels in ((1, 2), (3, 1)):
        modifier = target.modifiers.new("Subdivision", "SUBSURF")
        modifier.levels, modifier.render_levels = levels, render_levels
    target.modifiers.new("Off", "ARRAY").show_render = False
    for index in range(4):
        add_quad(f"Part {index}", 0.3, -1.0, diffuse_material("d", (1, 1, 1)))
    parts = bpy.data.objects
    parts["Part 0"].hide_render = True
    parts["Part 1"].hide_viewport = True
    parts["Part 2"].hide_set(True)
    parts["Part 3"].select_set(True)
    collection = bpy.data.collections.new("Closed")
    scene.collection.children.link(collection)
    collection.hide_viewport = True
    excluded = bpy.data.collections.new("Excluded")
    scene.collection.children.link(excluded)
    excluded.objects.link(bpy.data.objects.new("Nowhere", bpy.data.meshes.new("Nowhere")))
    bpy.context.view_layer.layer_collection.children["Excluded"].exclude = True
    bpy.ops.curve.primitive_bezier_circle_add(location=(0, 0, -3))
    curve = bpy.context.object.data
    curve.bevel_depth, curve.render_resolution_u = 0.1, 3
    curve.splines[0].resolution_u = 7
    scene.render.use_simplify, scene.render.simplify_subdivision = True, 4
    bpy.ops.object.metaball_add(location=(0, 0, -3))
    bpy.context.view_layer.objects.active = target
    target.select_set(True)
    return target


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_nothing_changes(mode: str, target: Any, tmp_path: Path) -> None:
    path = tmp_path / "scene.blend"
    if mode == "OBJECT":
        bpy.ops.wm.save_as_mainfile(filepath=str(path))
        target = bpy.data.objects["Target"]
    bpy.ops.object.mode_set(mode=mode)
    # in Edit Mode the mesh data lag behind the edit until something flushes it: saving, rendering, an export
    target.update_from_editmode()
    bpy.context.view_layer.update()
    before = fingerprint()
    report = export_job(bpy.context, target, tmp_path / "job", reference=None, fit={})
    assert (report.folder / "meshes" / "target.ply").exists()
    check_export(bpy.context, target)
    assert changes(before, fingerprint()) == []


def test_nothing_changes_when_it_is_refused(target: Any, tmp_path: Path) -> None:
    bpy.context.scene.world = None
    bpy.data.lights[0].energy = 0.0
    bpy.context.view_layer.update()
    before = fingerprint()
    with pytest.raises(ExportError, match="no light"):
        export_job(bpy.context, target, tmp_path / "job", reference=None, fit={})
    assert changes(before, fingerprint()) == []


def test_addon_never_imports_a_renderer() -> None:
    """The files of the add-on name no module but Blender's, numpy and the standard library."""
    import ast
    import sys

    root = Path(__file__).resolve().parents[2] / "blender_addon"
    blender = {"bpy", "_cycles", "mathutils", "bpy_extras", "gpu", "blf", "gpu_extras"}
    allowed = blender | {"numpy"} | set(sys.stdlib_module_names)
    for path in [*(root / "export").rglob("*.py"), root / "versions.py"]:
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and not node.level:
                names = [node.module or ""]
            assert {name.split(".")[0] for name in names} <= allowed, path
