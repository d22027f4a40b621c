# SPDX-License-Identifier: Apache-2.0
"""Two materials that light each other through `mfo blend`: one fit, a result for each, both written in one go."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from blender_addon.result.job_result import read_job_result

from .conftest import Done, run_bpy, run_mfo

MfoHere = Callable[..., Done]

SIZE = 48
# a corner of two large walls under one lamp: half of the light on each comes over the other
BUILD = f"""
import math
bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
scene.render.resolution_x = scene.render.resolution_y = {SIZE}
scene.view_settings.view_transform = "Standard"
scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 128, False, False
nodes = []
for name, turn, place in (("Floor", 0.0, (0.0, 0.0, 0.0)), ("Wall", math.pi / 2, (0.0, 2.0, 2.0))):
    bpy.ops.mesh.primitive_plane_add(size=4.0, rotation=(turn, 0.0, 0.0), location=place)
    item = bpy.context.object
    item.name = name
    material = bpy.data.materials.new(name + " Paint")
    if material.node_tree is None:  # before Blender 5.0
        material.use_nodes = True
    item.data.materials.append(material)
    nodes.append(next(n for n in material.node_tree.nodes if n.type == "BSDF_PRINCIPLED").inputs)
lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
lamp.data.energy, lamp.data.size, lamp.location = 120.0, 1.0, (0.0, 0.6, 3.0)
lamp.rotation_euler = (0.35, 0.0, 0.0)
camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
camera.location, camera.rotation_euler = (0.0, -5.5, 2.6), (math.radians(76), 0.0, 0.0)
for item in (lamp, camera):
    scene.collection.objects.link(item)
scene.camera = camera
side = bpy.data.objects.new("Side", bpy.data.cameras.new("Side"))
side.location = (0.0, 0.0, 5.0)  # above the floor: the wall is seen edge on, beyond its frame
scene.collection.objects.link(side)
if "mixed" in argv:  # the wall: its paint beside patches of dark ones, which a noise scatters
    tree = bpy.data.materials["Wall Paint"].node_tree
    paint, output = (next(n for n in tree.nodes if n.type == kind) for kind in ("BSDF_PRINCIPLED", "OUTPUT_MATERIAL"))
    patches, noise, ramp, place, mix = (
        tree.nodes.new("ShaderNode" + kind) for kind in ("BsdfDiffuse", "TexNoise", "ValToRGB", "TexCoord", "MixShader")
    )
    patches.inputs["Color"].default_value = (0.02, 0.02, 0.02, 1.0)
    low, high = ramp.color_ramp.elements
    low.position, high.position, low.color, high.color = 0.45, 0.55, (0.0, 0.0, 0.0, 1.0), (0.2, 0.2, 0.2, 1.0)
    noise.inputs["Scale"].default_value = 1.5
    for source, sink in (
        (place.outputs["Object"], noise.inputs["Vector"]), (noise.outputs[0], ramp.inputs[0]),
        (ramp.outputs[0], mix.inputs[0]), (paint.outputs[0], mix.inputs[1]), (patches.outputs[0], mix.inputs[2]),
        (mix.outputs[0], output.inputs["Surface"]),
    ):
        tree.links.new(source, sink)
stops = []
if "patterned" in argv:  # colours of both in nodes; the ramp of each lies in a group that both have
    group = bpy.data.node_groups.new("Pattern", "ShaderNodeTree")
    group.interface.new_socket("Low", in_out="INPUT", socket_type="NodeSocketColor")
    group.interface.new_socket("Color", in_out="OUTPUT", socket_type="NodeSocketColor")
    noise, ramp, mix = (group.nodes.new("ShaderNode" + kind) for kind in ("TexNoise", "ValToRGB", "Mix"))
    entry, end = group.nodes.new("NodeGroupInput"), group.nodes.new("NodeGroupOutput")
    mix.data_type, noise.inputs["Scale"].default_value = "RGBA", 2.0
    place = group.nodes.new("ShaderNodeTexCoord")
    low, high = ramp.color_ramp.elements
    low.position, high.position = 0.4, 0.6
    high.color = (0.8, 0.8, 0.8, 1.0)
    for source, sink in (
        (place.outputs["Object"], noise.inputs["Vector"]), (noise.outputs[0], ramp.inputs[0]),
        (ramp.outputs[0], mix.inputs["Factor"]), (entry.outputs["Low"], mix.inputs[6]), (mix.outputs[2], end.inputs[0]),
    ):
        group.links.new(source, sink)
    mix.inputs[7].default_value = (0.5, 0.5, 0.5, 1.0)  # one value for both, in the file
    for inputs in nodes:
        tree = inputs[0].id_data
        own = tree.nodes.new("ShaderNodeGroup")
        own.node_tree, own.inputs[0].default_value = group, (0.5, 0.5, 0.5, 1.0)
        tree.links.new(own.outputs[0], inputs["Base Color"])
        stops.append(own)
