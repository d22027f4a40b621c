# SPDX-License-Identifier: Apache-2.0
"""Exports of several pictures: each as it was seen, and the file as it was afterwards."""

from __future__ import annotations

import json
import os
from pathlib import Path

import bpy
import numpy as np
import pytest

from blender_addon.export.files.exr_file import write_exr
from blender_addon.export.job import LEFT_OUT, MOVING_VALUES, ExportError, export_job
from blender_addon.export.reference.picture_setup import PictureSetup
from tests.export.scenes import add_camera, add_light, add_quad, new_material
from tests.export.test_untouched import describe


@pytest.fixture
def turning(scene, tmp_path):
    """A plane that turns from frame 1 to 5 under a lamp, two cameras, and a picture for each of two sizes."""
    item = add_quad("Plane", 2.0, 0.0, new_material("Paint", Roughness=0.4))
    item.keyframe_insert("rotation_euler", frame=1)
    item.rotation_euler[0] = 0.5
    item.keyframe_insert("rotation_euler", frame=5)
    add_light("POINT", (1.0, -1.0, 3.0))
    side = add_camera("PERSP", (0.0, -3.0, 3.0), (0.75, 0.0, 0.0))
    side.name = "Side"
    front = add_camera("PERSP", (0.0, 0.0, 4.0))
    front.name = "Front"
    scene.camera, scene.frame_start, scene.frame_end = front, 1, 10
    scene.frame_set(2)
    for name, (width, height) in (("front.exr", (32, 32)), ("side.exr", (40, 24))):
        write_exr(tmp_path / name, np.full((height, width, 3), 0.5, np.float32))
    return item


def setups(folder: Path, **second: object) -> list[PictureSetup]:
    return [
        PictureSetup(folder / "front.exr", 1),
        PictureSetup(folder / "side.exr", 2, **({"camera": "Side"} | second)),  # type: ignore[arg-type]
    ]


def export(item, folder: Path, pictures: list[PictureSetup]):
    return export_job(bpy.context, item, folder / "job", reference=pictures, fit={})


def test_each_picture_is_exported_as_it_was_seen(turning, tmp_path):
    before = describe(bpy.context.scene)
    report = export(turning, tmp_path, setups(tmp_path, frame=5))
    assert describe(bpy.context.scene) == before
    inner = tmp_path / "job" / "more_pictures" / "2"
    more = json.loads((inner / "request.json").read_text("utf-8"))
    assert report.request["more_pictures"] == ["more_pictures/2"]
    assert report.request["picture"]["camera"] == "Front"
    assert report.request["picture"]["frame"] == 2
    assert more["picture"] == {
        "number": 2, "name": "side.exr", "frame": 5, "camera": "Side", "scene": bpy.context.scene.name,
        "view_layer": bpy.context.view_layer.name,
    }  # fmt: skip
    assert (more["image"]["width"], more["image"]["height"]) == (40, 24)
    meshes = [folder / "meshes" / "target.ply" for folder in (tmp_path / "job", inner)]
    assert meshes[0].read_bytes() != meshes[1].read_bytes()  # it has turned


def test_what_does_not_change_is_one_file(turning, tmp_path):
    export(turning, tmp_path, setups(tmp_path))
    meshes = [tmp_path / "job" / path / "meshes" / "target.ply" for path in ("", "more_pictures/2")]
    assert os.path.samefile(*meshes)
    texts = [(mesh.parent.parent / "scene.xml").read_text("utf-8") for mesh in meshes]
    assert texts[0] != texts[1]


def test_an_exposure_brightens_the_light(turning, tmp_path):
    export(turning, tmp_path, [PictureSetup(tmp_path / "front.exr", 1, exposure=1.0)])
    brighter = (tmp_path / "job" / "scene.xml").read_text("utf-8")
    export(turning, tmp_path, [PictureSetup(tmp_path / "front.exr", 1)])
    assert (tmp_path / "job" / "scene.xml").read_text("utf-8") != brighter
    bpy.context.scene.cycles.film_exposure = 2.0
    export(turning, tmp_path, [PictureSetup(tmp_path / "front.exr", 1)])
    assert (tmp_path / "job" / "scene.xml").read_text("utf-8") == brighter


def test_values_that_move_between_pictures_are_named(turning, tmp_path):
    socket = bpy.data.materials["Paint"].node_tree.nodes["Principled BSDF"].inputs["Roughness"]
    socket.keyframe_insert("default_value", frame=2)
    socket.default_value = 0.9
    socket.keyframe_insert("default_value", frame=5)
    bpy.context.scene.frame_set(2)
    report = export(turning, tmp_path, setups(tmp_path, frame=5))
    assert MOVING_VALUES.format(label="2 (side.exr)") in report.notes


