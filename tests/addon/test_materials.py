# SPDX-License-Identifier: Apache-2.0
"""Several materials in the panel: the list, one fit, a verdict and a history for each, one step to apply."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from blender_addon.result import shown_result

from .check.test_libraries import from_library
from .fake_backend import RECOVERED


@pytest.fixture
def two(scene: SimpleNamespace) -> SimpleNamespace:
    """The cube on a floor, both listed."""
    bpy = scene.bpy
    bpy.ops.mesh.primitive_plane_add(size=20.0, location=(0.0, 0.0, -1.0))
    floor = bpy.context.object
    floor.name = "Floor"
    floor.data.materials.append(bpy.data.materials["Glaze"].copy())
    floor.active_material.name = "Wood"
    bpy.context.scene.mfo.reference_path = scene.reference
    assert bpy.ops.mfo.list_materials() == {"FINISHED"}
    return scene


def rough(scene: SimpleNamespace, name: str) -> float:
    nodes = scene.bpy.data.materials[name].node_tree.nodes
    return next(n for n in nodes if n.type == "BSDF_PRINCIPLED").inputs["Roughness"].default_value


def test_the_list_holds_what_the_camera_sees_and_keeps_what_was_unticked(two: SimpleNamespace) -> None:
    entries = two.bpy.context.scene.mfo.targets
    assert [(e.material.name, e.object.name, e.use) for e in entries] == [
        ("Wood", "Floor", True),
        ("Glaze", "Väse", True),
    ]
    entries[0].use = False
    two.bpy.ops.mfo.list_materials()
    assert [e.use for e in entries] == [False, True]
    two.bpy.ops.mfo.clear_materials()
    assert not entries


def test_the_list_holds_what_the_cameras_of_the_pictures_see(two: SimpleNamespace) -> None:
    """The first camera looks at the floor alone; the second, at frame 7, at the vase, which is out of sight before."""
    bpy = two.bpy
    scene, vase = bpy.context.scene, bpy.data.objects["Väse"]
    for frame, place in ((1, (0.0, 0.0, -50.0)), (7, tuple(vase.location))):
        vase.location = place
        vase.keyframe_insert("location", frame=frame)
    scene.frame_set(1)
    bpy.ops.mfo.list_materials()
    assert [e.material.name for e in scene.mfo.targets] == ["Wood"]
    assert bpy.ops.mfo.add_picture() == {"FINISHED"}
    scene.mfo.pictures[0].camera, scene.mfo.pictures[0].frame = scene.camera, 7
    bpy.ops.mfo.list_materials()
    assert [e.material.name for e in scene.mfo.targets] == ["Wood", "Glaze"]
    assert (scene.frame_current, scene.frame_subframe) == (1, 0.0)
    scene.mfo.pictures[0].use = False
    bpy.ops.mfo.list_materials()
    assert [e.material.name for e in scene.mfo.targets] == ["Wood"]


def test_both_are_fitted_shown_applied_and_kept(two: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    bpy, runtime = two.bpy, two.bpy.context.window_manager.mfo_runtime
    before = rough(two, "Wood"), rough(two, "Glaze")
    assert bpy.ops.mfo.fit(job_folder=two.job) == {"FINISHED"}
    request = json.loads((Path(two.job) / "request.json").read_text("utf-8"))
    assert request["targets"] == ["targets/1", "targets/2"]
    assert "queue" not in request["fit"]
    assert [(row.name, row.words) for row in runtime.materials] == [("Wood", "same"), ("Glaze", "same")]
    assert shown_result.result is not None
    assert shown_result.result.material_name == "Wood"
    assert bpy.ops.mfo.show_material(index=1) == {"FINISHED"}
    assert shown_result.result.material_name == "Glaze"
    assert runtime.shown_material == 1
    histories = [bpy.data.materials[name].mfo.history for name in ("Wood", "Glaze")]
    assert [Path(history[0].job_folder).name for history in histories] == ["1", "2"]
    bpy.context.scene.mfo.queue = True
    assert bpy.ops.mfo.fit(job_folder=two.job) == {"FINISHED"}
    assert json.loads((Path(two.job) / "request.json").read_text("utf-8"))["fit"]["queue"] is True

    bpy.ops.ed.undo_push(message="before apply")
    assert bpy.ops.mfo.apply("EXEC_DEFAULT", True) == {"FINISHED"}
    assert (rough(two, "Wood"), rough(two, "Glaze")) == pytest.approx((RECOVERED["roughness"],) * 2)
    bpy.ops.ed.undo()  # one step for both
    assert (rough(two, "Wood"), rough(two, "Glaze")) == before


def test_values_inside_nodes_are_chosen_for_each_material(two: SimpleNamespace) -> None:
    """Both have nodes of the same names; a press in the panel is for one of them."""
    bpy, settings = two.bpy, two.bpy.context.scene.mfo
    for name in ("Wood", "Glaze"):
        tree = bpy.data.materials[name].node_tree
        shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
        noise, ramp = tree.nodes.new("ShaderNodeTexNoise"), tree.nodes.new("ShaderNodeValToRGB")
        tree.links.new(noise.outputs[0], ramp.inputs[0])
        tree.links.new(ramp.outputs[0], shader.inputs["Base Color"])
    settings.parameter_set, settings.sockets = "chosen", set()
    assert bpy.ops.mfo.choose_node_value(name="Glaze/Color Ramp/Stop 1") == {"FINISHED"}
    assert bpy.ops.mfo.choose_node_value(name="Wood/Color Ramp/Stop 0") == {"FINISHED"}
    assert bpy.ops.mfo.fit(job_folder=two.job) == {"FINISHED"}
    found = {}
    for path in Path(two.job).glob("targets/*/request.json"):
        request = json.loads(path.read_text("utf-8"))
        inside = [value["name"] for value in request["graph"]["values"]]
        found[request["target"]["material"]] = (request["fit"]["parameters"], inside)
    assert found == {"Wood": ([], ["Color Ramp/Stop 0"]), "Glaze": ([], ["Color Ramp/Stop 1"])}

    # one of them has a link there, and its own value is fitted nowhere
    tree = bpy.data.materials["Wood"].node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], shader.inputs["Roughness"])
    settings.sockets = {"roughness", "metallic"}
    bpy.ops.mfo.limit_value(name="metallic")
    assert bpy.ops.mfo.fit(job_folder=two.job) == {"FINISHED"}
    requests = [json.loads(path.read_text("utf-8")) for path in Path(two.job).glob("targets/*/request.json")]
    asked = {each["target"]["material"]: each["fit"]["parameters"] for each in requests}
    assert asked == {"Wood": ["metallic"], "Glaze": ["metallic", "roughness"]}
    assert all(each["fit"]["bounds"] == {"metallic": [0.0, 1.0]} for each in requests)

    settings.targets[0].use = False  # the cube is the active object and alone
    bpy.data.objects["Floor"].hide_render = True  # its nodes would be baked
    settings.sockets = set()
    bpy.context.view_layer.objects.active = bpy.data.objects["Väse"]
    assert bpy.ops.mfo.fit(job_folder=two.job) == {"FINISHED"}
    request = json.loads((Path(two.job) / "request.json").read_text("utf-8"))
    assert [value["name"] for value in request["graph"]["values"]] == ["Color Ramp/Stop 1"]


def test_one_that_does_not_match_stays_until_it_is_forced(
    two: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MFO_FAKE", json.dumps({"different": ["Wood"]}))
    bpy, before = two.bpy, rough(two, "Wood")
    assert bpy.ops.mfo.fit(job_folder=two.job) == {"FINISHED"}
    assert bpy.ops.mfo.apply(job_folder=two.job) == {"FINISHED"}
    assert (rough(two, "Wood"), rough(two, "Glaze")) == pytest.approx((before, RECOVERED["roughness"]))
    assert bpy.ops.mfo.apply(job_folder=two.job, force=True) == {"FINISHED"}
    assert rough(two, "Wood") == pytest.approx(RECOVERED["roughness"])


def test_what_cannot_be_fitted_together_is_said_first(two: SimpleNamespace) -> None:
    entries = two.bpy.context.scene.mfo.targets
    for entry in entries:
        entry.use = False
    with pytest.raises(RuntimeError, match="No material of the list is ticked"):
        two.bpy.ops.mfo.fit(job_folder=two.job)
    entries[1].use = True  # one alone is a fit of one material
    assert two.bpy.ops.mfo.fit(job_folder=two.job) == {"FINISHED"}
    assert "targets" not in json.loads((Path(two.job) / "request.json").read_text("utf-8"))


@pytest.mark.parametrize("gone", ["object", "unlinked", "slot", "material"])
def test_a_ticked_material_that_is_not_there_any_more_is_named(two: SimpleNamespace, gone: str) -> None:
    from blender_addon.check import checks

    bpy = two.bpy
    floor, wood = bpy.data.objects["Floor"], bpy.data.materials["Wood"]
    if gone == "object":
        bpy.data.objects.remove(floor)
    elif gone == "unlinked":
        floor.users_collection[0].objects.unlink(floor)
    elif gone == "slot":
        floor.data.materials[0] = bpy.data.materials.new("Stone")
    else:
        bpy.data.materials.remove(wood)
    bpy.context.view_layer.objects.active = bpy.data.objects["Väse"]
    said = {
        "slot": "Material 'Wood' is left out: 'Floor' does not have it any more.",
        "material": "A material of the list is left out: it is not in the file any more.",
    }.get(gone, "Material 'Wood' is left out: its object is not in the scene any more.")

    def found() -> list[tuple[str, str]]:
        every = checks.quick_check(bpy.context.scene, bpy.context.view_layer)
        return [(each.level, each.sentence) for each in every if "left out" in each.sentence]

    assert found() == [("ignored", f"{said} List the materials anew.")]
    assert bpy.ops.mfo.fit(job_folder=two.job) == {"FINISHED"}
    assert f"{said} List the materials anew." in [m.name for m in bpy.context.window_manager.mfo_runtime.messages]
    bpy.context.scene.mfo.targets[1].use = False
    assert found() == [("stops", f"{said} List the materials anew.")]
    with pytest.raises(RuntimeError, match="is left out"):
        bpy.ops.mfo.fit(job_folder=two.job)
    bpy.context.scene.mfo.targets[0].use = False
    assert found() == []


def test_a_finished_job_is_opened_with_all_its_results(two: SimpleNamespace) -> None:
    bpy, runtime = two.bpy, two.bpy.context.window_manager.mfo_runtime
    assert bpy.ops.mfo.fit(job_folder=two.job) == {"FINISHED"}
    for name in ("Wood", "Glaze"):
        bpy.data.materials[name].mfo.history.clear()
    assert bpy.ops.mfo.open_job(directory=two.job) == {"FINISHED"}
    assert [row.name for row in runtime.materials] == ["Wood", "Glaze"]
    assert [len(bpy.data.materials[name].mfo.history) for name in ("Wood", "Glaze")] == [1, 1]
    with pytest.raises(RuntimeError, match="leave the name out"):
        bpy.ops.mfo.open_job(directory=two.job, material="Wood")


def test_a_material_of_a_library_is_said_before_the_fit(two: SimpleNamespace, tmp_path: Path) -> None:
    two.bpy.data.objects["Floor"].active_material = from_library(two, tmp_path, "materials", "Wood")
    assert two.bpy.ops.mfo.list_materials() == {"FINISHED"}
    with pytest.raises(RuntimeError, match="Material 'Wood' comes from a library: make it local first"):
        two.bpy.ops.mfo.fit(job_folder=two.job)
    assert not Path(two.job).exists()
