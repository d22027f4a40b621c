# SPDX-License-Identifier: Apache-2.0
"""The list of pictures in the panel: what is added, what the export gets, and the camera that a fit proposes."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from blender_addon.check.checks import STOPS, TO_CHOOSE, quick_check
from blender_addon.result import shown_result
from blender_addon.result.job_result import JobResultError, read_job_result
from mfo_backend.scene.image_file import read_image

from . import fake_backend
from .conftest import HEIGHT, WIDTH


def listed(scene: SimpleNamespace):
    """The scene's settings with a second picture from another camera."""
    bpy = scene.bpy
    settings = bpy.context.scene.mfo
    settings.reference_path = scene.reference
    assert bpy.ops.mfo.add_picture() == {"FINISHED"}
    side = bpy.context.scene.camera.copy()
    side.name = "Side"
    bpy.context.collection.objects.link(side)
    side.location.x += 0.3
    second = Path(scene.reference).with_name("side.png")
    fake_backend.png(second, (60, 60, 40), WIDTH, HEIGHT)
    settings.pictures[0].camera, settings.pictures[0].path, settings.pictures[0].frame = side, str(second), 7
    return settings


def fit(scene: SimpleNamespace) -> dict:
    assert scene.bpy.ops.mfo.fit(job_folder=scene.job, object="Väse") == {"FINISHED"}
    return json.loads((Path(scene.job) / "request.json").read_text("utf-8"))


def test_one_picture_needs_no_list(scene: SimpleNamespace) -> None:
    scene.bpy.context.scene.mfo.reference_path = scene.reference
    request = fit(scene)
    assert "more_pictures" not in request
    assert "picture" not in request


def test_listed_pictures_are_exported_with_what_they_show(scene: SimpleNamespace) -> None:
    settings = listed(scene)
    assert settings.first_picture.camera == scene.bpy.context.scene.camera
    request = fit(scene)
    assert request["more_pictures"] == ["more_pictures/2"]
    more = json.loads((Path(scene.job) / "more_pictures" / "2" / "request.json").read_text("utf-8"))
    assert (more["picture"]["camera"], more["picture"]["frame"]) == ("Side", 7)
    assert scene.bpy.context.scene.frame_current == 1


def test_a_picture_that_is_not_used_is_left_out_and_keeps_its_number(scene: SimpleNamespace) -> None:
    settings = listed(scene)
    settings.first_picture.use = False
    request = fit(scene)
    assert request["picture"]["number"] == 2
    assert not request.get("more_pictures")
    settings.pictures[0].use = False
    with pytest.raises(RuntimeError, match="No picture is used"):
        scene.bpy.ops.mfo.fit(job_folder=scene.job, object="Väse")


def test_each_picture_has_a_part_that_counts(scene: SimpleNamespace) -> None:
    settings = listed(scene)
    part = settings.pictures[0].part
    part.right = 50.0
    request = fit(scene)
    more = json.loads((Path(scene.job) / "more_pictures" / "2" / "request.json").read_text("utf-8"))
    assert more["reference"]["crop"] == [0.0, 0.0, 0.5, 1.0]
    assert "crop" not in request["reference"]
    part.left = 60.0
    said = [f.sentence for f in quick_check(scene.bpy.context.scene, scene.bpy.context.view_layer) if f.level == STOPS]
    assert said == ["Picture 2: The crop leaves nothing: left must be below right, and top below bottom."]
    assert scene.bpy.ops.mfo.whole_picture(number=2) == {"FINISHED"}
    assert part.is_whole
    with pytest.raises(RuntimeError, match="There is no picture 3: the last is 2"):
        scene.bpy.ops.mfo.whole_picture(number=3)


def test_what_is_missing_is_said_before_the_fit(scene: SimpleNamespace) -> None:
    bpy, settings = scene.bpy, listed(scene)

    def said() -> dict[str, str]:
        found = quick_check(bpy.context.scene, bpy.context.view_layer)
        return {f.sentence: f.level for f in found if f.sentence.startswith(("Picture 2", "Choose the file"))}

    settings.pictures[0].frame = 900
    assert said() == {"Picture 2: frame 900 is outside of the frames 1 to 250.": STOPS}
    settings.pictures[0].path = ""
    assert said() == {"Choose the file of picture 2, or do not use it.": TO_CHOOSE}
    with pytest.raises(RuntimeError, match="Picture 2 has no file"):
        bpy.ops.mfo.fit(job_folder=scene.job, object="Väse")
    assert bpy.ops.mfo.remove_picture(index=0) == {"FINISHED"}
    assert not settings.pictures