bpy.ops.wm.save_as_mainfile(filepath=argv[0], copy=True)
if stops:
    stops[1].node_tree = group.copy()  # the truth: another one for each
    lows, highs = ((0.75, 0.2, 0.1, 1.0), (0.25, 0.6, 0.8, 1.0)), ((0.1, 0.4, 0.1, 1.0), (0.7, 0.6, 0.1, 1.0))
    for own, low, high in zip(stops, lows, highs):
        own.inputs[0].default_value = low
        next(n for n in own.node_tree.nodes if n.type == "MIX").inputs[7].default_value = high
for inputs, color, rough in zip(nodes, ((0.75, 0.2, 0.1, 1.0), (0.25, 0.6, 0.8, 1.0)), (0.35, 0.6)):
    inputs["Base Color"].default_value, inputs["Roughness"].default_value = color, rough
settings = scene.render.image_settings
if hasattr(settings, "media_type"):
    settings.media_type = "IMAGE"
settings.file_format, settings.color_depth, scene.render.filepath = "OPEN_EXR", "32", argv[1]
bpy.ops.render.render(write_still=True)
scene.camera, scene.render.filepath = side, argv[2]
bpy.ops.render.render(write_still=True)
"""
TRUTH = {"Floor": (0.75, 0.2, 0.1), "Wall": (0.25, 0.6, 0.8)}
READ = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
found = {}
for name in ("Floor", "Wall"):
    tree = bpy.data.objects[name].active_material.node_tree
    inputs = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED").inputs
    found[name] = list(inputs["Base Color"].default_value)[:3]
"""


