# SPDX-License-Identifier: Apache-2.0
"""A .blend whose colours are inside its nodes: they are found there and written there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

from .conftest import Done, run_bpy, run_mfo

BUILD = """
from studies.graphs.measure import build_scene
target, node = build_scene("ramp", "lamp", 48)
stops = target.active_material.node_tree.nodes["Color Ramp"].color_ramp.elements
scene = bpy.context.scene
scene.cycles.samples = 64
settings = scene.render.image_settings
settings.file_format, settings.color_depth = "OPEN_EXR", "32"
scene.render.filepath = argv[1]
bpy.ops.render.render(write_still=True)
for stop in stops:
    stop.color = (0.4, 0.4, 0.4, 1.0)
bpy.ops.wm.save_as_mainfile(filepath=argv[0])
"""
HOLES = """
tree = target.active_material.node_tree
checker = tree.nodes.new("ShaderNodeTexChecker")
checker.inputs["Scale"].default_value = 6.0
shader, output = tree.nodes["Principled BSDF"], tree.get_output_node("CYCLES")
if argv[2] == "alpha":
    tree.links.new(checker.outputs["Fac"], shader.inputs["Alpha"])
else:
    mix, clear = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfTransparent")
    for socket, place in ((checker.outputs["Fac"], 0), (clear.outputs[0], 1), (shader.outputs[0], 2)):
        tree.links.new(socket, mix.inputs[place])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
"""
SHOW = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
stops = bpy.data.objects["Suzanne"].active_material.node_tree.nodes["Color Ramp"].color_ramp.elements
found = [list(stop.color) for stop in stops]
"""


SIDE = """
import mathutils
bpy.ops.wm.open_mainfile(filepath=argv[0])
scene, head = bpy.context.scene, bpy.data.objects["Suzanne"]
side = bpy.data.objects.new("Side", scene.camera.data)
side.location = (4.6, -1.2, 1.0)
side.rotation_euler = (-mathutils.Vector(side.location)).to_track_quat("-Z", "Y").to_euler()
scene.collection.objects.link(side)
head.keyframe_insert("rotation_euler", frame=1)
head.rotation_euler[2] += 0.6
head.keyframe_insert("rotation_euler", frame=9)
scene.frame_end = 10
bpy.ops.wm.save_as_mainfile(filepath=argv[2])
low, high = head.active_material.node_tree.nodes["Color Ramp"].color_ramp.elements
low.color, high.color = (0.8, 0.1, 0.05, 1.0), (0.05, 0.2, 0.7, 1.0)
scene.cycles.samples = 64
settings = scene.render.image_settings
settings.file_format, settings.color_depth = "OPEN_EXR", "32"
scene.camera, scene.render.resolution_x, scene.render.resolution_y, scene.render.filepath = side, 56, 40, argv[1]
scene.frame_set(9)
bpy.ops.render.render(write_still=True)
"""


DRAWN = """
import blender_addon
from studies.graphs.measure import row
if not hasattr(bpy.types.Material, "mfo"):
    blender_addon.register()
found = {name: value for name, value in row("ramp", "lamp", 0, 96, "values").items() if "flip" in name}
"""


@dataclass(frozen=True)
class Ramp:
    """A file whose ramp has grey stops, and a picture of what they truly are."""

    start: Path
    picture: Path


@pytest.fixture(scope="module")
def ramp(tmp_path_factory: pytest.TempPathFactory) -> Ramp:
    folder = tmp_path_factory.mktemp("ramp")
    made = Ramp(folder / "start.blend", folder / "front.exr")
    run_bpy(BUILD, made.start, made.picture)
    return made


def test_stops_of_a_ramp_are_found_and_applied(ramp: Ramp, tmp_path: Path) -> None:
    saved = tmp_path / "saved.blend"
    names = "Color Ramp/Stop 0, color ramp/stop 1"
    done = run_mfo(
        "blend", ramp.start, "--object", "Suzanne", "--reference", ramp.picture, "--parameters", names,
        "--preset", "fast", "--out", tmp_path / "job", "--apply", "--save-as", saved, "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    assert set(done.answer["recovered"]) == {"Color Ramp/Stop 0", "Color Ramp/Stop 1"}
    levels = {name: entry["level"] for name, entry in done.answer["certainty"].items()}
    assert levels == dict.fromkeys(done.answer["recovered"], "determined")
    low, high = run_bpy(SHOW, saved)
    assert low == pytest.approx([0.8, 0.1, 0.05, 1.0], abs=0.02)
    assert high == pytest.approx([0.05, 0.2, 0.7, 1.0], abs=0.02)


@pytest.mark.parametrize("by", ["alpha", "transparent"])
def test_stops_of_what_has_holes_are_found_and_applied(by: str, mfo_here: Callable[..., Done], tmp_path: Path) -> None:
    """Half of a head is cut out, so that its inside is seen."""
    start, picture, saved = tmp_path / "start.blend", tmp_path / "front.exr", tmp_path / "saved.blend"
    run_bpy(BUILD.replace("stops =", f"{HOLES}stops =", 1), start, picture, by)
    done = mfo_here(
        "blend", start, "--object", "Suzanne", "--reference", picture, "--parameters", "Color Ramp/Stop 0, Color "
        "Ramp/Stop 1", "--preset", "fast", "--out", tmp_path / "job", "--apply", "--save-as", saved, "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    low, high = run_bpy(SHOW, saved)
    assert low == pytest.approx([0.8, 0.1, 0.05, 1.0], abs=0.05)
    assert high == pytest.approx([0.05, 0.2, 0.7, 1.0], abs=0.05)


def test_two_pictures_of_values_inside_nodes(ramp: Ramp, mfo_here: Callable[..., Done], tmp_path: Path) -> None:
    """Another camera, frame and size: what nodes give is evaluated for each, and both say one set of values."""
    start, side = tmp_path / "start.blend", tmp_path / "side.exr"
    run_bpy(SIDE, ramp.start, side, start)
    done = mfo_here(
        "blend", start, "--object", "Suzanne",
        "--reference", ramp.picture, "--reference", f"{side}@camera=Side,frame=9",
        "--parameters", "Color Ramp/Stop 0, Color Ramp/Stop 1", "--preset", "fast", "--out", tmp_path / "job", "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    assert [picture["verdict"] for picture in done.answer["pictures"]] == ["same", "same"]
    assert done.answer["recovered"]["Color Ramp/Stop 0"] == pytest.approx([0.8, 0.1, 0.05], abs=0.01)
    assert done.answer["recovered"]["Color Ramp/Stop 1"] == pytest.approx([0.05, 0.2, 0.7], abs=0.01)
    assert not list((tmp_path / "job").rglob("*.blend"))


def test_the_end_of_a_solve_is_one_of_the_nodes_as_they_are() -> None:
    """Positions of a ramp's stops: by what nodes gave before, a solve stood still 0.047 above the floor."""
    found = run_bpy(DRAWN)
    assert found["flip_before"] > found["flip_floor"] + 0.5
    assert found["flip_after"] < found["flip_floor"] + 0.005