def propose(scene: SimpleNamespace, **changes: object) -> Path:
    """A finished job whose result proposes a camera and has two pictures."""
    scene.bpy.context.scene.mfo.reference_path = scene.reference
    fit(scene)
    path = Path(scene.job) / "result.json"
    proposal = {"turn": 90.0, "center": [1.0, 0.0, 0.5], "settles": [], "predicted": {}, "sentence": "Turn by 90."}
    pictures = [
        {"number": n, "name": f"{n}.exr", "folder": folder, "verdict": "same", "errors": {"flip": [0.5, 0.1]}}
        for n, folder in ((1, "."), (3, "more_pictures/3"))
    ]
    result = json.loads(path.read_text("utf-8")) | {"next_picture": proposal | changes, "pictures": pictures}
    path.write_text(json.dumps(result), "utf-8")
    return Path(scene.job)


def test_the_proposed_camera_is_set_up_around_the_object_and_listed(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    found = read_job_result(propose(scene))
    assert [picture.label for picture in found.pictures] == ["1 1.exr", "3 3.exr"]
    shown_result.clear(bpy.context.window_manager.mfo_runtime)
    shown_result.show(found, 0)
    before = bpy.context.scene.camera
    assert bpy.ops.mfo.set_up_next_picture() == {"FINISHED"}
    camera = bpy.context.scene.camera
    bpy.context.view_layer.update()
    assert camera != before
    assert bpy.context.scene.mfo.pictures[0].camera == camera
    assert bpy.context.scene.mfo.first_picture.camera == before
    center = np.array([1.0, 0.0, 0.5])
    old, new = (np.array(one.matrix_world)[:3, 3] - center for one in (before, camera))
    turn = math.radians(90.0)
    rotation = np.array([[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]])
    np.testing.assert_allclose(new, rotation @ old, atol=1e-5)


def set_up(scene: SimpleNamespace, **proposal: object) -> None:
    """Show a proposal and press its button."""
    runtime = scene.bpy.context.window_manager.mfo_runtime
    shown_result.clear(runtime)
    shown_result.show(read_job_result(propose(scene, **proposal)), 0)
    assert scene.bpy.ops.mfo.set_up_next_picture() == {"FINISHED"}


def test_a_proposed_camera_of_the_scene_is_taken(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    side = bpy.context.scene.camera.copy()
    side.name = "Side"
    bpy.context.collection.objects.link(side)
    set_up(scene, turn=0.0, camera="Side")
    assert bpy.context.scene.camera == side
    assert bpy.context.scene.mfo.pictures[0].camera == side
    bpy.context.scene.camera = bpy.context.scene.mfo.first_picture.camera
    bpy.data.objects.remove(side)
    with pytest.raises(RuntimeError, match="no object 'Side' any more"):
        bpy.ops.mfo.set_up_next_picture()


@pytest.mark.parametrize("turn", [0.0, 90.0])
def test_proposed_light_is_a_scene_of_its_own(scene: SimpleNamespace, turn: float) -> None:
    bpy = scene.bpy
    own, lights = bpy.context.scene, {}
    room = bpy.data.collections.new("Room")
    own.collection.children.link(room)
    for name, collection in (("Key", room), ("Fill", own.collection)):
        lights[name] = bpy.data.objects.new(name, bpy.data.lights.new(name, "POINT"))
        lights[name].location = (3.0, 0.0, 2.0)
        collection.objects.link(lights[name])
    own.view_layers[0].layer_collection.children["Room"].indirect_only = True
    bpy.context.view_layer.update()
    before = set(own.objects)
    set_up(scene, turn=0.0, light="Key", light_turn=turn)
    entry = own.mfo.pictures[0]
    assert (entry.camera, bpy.context.scene) == (own.camera, own)
    assert entry.scene.use_extra_user  # a file keeps it when the picture is taken off the list
    assert set(own.objects) == before
    there = {each.name for each in entry.scene.objects if each.type == "LIGHT"}
    others = {each.name for each in before if each.type == "LIGHT"} - {"Key"}
    assert {each for each in before if each.type != "LIGHT"} <= set(entry.scene.objects)
    copied = [each for each in entry.scene.view_layers[0].layer_collection.children if each.name.startswith("Room")]
    assert [each.indirect_only for each in copied] == [True]
    if turn == 0.0:
        assert there == {"Key"}
        assert entry.scene.world is None
    else:
        assert there == {"Key.001", *others}
        assert entry.scene.world == own.world
        place = np.array(entry.scene.objects["Key.001"].matrix_world)[:3, 3]
        np.testing.assert_allclose(place, (1.0, 2.0, 2.0), atol=1e-5)  # about the vertical through (1, 0)
    second = Path(scene.reference).with_name("second.png")
    fake_backend.png(second, (60, 60, 40), WIDTH, HEIGHT)
    entry.path = str(second)
    fit(scene)
    more = json.loads((Path(scene.job) / "more_pictures" / "2" / "request.json").read_text("utf-8"))
    assert more["picture"]["scene"] == entry.scene.name


@pytest.mark.parametrize("wrong", [{"center": [0.0]}, {"turn": "far"}, {"turn": None}, {"light_turn": "far"}])
def test_a_proposal_that_is_none_is_refused(scene: SimpleNamespace, wrong: dict[str, object]) -> None:
    with pytest.raises(JobResultError):
        read_job_result(propose(scene, **wrong))


def test_a_picture_is_rendered_with_the_material_that_a_fit_should_find(scene: SimpleNamespace) -> None:
    """The true material glows, so that the object's pixels are its colour; `exposure` stops brighter."""
    bpy, settings = scene.bpy, listed(scene)
    entry, radiance = settings.pictures[0], (0.25, 0.5, 0.125)
    entry.path, entry.exposure = "", 1.0
    bpy.context.scene.cycles.samples, bpy.context.scene.cycles.use_denoising = 4, False
    glaze = bpy.data.objects["Väse"].active_material
    truth = glaze.copy()
    truth.name = "Truth"
    truth.node_tree.nodes.clear()
    glow, out = (truth.node_tree.nodes.new(f"ShaderNode{kind}") for kind in ("Emission", "OutputMaterial"))
    glow.inputs["Color"].default_value = (*radiance, 1.0)
    truth.node_tree.links.new(glow.outputs["Emission"], out.inputs["Surface"])
    with pytest.raises(RuntimeError, match="Choose the material that the picture is to show"):
        bpy.ops.mfo.render_picture(index=0, material="None")
    with pytest.raises(RuntimeError, match="'Glaze' is the one that is fitted"):
        bpy.ops.mfo.render_picture(index=0, material="Glaze")
    with pytest.raises(RuntimeError, match="no picture 3"):
        bpy.ops.mfo.render_picture(index=1, material="Truth")
    with pytest.raises(RuntimeError, match="'Truth' is used nowhere"):
        bpy.ops.mfo.render_picture(index=0, material="Truth")
    truth.use_fake_user = True

    def glows() -> np.ndarray:
        """Which columns of the rendered picture show how many pixels of the true material."""
        entry.path = ""
        assert bpy.ops.mfo.render_picture(index=0, material="Truth") == {"FINISHED"}
        try:
            pixels = read_image(Path(entry.path)).pixels
        finally:
            shutil.rmtree(Path(entry.path).parent)
        return (np.abs(pixels / np.asarray(radiance) - 2.0).max(axis=-1) < 1e-4).sum(axis=0)

    from_side = glows()
    assert 0.05 < from_side.sum() / (WIDTH * HEIGHT) < 0.5
    assert bpy.data.objects["Väse"].active_material == glaze
    entry.camera = settings.first_picture.camera
    columns = np.arange(WIDTH)
    assert np.average(columns, weights=glows()) - np.average(columns, weights=from_side) > 1.0  # it stands further left
    assert settings.reference_path == scene.reference
    entry.path, entry.frame = "", 900
    with pytest.raises(RuntimeError, match="Frame 900 is outside of the frames 1 to 250"):
        bpy.ops.mfo.render_picture(index=0, material="Truth")
    assert entry.path == ""