@pytest.fixture(scope="module")
def corner(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("corner")
    run_bpy(BUILD, folder / "start.blend", folder / "reference.exr", folder / "side.exr")
    return folder


def test_both_are_found_in_each_others_light_and_written_in_one_go(corner: Path, tmp_path: Path) -> None:
    job, saved = tmp_path / "job", tmp_path / "fitted.blend"
    done = run_mfo(
        "blend", corner / "start.blend", "--object", "Floor", "--object", "Wall@material=Wall Paint", "--preset",
        "fast", "--reference", corner / "reference.exr", "--out", job, "--apply", "--save-as", saved, "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    answer = done.answer
    assert answer["sentence"] == "2 materials: 2 look the same as the reference."
    assert [(m["object"], m["verdict"], m["folder"]) for m in answer["materials"]] == [
        ("Floor", "same", "targets/1"),
        ("Wall", "same", "targets/2"),
    ]
    for found in answer["materials"]:
        # fitted alone beside the wall as it is in the start file, the floor comes out 0.13 too dark in red
        assert np.abs(np.subtract(found["recovered"]["base_color"], TRUTH[found["object"]])).max() < 0.03
        own = json.loads((job / found["folder"] / "result.json").read_text("utf-8"))
        assert own["recovered"] == found["recovered"]
        assert (job / found["folder"] / "pictures" / "counted.png").is_file()
    report = (job / "index.html").read_text("utf-8")
    assert report.count("looks the same as the reference") >= 2
    assert 'href="targets/2/index.html"' in report

    written = run_bpy(READ, saved)
    for found in answer["materials"]:
        assert written[found["object"]] == pytest.approx(found["recovered"]["base_color"], abs=1e-5)


def test_what_cannot_be_is_said_before_the_fit(corner: Path, mfo_here: MfoHere, tmp_path: Path) -> None:
    words = ["blend", corner / "start.blend", "--reference", corner / "reference.exr", "--out", tmp_path / "job"]
    twice = mfo_here(*words, "--object", "Floor", "--object", "Floor@slot=1")
    assert (twice.code, twice.sentence.endswith("is named twice: name it once.")) == (2, True)
    paper = mfo_here(*words, "--object", "Floor", "--object", "Wall", "--preset", "paper")
    assert paper.code == 2
    assert "The preset 'paper' fits one material alone" in paper.sentence
    assert not (tmp_path / "job").exists()


def test_two_pictures_show_both_and_one_of_them_only_the_floor(corner: Path, tmp_path: Path) -> None:
    job = tmp_path / "job"
    done = run_mfo(
        "blend", corner / "start.blend", "--object", "Floor", "--object", "Wall", "--preset", "fast", "--out", job,
        "--reference", f"{corner / 'reference.exr'}@camera=Camera", "--reference", f"{corner / 'side.exr'}@camera=Side",
        "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    answer = done.answer
    assert answer["sentence"] == "2 materials: 2 look the same as the reference."
    assert [(p["number"], p["verdict"], p["folder"]) for p in answer["pictures"]] == [
        (1, "same", "."),
        (2, "same", "more_pictures/2"),
    ]
    floor, wall = answer["materials"]
    assert [(p["number"], p["folder"]) for p in floor["pictures"]] == [(1, "targets/1"), (2, "more_pictures/2")]
    assert [p["number"] for p in wall["pictures"]] == [1]  # the other one shows nothing of it
    for name, found in (("Floor", floor), ("Wall", wall)):
        np.testing.assert_allclose(found["recovered"]["base_color"], TRUTH[name], atol=0.03)
    for picture in floor["pictures"]:
        assert (job / picture["folder"] / "pictures" / "result.png").is_file()
    own = json.loads((job / "targets" / "1" / "result.json").read_text("utf-8"))
    assert [p["folder"] for p in own["pictures"]] == [".", "../../more_pictures/2"]
    assert [p.folder for p in read_job_result(job / "targets" / "1").pictures] == [
        (job / "targets" / "1").resolve(),
        (job / "more_pictures" / "2").resolve(),
    ]

    # the same folder as one of a batch, as a queue, which takes less
    request = json.loads((job / "request.json").read_text("utf-8"))
    request["fit"]["queue"] = True
    (job / "request.json").write_text(json.dumps(request), "utf-8")
    batch = run_mfo("batch", job, "--again", "--json")
    assert (batch.code, batch.answer["status"]) == (0, "converged"), batch.stderr
    again = json.loads((job / "result.json").read_text("utf-8"))
    assert [(p["number"], p["verdict"]) for p in again["pictures"]] == [(1, "same"), (2, "same")]
    for name, found in zip(TRUTH, again["materials"], strict=True):
        own = json.loads((job / found["folder"] / "result.json").read_text("utf-8"))
        assert own["recovered"]["base_color"] != answer["materials"][[*TRUTH].index(name)]["recovered"]["base_color"]
        np.testing.assert_allclose(own["recovered"]["base_color"], TRUTH[name], atol=0.05)


SHOW = """
bpy.ops.wm.open_mainfile(filepath=argv[0])
found = {}
for name in ("Floor", "Wall"):
    own = next(n for n in bpy.data.objects[name].active_material.node_tree.nodes if n.type == "GROUP")
    mix = next(n for n in own.node_tree.nodes if n.type == "MIX")
    found[name] = {"Group/Low": list(own.inputs[0].default_value)[:3], "Mix/B": list(mix.inputs[7].default_value)[:3]}
"""
INSIDE = {"Floor": ((0.75, 0.2, 0.1), (0.1, 0.4, 0.1)), "Wall": ((0.25, 0.6, 0.8), (0.7, 0.6, 0.1))}


def test_colours_inside_the_nodes_of_both_are_found_and_written(mfo_here: MfoHere, tmp_path: Path) -> None:
    """In two pictures, the first of which does not show the wall; the group that both have becomes one for each."""
    start, both, side, saved = (tmp_path / name for name in ("start.blend", "both.exr", "side.exr", "fitted.blend"))
    run_bpy(BUILD, start, both, side, "patterned")
    done = mfo_here(
        "blend", start, "--object", "Floor", "--object", "Wall", "--preset", "fast", "--parameters",
        "roughness, Group/Low, Wall Paint/Mix/B, Floor Paint/Mix/B",
        "--reference", f"{side}@camera=Side", "--reference", f"{both}@camera=Camera",
        "--out", tmp_path / "job", "--apply", "--save-as", saved, "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    assert [each["verdict"] for each in done.answer["materials"]] == ["same", "same"]
    for found in done.answer["materials"]:
        for name, truth in zip(("Group/Low", "Mix/B"), INSIDE[found["object"]], strict=True):
            np.testing.assert_allclose(found["recovered"][name], truth, atol=0.03)
            assert found["certainty"][name]["level"] == "determined"
    assert not list((tmp_path / "job").rglob("*.blend"))
    written = run_bpy(SHOW, saved)
    for found in done.answer["materials"]:
        for name, value in written[found["object"]].items():
            assert value == pytest.approx(found["recovered"][name], abs=1e-5)


def test_a_material_whose_nodes_cycles_evaluates_is_in_one_of_the_pictures(mfo_here: MfoHere, tmp_path: Path) -> None:
    """The first picture does not show it, and has its light: of a Mix of equal shares the floor would be too dark."""
    start, both, side, saved = (tmp_path / name for name in ("start.blend", "both.exr", "side.exr", "fitted.blend"))
    run_bpy(BUILD, start, both, side, "mixed")
    done = mfo_here(
        "blend", start, "--object", "Floor", "--object", "Wall", "--preset", "fast", "--parameters",
        "base_color, roughness", "--reference", f"{side}@camera=Side", "--reference", f"{both}@camera=Camera",
        "--out", tmp_path / "job", "--apply", "--save-as", saved, "--json",
    )  # fmt: skip
    assert done.code == 0, done.stderr
    floor, wall = done.answer["materials"]
    assert [[p["number"] for p in found["pictures"]] for found in (floor, wall)] == [[1, 2], [2]]
    assert [p["verdict"] for found in (floor, wall) for p in found["pictures"]] == ["same"] * 3
    for found in (floor, wall):
        np.testing.assert_allclose(found["recovered"]["base_color"], TRUTH[found["object"]], atol=0.01)
        assert found["recovered"]["roughness"] == pytest.approx({"Floor": 0.35, "Wall": 0.6}[found["object"]], abs=0.02)
        assert found["certainty"]["base_color"]["level"] == "determined"
    written = run_bpy(READ, saved)
    for found in (floor, wall):
        assert written[found["object"]] == pytest.approx(found["recovered"]["base_color"], abs=1e-5)


def test_one_material_is_fitted_to_the_pictures_that_show_it(corner: Path, mfo_here: MfoHere, tmp_path: Path) -> None:
    """The first of two pictures shows nothing of the wall."""
    done = mfo_here(
        "blend", corner / "start.blend", "--object", "Wall", "--parameters", "base_color", "--preset", "fast",
        "--reference", f"{corner / 'side.exr'}@camera=Side", "--reference", f"{corner / 'reference.exr'}@camera=Camera",
        "--out", tmp_path / "job", "--json",
    )  # fmt: skip
    assert done.code in (0, 5), done.stderr  # the floor beside it is that of the start
    said = [note for note in done.answer["notes"] if "was left out" in note]
    assert said == [
        "A picture was left out, for it shows nothing of what is fitted. Picture 1 (side.exr): The camera does not see "
        "'Wall': move it into the frame."
    ]
    assert json.loads((tmp_path / "job" / "request.json").read_text("utf-8"))["picture"]["number"] == 2
