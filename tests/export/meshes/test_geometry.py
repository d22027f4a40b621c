# SPDX-License-Identifier: Apache-2.0
"""Meshes: transforms, slots, instances, normals, modifiers and UV, against Cycles or against known points."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest
from mathutils import Euler, Matrix

from ..load_scene import load_scene
from ..scenes import (
    add_camera,
    add_light,
    add_mesh,
    add_quad,
    diffuse_material,
    emission_material,
    new_material,
    world_color,
)


def shapes_of(mitsuba: Any, report: Any) -> dict[str, Any]:
    scene = load_scene(mitsuba, report, optimize=False)
    return {shape.id(): shape for shape in scene.shapes()}


def arrays(mitsuba: Any, shape: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corner positions (n, 3, 3), corner normals, corner UV of a loaded mesh."""
    parameters = mitsuba.traverse(shape)
    faces = np.array(parameters["faces"]).reshape(-1, 3)
    return tuple(  # type: ignore[return-value]
        np.array(parameters[name]).reshape(-1, width)[faces]
        for name, width in (("vertex_positions", 3), ("vertex_normals", 3), ("vertex_texcoords", 2))
    )


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1), (2, -0.5, -3)])
def test_transform_and_winding(scale: Any, scene: Any, export: Any, mitsuba: Any) -> None:
    world_color(scene, 1.0)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=6)
    item = bpy.context.object
    bpy.ops.object.shade_smooth()
    item.data.materials.append(new_material("Target"))
    item.matrix_world = (
        Matrix.Translation((1, 2, 3)) @ Euler((0.3, 0.4, 0.5)).to_matrix().to_4x4() @ Matrix.Diagonal((*scale, 1))
    )
    add_camera("PERSP", (1, 2, 12))
    bpy.context.view_layer.update()
    positions, normals, _ = arrays(mitsuba, shapes_of(mitsuba, export(item))["target"])
    wanted = np.array([item.matrix_world @ vertex.co for vertex in item.data.vertices])
    distance = np.linalg.norm(positions.reshape(-1, 1, 3) - wanted[None], axis=2).min(axis=1)
    assert distance.max() < 1e-5
    center = np.array([1.0, 2.0, 3.0])
    geometric = np.cross(positions[:, 1] - positions[:, 0], positions[:, 2] - positions[:, 0])
    outward = positions.mean(axis=1) - center
    assert (np.einsum("ij,ij->i", geometric, outward) > 0.0).all()
    # the normal of an ellipsoid is along (M^-T M^-1) (p - c)
    inverse = np.linalg.inv(np.array(item.matrix_world)[:3, :3])
    exact = (positions - center) @ inverse.T @ inverse
    exact /= np.linalg.norm(exact, axis=2, keepdims=True)
    # Blender's vertex normals are averages over faces of a 12x6 sphere
    assert np.einsum("ijk,ijk->ij", normals, exact).min() > 0.98
    np.testing.assert_allclose(np.linalg.norm(normals, axis=2), 1.0, atol=1e-5)


def test_slots_objects_and_names(scene: Any, export: Any, mitsuba: Any) -> None:
    """The active slot is the target; other slots, empty slots and other objects are shapes of their own."""
    world_color(scene, 1.0)
    vertices = [(x, y, 0) for y in (0, 1) for x in range(5)]
    faces = [(i, i + 1, i + 6, i + 5) for i in range(4)]
    item = add_mesh('Ö "b".<c> & d', vertices, faces, new_material("first.001"))
    item.data.materials.append(new_material('sec"ond'))
    item.data.materials.append(None)
    for index, polygon in enumerate(item.data.polygons):
        polygon.material_index = (0, 1, 2, 1)[index]
    item.active_material_index = 1
    add_quad("Other", 1.0, -1.0, diffuse_material("other", (0.1, 0.2, 0.3)))
    add_camera("ORTHO", (2, 0.5, 5), ortho_scale=6.0)
    report = export(item)
    shapes = shapes_of(mitsuba, report)
    assert report.request["target"] == {
        "shape_id": "target", "bsdf_id": "target_bsdf", "object": item.name, "material": 'sec"ond', "slot": 1,
        "node": ["Principled BSDF"], "labels": {},
    }  # fmt: skip
    assert {name: shape.face_count() for name, shape in shapes.items()} == {
        "target": 4, "shape_0001": 2, "shape_0002": 2, "shape_0003": 2
    }  # fmt: skip
    names = {entry["name"] for entry in report.request["materials"].values()}
    # from Blender 5.0 on, faces without material are Principled too
    assert names - {f"{item.name} without material"} == {"first.001", 'sec"ond'}