@pytest.mark.parametrize(
    ("second", "sentence"),
    [
        ({"frame": 300}, r"Picture 2 \(side.exr\): Frame 300 is outside of the frames 1 to 10 of scene"),
        ({"camera": "Rear"}, "has no camera 'Rear': its cameras are: Side, Front|Front, Side"),
        ({"scene": "Night"}, "The file has no scene 'Night'"),
        ({"view_layer": "Rim"}, "has no view layer 'Rim': it has: ViewLayer"),
        ({"exposure": 99.0}, "The exposure is 99 stops"),
    ],
)
def test_what_the_file_does_not_have_is_refused_and_nothing_is_left(turning, tmp_path, second, sentence):
    before = describe(bpy.context.scene)
    with pytest.raises(ExportError, match=sentence):
        export(turning, tmp_path, setups(tmp_path, **second))
    assert describe(bpy.context.scene) == before
    assert not (tmp_path / "job").exists()


def test_a_camera_that_looks_away_is_left_out_with_a_sentence(turning, tmp_path):
    bpy.data.objects["Side"].rotation_euler[0] = 3.0
    why = "Picture 2 (side.exr): The camera does not see 'Plane': move it into the frame."
    for pictures in (setups(tmp_path), setups(tmp_path)[::-1]):  # the first one may be it, too
        report = export(turning, tmp_path, pictures)
        assert LEFT_OUT.format(why=why) in report.notes
        written = json.loads((tmp_path / "job" / "request.json").read_text("utf-8"))
        assert LEFT_OUT.format(why=why) in written["notes"]
        assert (written["picture"]["number"], written["more_pictures"]) == (1, [])
        assert (written["image"]["width"], written["image"]["height"]) == (32, 32)
        assert not (tmp_path / "job" / "more_pictures" / "2").exists()


def test_cameras_that_all_look_away_are_refused_before_the_fit(turning, tmp_path):
    for camera in ("Front", "Side"):
        bpy.data.objects[camera].rotation_euler[0] = 3.0
    with pytest.raises(ExportError, match=r"Picture 1 \(front.exr\): .*camera"):
        export(turning, tmp_path, setups(tmp_path))
    assert not (tmp_path / "job").exists()


def test_values_inside_nodes_are_seen_by_each_picture(turning, tmp_path):
    """Of a mix the leaf that the first picture shows most of; one copy of the file, and each picture's view of it."""
    tree = turning.active_material.node_tree
    principled = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    geometry, parts, mask = (tree.nodes.new(f"ShaderNode{k}") for k in ("NewGeometry", "SeparateXYZ", "Math"))
    glossy, mix, ramp = (tree.nodes.new(f"ShaderNode{k}") for k in ("BsdfAnisotropic", "MixShader", "ValToRGB"))
    mask.operation = "GREATER_THAN"
    tree.links.new(geometry.outputs["Position"], parts.inputs[0])
    tree.links.new(parts.outputs["Y"], mask.inputs[0])
    tree.links.new(parts.outputs["X"], ramp.inputs[0])
    tree.links.new(ramp.outputs[0], principled.inputs["Base Color"])
    tree.links.new(mask.outputs[0], mix.inputs[0])
    tree.links.new(principled.outputs[0], mix.inputs[1])
    tree.links.new(glossy.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL").inputs[0])
    for camera, y in (("Front", -0.5), ("Side", 0.7)):
        bpy.data.objects[camera].location = (0.0, y, 2.0)
        bpy.data.objects[camera].rotation_euler = (0.0, 0.0, 0.0)
    export(turning, tmp_path, setups(tmp_path, frame=5))
    folders = [tmp_path / "job", tmp_path / "job" / "more_pictures" / "2"]
    first, second = (json.loads((folder / "request.json").read_text("utf-8")) for folder in folders)
    assert [len(each["graph"]["values"]) for each in (first, second)] == [2, 2]  # the ramp's stops
    assert first["target"]["node"] == second["target"]["node"] == ["Principled BSDF"]
    views = [each["graph"]["evaluate"]["view"] for each in (first, second)]
    assert views == [
        {"camera": "Front", "frame": 2.0, "width": 32, "height": 32},
        {"camera": "Side", "frame": 5.0, "width": 40, "height": 24},
    ]
    assert [(folder / "graph" / "scene.blend").is_file() for folder in folders] == [True, False]
