# SPDX-License-Identifier: Apache-2.0
"""A scene far from Blender's zero is exported like one beside it, with its places counted from the target."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from blender_addon.export.job import check_export
from blender_addon.export.scene.origin import FAR_AWAY
from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.folder.request import read_request

from ..scenes import add_camera, add_light, add_quad, new_material, world_color

PLACE = (3000.0, -2000.0, 40.0)


def build(scene: Any, place: tuple[float, float, float]) -> Any:
    """A target whose roughness a noise gives, a lid beside it, a lamp and two cameras."""
    world_color(scene, 0.5)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    tree = target.data.materials[0].node_tree
    principled = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    coordinates, noise = tree.nodes.new("ShaderNodeTexCoord"), tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(coordinates.outputs["Object"], noise.inputs["Vector"])
    tree.links.new(noise.outputs[0], principled.inputs["Roughness"])
    lid = add_quad("Lid", 0.3, 0.5, new_material("Lid"))
    lamp = add_light("POINT", energy=100.0)
    lamp.location = (1.0, 1.0, 3.0)
    other = add_camera("PERSP", (1.0, 0.0, 4.0), (0.0, 0.2, 0.0))
    parent = bpy.data.objects.new("Place", None)
    scene.collection.objects.link(parent)
    for item in (target, lid, lamp, other, add_camera("PERSP", (0.0, 0.0, 4.0))):
        item.parent = parent
    parent.location = place
    bpy.context.view_layer.update()
    return target


def matrices(text: str) -> np.ndarray:
    """All matrices of a scene file."""
    lines = [line.split(chr(34))[1] for line in text.splitlines() if "<matrix" in line]
    return np.array([[float(number) for number in line.split()] for line in lines])


def read(report: Any) -> tuple[np.ndarray, ...]:
    """Matrices, vertices, the camera of the graph, the bounds of what it saw, and the other camera."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    ply = sorted(Path(report.folder).glob("meshes/*.ply"))[-1]
    mesh = mi.traverse(mi.load_dict({"type": "ply", "filename": str(ply)}))
    places = np.load(report.folder / "graph" / "positions.npy")
    seen = np.array([np.nanmean(places, axis=(0, 1)), np.nanmax(places, axis=(0, 1))])
    camera = np.array(report.request["graph"]["camera"])
    other = np.array(report.request["cameras"][0]["to_world"])
    text = (report.folder / "scene.xml").read_text()
    return matrices(text), np.array(mesh["vertex_positions"]), camera, seen, other


@pytest.mark.parametrize("size", [0.5, 1e-3])
def test_a_small_target_is_far_from_zero_sooner(size: float, scene: Any, export: Any) -> None:
    """Mitsuba's floats are as coarse for a ball of a millimetre at a metre as for one of a metre at a kilometre."""
    target = build(scene, (0.7, -0.3, 0.0))
    bpy.data.objects["Place"].scale = (size,) * 3
    scene.camera.data.clip_start = 0.1 * size
    bpy.context.view_layer.update()
    generator = export(target, "small", reference=bpy.data.images.new("Any", 32, 32)).request["generator"]
    if size == 0.5:
        assert "origin" not in generator
    else:
        np.testing.assert_allclose(generator["origin"], (0.7, -0.3, 0.0), atol=size)


@pytest.mark.parametrize(("weight", "x", "is_named"), [(1.0, 3000.0, True), (1.0, 300.0, False), (0.0, 3000.0, False)])
def test_subsurface_far_from_zero_is_named(weight: float, x: float, is_named: bool, scene: Any) -> None:
    """Cycles takes places below a surface in the world's floats."""
    world_color(scene, 1.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target", Subsurface_Weight=weight))
    target.location.x = x
    add_camera("PERSP", (x, 0.0, 4.0))
    notes = check_export(bpy.context, target)[1]
    assert any("from the world's zero" in note for note in notes) == is_named


def test_all_places_count_from_the_target(scene: Any, export: Any) -> None:
    picture = bpy.data.images.new("Any", 32, 32)
    target = build(scene, (0.0, 0.0, 0.0))
    near = export(target, "near", reference=picture)
    assert "origin" not in near.request["generator"]
    bpy.data.objects["Place"].location = PLACE
    bpy.context.view_layer.update()
    far = export(target, "far", reference=picture)
    assert tuple(far.request["generator"]["origin"]) == PLACE
    for found, expected in zip(read(far), read(near), strict=True):
        assert len(expected)
        # float32 has steps of 0.2 mm there, and a subpixel is 2 cm wide
        np.testing.assert_allclose(found, expected, atol=0.02, rtol=1e-3)
    assert read_request(JobFolder.open(far.folder)).generator["origin"] == list(PLACE)


def test_what_hides_a_far_target_is_found(scene: Any) -> None:
    target = build(scene, PLACE)
    assert check_export(bpy.context, target)[0] == []
    bpy.data.objects["Lid"].scale = (9.0, 9.0, 1.0)
    bpy.context.view_layer.update()
    assert check_export(bpy.context, target)[0] == ["The camera does not see 'Target': it is hidden behind 'Lid'."]


@pytest.mark.parametrize(
    ("distance", "height", "is_far"),
    [(0.9 * FAR_AWAY, 0.5, False), (1.1 * FAR_AWAY, 0.5, True), (0.0, 2.0 * FAR_AWAY, False)],
)
def test_what_is_near_stays_where_it_is(distance: float, height: float, is_far: bool, scene: Any, export: Any) -> None:
    world_color(scene, 1.0)
    target = add_quad("Target", 1.0, 0.0, new_material("Target"))
    target.location.x = distance
    add_camera("PERSP", (distance, 0.0, height))
    assert ("origin" in export(target).request["generator"]) is is_far


@pytest.mark.parametrize("who", ["Target", "Neighbour"])
def test_light_that_walks_as_far_as_its_object_is_large_is_named(scene: Any, export: Any, who: str) -> None:
    """A target of 1 m from 2 m on, another object from 0.5 m on; 0.4 m is said of neither."""
    world_color(scene, 1.0)
    add_camera()
    target, other = (
        add_quad(name, 1.0, height, new_material(name)) for name, height in (("Target", 0), ("Neighbour", -1))
    )
    shader = {"Target": target, "Neighbour": other}[who].data.materials[0].node_tree.nodes["Principled BSDF"]
    shader.inputs["Subsurface Weight"].default_value = 1.0
    shader.inputs["Subsurface Radius"].default_value = (1.0, 0.2, 0.1)
    named = [
        f"Light walks below the surface of material '{who}' half as far as its object is large, or further (Subsurface "
        "Scale times Radius): how bright that is differs from Cycles."
    ]
    for scale, said in ((0.4, []), (1.0, [] if who == "Target" else named), (2.2, named)):
        shader.inputs["Subsurface Scale"].default_value = scale
        assert [note for note in export(target).notes if "walks" in note] == said