def test_instances_and_linked_material(scene: Any, export: Any, mitsuba: Any) -> None:
    """A collection instanced twice, mirrored once, shares the target's material."""
    world_color(scene, 1.0)
    material = new_material("Shared")
    target = add_quad("Target", 1.0, 0.0, material)
    collection = bpy.data.collections.new("Parts")
    part = add_quad("Part", 0.5, 1.0, material)
    bpy.context.collection.objects.unlink(part)
    collection.objects.link(part)
    for x, scale in ((2.0, 1.0), (-2.0, -1.0)):
        empty = bpy.data.objects.new("Instance", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
        empty.location, empty.scale = (x, 0, 0), (scale, 1, 1)
        bpy.context.collection.objects.link(empty)
    add_camera("ORTHO", (0, 0, 5), ortho_scale=6.0)
    report = export(target)
    shapes = shapes_of(mitsuba, report)
    assert sorted(shapes) == ["shape_0001", "shape_0002", "target"]
    middles = sorted(tuple(arrays(mitsuba, shapes[name])[0].mean(axis=(0, 1)).round(4)) for name in shapes)
    assert middles == [(-2.0, 0.0, 1.0), (0.0, 0.0, 0.0), (2.0, 0.0, 1.0)]
    assert list(report.request["materials"]) == ["target_bsdf"]
    for shape in shapes.values():
        assert arrays(mitsuba, shape)[1][..., 2].min() == 1.0


def test_render_levels_and_visibility(scene: Any, export: Any, mitsuba: Any) -> None:
    """Modifiers use their render settings; what the render hides is left out, what only the viewport hides is not."""
    world_color(scene, 1.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    modifier = target.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels, modifier.subdivision_type = 0, 2, "SIMPLE"
    off = target.modifiers.new("Array", "ARRAY")
    off.show_render = False
    hidden = [add_quad(f"Hidden {index}", 0.3, -1.0, None) for index in range(3)]
    hidden[0].hide_render = True
    hidden[1].hide_viewport = True
    hidden[2].hide_set(True)
    add_camera("ORTHO", (0, 0, 5), ortho_scale=6.0)
    report = export(target)
    counts = {name: shape.face_count() for name, shape in shapes_of(mitsuba, report).items()}
    assert counts == {"target": 32, "shape_0001": 2, "shape_0002": 2}
    assert (modifier.levels, off.show_viewport) == (0, True)
    assert (hidden[1].hide_viewport, hidden[2].hide_get()) == (True, True)


def test_render_levels_and_visibility_of_what_only_instances_show(scene: Any, export: Any, mitsuba: Any) -> None:
    """The same for objects and collections that no view layer has."""
    world_color(scene, 1.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    prefab, inner = bpy.data.collections.new("Prefab"), bpy.data.collections.new("Inner")
    prefab.children.link(inner)
    parts = [add_quad(f"Part {index}", 0.3, -1.0, None) for index in range(3)]
    for part, owner in zip(parts, (prefab, prefab, inner), strict=True):
        bpy.context.collection.objects.unlink(part)
        owner.objects.link(part)
    modifier = parts[0].modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels, modifier.subdivision_type = 0, 2, "SIMPLE"
    parts[1].hide_viewport = inner.hide_viewport = True
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection = "COLLECTION", prefab
    bpy.context.collection.objects.link(empty)
    add_camera("ORTHO", (0, 0, 5), ortho_scale=6.0)
    counts = sorted(shape.face_count() for shape in shapes_of(mitsuba, export(target)).values())
    assert counts == [2, 2, 2, 32]
    assert (modifier.levels, parts[1].hide_viewport, inner.hide_viewport) == (0, True, True)


def test_other_geometry_types(scene: Any, export: Any, mitsuba: Any) -> None:
    world_color(scene, 1.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth = 0.1
    bpy.ops.object.text_add(location=(0, 0, 0.5))
    bpy.ops.object.metaball_add(location=(5, 0, 0))
    bpy.ops.surface.primitive_nurbs_surface_sphere_add(location=(0, 5, 0))
    bpy.context.collection.objects.link(bpy.data.objects.new("Cloud", bpy.data.volumes.new("Cloud")))
    add_camera("ORTHO", (0, 0, 5), ortho_scale=6.0)
    report = export(target)
    assert len(shapes_of(mitsuba, report)) == 5
    assert report.notes == ("Object 'Cloud' is a Volume, which is not exported.",)


def test_text_as_target(scene: Any, export: Any, mitsuba: Any) -> None:
    world_color(scene, 1.0)
    bpy.ops.object.text_add()
    text = bpy.context.object
    text.data.extrude = 0.1
    text.data.materials.append(new_material("Target"))
    add_camera("ORTHO", (0, 0, 5), ortho_scale=6.0)
    shapes = shapes_of(mitsuba, export(text))
    assert list(shapes) == ["target"]
    assert shapes["target"].face_count() > 100


def test_custom_normals(scene: Any, export: Any, mitsuba: Any) -> None:
    world_color(scene, 1.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    wanted = np.array([(0.6, 0.0, 0.8), (0.0, 0.6, 0.8), (-0.6, 0.0, 0.8), (0.0, -0.6, 0.8)])
    target.data.normals_split_custom_set(wanted)
    add_camera("ORTHO", (0, 0, 5), ortho_scale=6.0)
    positions, normals, _ = arrays(mitsuba, shapes_of(mitsuba, export(target))["target"])
    corners = np.array([vertex.co for vertex in target.data.vertices])
    index = np.linalg.norm(positions[:, :, None] - corners, axis=3).argmin(axis=2)
    # Blender keeps custom normals as 16-bit angles
    np.testing.assert_allclose(normals, wanted[index], atol=1e-3)


def test_edit_mode_is_kept(scene: Any, export: Any, mitsuba: Any) -> None:
    world_color(scene, 1.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    add_camera("ORTHO", (0, 0, 5), ortho_scale=6.0)
    bpy.context.view_layer.objects.active = target
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.subdivide()
    report = export(target)
    assert target.mode == "EDIT"
    assert shapes_of(mitsuba, report)["target"].face_count() == 8
    bpy.ops.object.mode_set(mode="OBJECT")


@pytest.mark.parametrize("by_other", [False, True])
def test_a_mesh_that_is_edited_has_the_modifiers_of_edit_mode(
    by_other: bool, scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any
) -> None:
    """As in Cycles, also of an object that only shares its mesh with the edited one; what each does is the render's."""
    world_color(scene, 0.0)
    target = add_quad("Target", 0.1, 0.0, new_material("Target"))
    target.location = (-1.3, 1.3, 0.0)
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.7, 0.0, -2.0))
    seen = bpy.context.object
    seen.data.materials.append(emission_material("Seen", (1, 1, 1)))
    seen.shape_key_add(name="Basis")
    for point in seen.shape_key_add(name="Wide").data:
        point.co.y *= 1.4
    seen.data.shape_keys.key_blocks["Wide"].value, seen.active_shape_key_index = 1.0, 0
    off, corners, rounded = (seen.modifiers.new("Corners", "SUBSURF") for _ in range(3))
    off.levels, off.render_levels = 0, 2
    corners.levels, corners.render_levels = 1, 2
    rounded.show_in_editmode = False
    mirror = seen.modifiers.new("Mirror", "MIRROR")
    mirror.mirror_object = add_camera("ORTHO", (0, 0, 5), ortho_scale=3.0)
    mirror.show_viewport = False
    edited = seen
    if by_other:
        edited = bpy.data.objects.new("Edited", seen.data)
        edited.location, edited.use_shape_key_edit_mode = (-9.0, 0.0, 0.0), True
        scene.collection.objects.link(edited)
    scene.cycles.samples = 64
    shares = []
    for mode, sentences in (("EDIT", 1), ("OBJECT", 0)):
        bpy.context.view_layer.objects.active = edited
        edited.select_set(True)
        bpy.ops.object.mode_set(mode=mode)
        report = export(target, name=mode)
        assert sum("is in Edit Mode" in note for note in report.notes) == sentences
        assert edited.mode == mode
        shares.append(float(render_cycles().mean()))
        assert float(render_mitsuba(report).mean()) == pytest.approx(shares[-1], abs=0.002)
    assert abs(shares[1] - shares[0]) > 0.01


def test_uv_orientation(scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any) -> None:
    """An asymmetric picture on a glowing quad, with and without a Mapping node."""
    pixels = np.zeros((4, 8, 4), np.float32)
    pixels[..., 3] = 1.0
    pixels[0, :4] = (1, 0, 0, 1)  # the first row of Blender's pixels is the bottom one
    pixels[2:, 1] = (0, 1, 0, 1)
    pixels[3, 5:] = (0.2, 0.3, 1, 1)
    image = bpy.data.images.new("Picture", 8, 4, float_buffer=True)
    image.pixels.foreach_set(pixels.ravel())
    add_camera("ORTHO", ortho_scale=2.2)
    scene.cycles.samples = 16
    for index, mapped in enumerate((False, True)):
        material = emission_material(f"Shown {mapped}", (1, 1, 1))
        tree = material.node_tree
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image, node.interpolation = image, "Closest"
        emission = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeEmission")
        tree.links.new(node.outputs["Color"], emission.inputs["Color"])
        if mapped:
            coordinate, move = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeMapping")
            move.inputs["Location"].default_value = (0.125, 0.25, 0.0)
            move.inputs["Rotation"].default_value = (0.0, 0.0, np.pi / 2)
            move.inputs["Scale"].default_value = (2.0, 1.0, 1.0)
            tree.links.new(coordinate.outputs["UV"], move.inputs["Vector"])
            tree.links.new(move.outputs["Vector"], node.inputs["Vector"])
        quad = add_quad("Quad", 1.0, 0.0, material)
        quad.location.x = index - 0.5
        quad.data.uv_layers.new().uv.foreach_set("vector", [0, 0, 1, 0, 1, 1, 0, 1])
    target = add_quad("Target", 0.05, 0.0, new_material("Target"))
    target.location.y = 0.9
    expected, found = render_cycles(), render_mitsuba(export(target))
    assert expected.std() > 0.1
    wrong = np.abs(found - expected).max(axis=2) > 0.2
    # only pixels on an edge of the picture, half covered in two random ways, may differ that much
    assert wrong.mean() < 0.01
    assert np.abs(found - expected).mean() < 0.005


def test_mirrored_object_shades_as_in_cycles(scene: Any, export: Any, render_cycles: Any, render_mitsuba: Any) -> None:
    """A smooth Lambertian ball, squashed and mirrored, and the side of an open shell seen from behind."""
    add_light("SUN", rotation=(0.8, 0.3, 0.0), energy=2.0, angle=0.0)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    ball.scale = (-1.0, 0.6, 1.0)
    ball.data.materials.append(diffuse_material("White", (0.8, 0.8, 0.8)))
    ball.cycles.shadow_terminator_geometry_offset = ball.cycles.shadow_terminator_offset = 0.0
    shell = add_quad("Shell", 0.6, 1.2, diffuse_material("Shell", (0.2, 0.6, 0.4)))
    shell.rotation_euler = (np.pi, 0.0, 0.0)
    shell.location = (1.1, 0, 2.4)
    target = add_quad("Target", 0.05, 2.0, new_material("Target"))
    target.location = (-1.2, 1.2, 0)
    add_camera("ORTHO", ortho_scale=3.0)
    expected, found = render_cycles(), render_mitsuba(export(target))
    assert expected.mean() > 0.05
    # silhouettes and the terminator are the only noisy pixels
    assert np.abs(found - expected).mean() < 0.003
    assert np.median(np.abs(found - expected)) < 1e-4


def test_mitsuba_command_renders(scene: Any, export: Any, tmp_path: Path) -> None:
    """`mitsuba scene.xml` works from another folder, on a job whose folder has spaces and quotes in its name.

    With lights that Mitsuba has equals of: it knows nothing of our plugins.
    """
    import OpenEXR

    command = Path(sys.executable).with_name("mitsuba")
    world_color(scene, 1.0)
    add_camera("ORTHO", ortho_scale=2.0)
    add_light("POINT", shadow_soft_size=0.0)
    add_light("SUN", angle=0.0)
    report = export(add_quad("Target", 1.0, 0.0, new_material("Target")), 'job "é" 1')
    out = tmp_path / "out.exr"
    arguments = ["-m", "scalar_rgb", "-o", str(out), str(report.folder / "scene.xml")]
    done = subprocess.run([str(command), *arguments], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    pixels = next(iter(OpenEXR.File(str(out)).channels().values())).pixels
    assert pixels.shape == (32, 32, 3)
    assert pixels.mean() > 0.1


def test_an_export_says_how_far_it_is(scene: Any, export: Any) -> None:
    world_color(scene, 1.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    add_camera("ORTHO", (0, 0, 5), ortho_scale=6.0)
    told: list[float] = []
    export(target, tell=told.append)
    assert told == sorted(told)
    assert told[-1] >= 0.9
    assert len(told) >= 3
