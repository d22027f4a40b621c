# SPDX-License-Identifier: Apache-2.0
"""Fit, apply, undo, revert and their refusals in Blender as a module, with a backend that only pretends."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest

from .fake_backend import RECOVERED

FLOAT32 = 1e-6  # sockets hold float32


def sockets(bpy, material: str = "Glaze"):
    nodes = bpy.data.materials[material].node_tree.nodes
    return next(n for n in nodes if n.type == "BSDF_PRINCIPLED").inputs


def fit(scene: SimpleNamespace, **options: object) -> set[str]:
    return scene.bpy.ops.mfo.fit(**{"reference": scene.reference, "job_folder": scene.job, "object": "Väse"} | options)


def runtime(scene: SimpleNamespace):
    return scene.bpy.context.window_manager.mfo_runtime


def test_fit_apply_undo_redo_revert(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    assert fit(scene) == {"FINISHED"}
    assert runtime(scene).state == "DONE"
    assert next((r.name, r.start, r.result) for r in runtime(scene).errors) == ("FLIP", "0.21", "0.012")
    shown = {r.name: (r.start, r.result) for r in runtime(scene).values}
    assert shown["Roughness"] == ("0.5", "0.312")
    assert shown["Base Color"][0] == "#E7E7E7"  # 0.8 linear, IEC 61966-2-1
    bpy.ops.ed.undo_push(message="before apply")
    before = {s.name: plain(s) for s in sockets(bpy) if hasattr(s, "default_value")}

    assert bpy.ops.mfo.apply("EXEC_DEFAULT", True) == {"FINISHED"}
    assert sockets(bpy)["Roughness"].default_value == pytest.approx(RECOVERED["roughness"], abs=FLOAT32)
    assert sockets(bpy)["Metallic"].default_value == pytest.approx(RECOVERED["metallic"], abs=FLOAT32)
    applied = plain(sockets(bpy)["Base Color"])
    assert applied != before["Base Color"]

    bpy.ops.ed.undo()
    assert {s.name: plain(s) for s in sockets(bpy) if hasattr(s, "default_value")} == before
    assert not bpy.data.materials["Glaze"].mfo.originals
    bpy.ops.ed.redo()
    assert plain(sockets(bpy)["Base Color"]) == applied

    assert bpy.ops.mfo.apply() == {"FINISHED"}  # twice: the originals stay the user's
    assert bpy.ops.mfo.revert() == {"FINISHED"}
    assert {s.name: plain(s) for s in sockets(bpy) if hasattr(s, "default_value")} == before
    with pytest.raises(RuntimeError, match="Nothing was applied to material 'Glaze'"):
        bpy.ops.mfo.revert()


def test_twenty_undos_and_redos(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    fit(scene)
    bpy.ops.ed.undo_push(message="before apply")
    bpy.ops.mfo.apply("EXEC_DEFAULT", True)
    for _ in range(20):
        bpy.ops.ed.undo()
        assert sockets(bpy)["Roughness"].default_value == pytest.approx(0.5, abs=FLOAT32)
        bpy.ops.ed.redo()
        assert sockets(bpy)["Roughness"].default_value == pytest.approx(RECOVERED["roughness"], abs=FLOAT32)


def test_apply_finds_the_material_after_a_rename(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    fit(scene)
    bpy.data.materials["Glaze"].name = "Other"
    bpy.data.objects["Väse"].name = "Vase.001"
    bpy.ops.mfo.apply()
    assert sockets(bpy, "Other")["Roughness"].default_value == pytest.approx(RECOVERED["roughness"], abs=FLOAT32)


def test_apply_says_when_the_material_is_gone(scene: SimpleNamespace) -> None:
    fit(scene)
    scene.bpy.data.materials.remove(scene.bpy.data.materials["Glaze"])
    with pytest.raises(RuntimeError, match="Material 'Glaze' is not in this file"):
        scene.bpy.ops.mfo.apply()


@pytest.mark.parametrize("change", ["nothing", "deleted", "replaced", "listed", "node group"])
def test_values_on_a_material_that_nothing_has_any_more_are_named(
    scene: SimpleNamespace, change: str, capfd: pytest.CaptureFixture[str]
) -> None:
    bpy = scene.bpy
    assert bpy.ops.mfo.fit(reference=scene.reference, job_folder=scene.job) == {"FINISHED"}
    vase, glaze = bpy.data.objects["Väse"], bpy.data.materials["Glaze"]
    if change in ("deleted", "node group"):
        bpy.data.objects.remove(vase)  # its mesh stays, and has the material
    elif change != "nothing":
        vase.material_slots[0].material = bpy.data.materials.new("Stone")
    if change == "listed":
        bpy.context.scene.mfo.targets.add().material = glaze
    elif change == "node group":
        group = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
        group.use_fake_user = True
        group.nodes.new("GeometryNodeSetMaterial").inputs["Material"].default_value = glaze
    assert bpy.ops.mfo.apply() == {"FINISHED"}
    is_said = "Material 'Glaze' is on no object any more" in capfd.readouterr().out
    assert is_said == (change in ("deleted", "replaced", "listed"))


def test_apply_in_a_later_session(scene: SimpleNamespace, tmp_path: Path) -> None:
    bpy = scene.bpy
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    fit(scene)
    bpy.ops.wm.open_mainfile(filepath=path)
    assert runtime(scene).state == "IDLE"
    with pytest.raises(RuntimeError, match="There is no result yet"):
        bpy.ops.mfo.apply()
    assert bpy.ops.mfo.apply(job_folder=scene.job) == {"FINISHED"}
    assert sockets(bpy)["Roughness"].default_value == pytest.approx(RECOVERED["roughness"], abs=FLOAT32)
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=path)
    assert bpy.data.materials["Glaze"].mfo.job_folder == scene.job
    bpy.ops.mfo.revert(material="Glaze")  # the originals are in the file
    assert sockets(bpy)["Roughness"].default_value == pytest.approx(0.5, abs=FLOAT32)


def test_apply_leaves_links_alone(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    fit(scene)
    tree = bpy.data.materials["Glaze"].node_tree
    value = tree.nodes.new("ShaderNodeValue")
    tree.links.new(value.outputs[0], sockets(bpy)["Roughness"])
    bpy.ops.mfo.apply()
    assert sockets(bpy)["Roughness"].is_linked
    assert sockets(bpy)["Roughness"].default_value == pytest.approx(0.5, abs=FLOAT32)
    assert sockets(bpy)["Metallic"].default_value == pytest.approx(RECOVERED["metallic"], abs=FLOAT32)
    assert "Roughness" not in bpy.data.materials["Glaze"].mfo.originals


def test_request_follows_operator_and_settings(scene: SimpleNamespace) -> None:
    settings = scene.bpy.context.scene.mfo
    settings.parameter_set, settings.parameters = "chosen", {"roughness", "base_color"}
    settings.max_iterations, settings.model, settings.preset = 7, "mitsuba_principled", "paper"
    fit(scene)
    asked = json.loads(Path(scene.job, "request.json").read_text("utf-8"))["fit"]
    assert {k: asked[k] for k in ("preset", "parameters", "max_iterations")} == {
        "preset": "paper", "parameters": ["base_color", "roughness"], "max_iterations": 7,
    }  # fmt: skip
    settings.model, settings.sockets = "blender_principled", {"ior", "metallic"}
    fit(scene, job_folder=scene.job + "1")
    asked = json.loads(Path(scene.job + "1", "request.json").read_text("utf-8"))["fit"]
    assert (asked["model"], asked["parameters"]) == ("blender_principled", ["metallic", "ior"])
    other = scene.job + "2"
    fit(scene, parameters="metallic, eta", max_iterations=9, range="ldr", job_folder=other)
    asked = json.loads(Path(other, "request.json").read_text("utf-8"))["fit"]
    assert (asked["parameters"], asked["max_iterations"], asked["range"]) == (["metallic", "eta"], 9, "ldr")


def test_a_chosen_value_with_a_link_is_left_out_as_its_box_in_the_panel_says(scene: SimpleNamespace) -> None:
    bpy, settings = scene.bpy, scene.bpy.context.scene.mfo
    tree = bpy.data.materials["Glaze"].node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    noise = tree.nodes.new("ShaderNodeTexNoise")
    link = tree.links.new(noise.outputs[0], shader.inputs["Roughness"])
    settings.parameter_set, settings.sockets = "chosen", {"roughness", "metallic"}
    for name, muted, expected in (("linked", False, ["metallic"]), ("muted", True, ["metallic", "roughness"])):
        link.is_muted = muted
        fit(scene, job_folder=scene.job + name)
        asked = json.loads(Path(scene.job + name, "request.json").read_text("utf-8"))["fit"]
        assert asked["parameters"] == expected


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"object": "Nobody"}, "no object 'Nobody'"),
        ({"object": "Light"}, "'Light'"),
        ({"reference": ""}, "No reference is chosen"),
        ({"reference": "/nowhere/reference.exr"}, "/nowhere/reference.exr"),
        ({"range": "wide"}, "range is 'wide'"),
        ({"parameters": ","}, "parameter"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_no_folder(scene: SimpleNamespace, options: dict, words: str) -> None:
    with pytest.raises(RuntimeError, match=words):
        fit(scene, **options)
    assert not Path(scene.job).exists()
    assert runtime(scene).state == "FAILED"
    assert words.split("/")[-1] in runtime(scene).sentence


def test_no_backend_python(scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("MFO_BACKEND_PYTHON")
    with pytest.raises(RuntimeError, match="backend Python is missing"):
        fit(scene)
    assert not Path(scene.job).exists()


def test_no_principled_node(scene: SimpleNamespace) -> None:
    tree = scene.bpy.data.materials["Glaze"].node_tree
    tree.nodes.remove(next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED"))
    with pytest.raises(RuntimeError, match="'Glaze' has no Principled BSDF"):
        fit(scene)


@pytest.mark.parametrize(
    ("end", "words"), [("failed", "Reference is 128x128"), ("crash", "crashed .SIGABRT.*far away library")]
)
def test_failures_of_the_backend_reach_the_script(
    scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, end: str, words: str
) -> None:
    monkeypatch.setenv("MFO_FAKE", json.dumps({"end": end}))
    with pytest.raises(RuntimeError, match=words):
        fit(scene)
    assert runtime(scene).state == "FAILED"
    assert not runtime(scene).has_result
    assert Path(scene.job).exists() == (end == "crash")  # bad input leaves nothing, a crash leaves its log


def step_until(scene: SimpleNamespace, done) -> None:
    from blender_addon.running import running_job

    end = time.monotonic() + 20
    while not done():
        assert time.monotonic() < end
        running_job.step()
        time.sleep(0.01)


def test_how_sure_a_value_is(tmp_path: Path) -> None:
    """Two standard deviations to each side, within what the fit could have chosen; null stands for infinity."""
    from blender_addon.result.job_result import read_job_result

    (tmp_path / "request.json").write_text(json.dumps({"schema_version": 1, "target": {}}))
    levels = {"roughness": ([0.05], "weak"), "metallic": ([0.1], "doubtful"), "sheen_weight": ([None], "weak")}
    certainty = {name: {"sd": sd, "level": level} for name, (sd, level) in levels.items()}
    certainty["ior"] = {"sd": [0.1], "level": "weak"}
    result = {
        "schema_version": 1, "status": "converged", "model": "blender_principled", "recovered": {"roughness": 0.1},
        "certainty": certainty, "bounds": {name: [0.05, 1.05] for name in levels},
    }  # fmt: skip
    (tmp_path / "result.json").write_text(json.dumps(result))
    found = read_job_result(tmp_path)
    assert found.likely("roughness", 0.1) == pytest.approx((0.05, 0.2))
    assert found.likely("sheen_weight", 0.5) == (0.05, 1.05)
    assert found.likely("ior", 1.5) is None
    names = ("roughness", "metallic", "sheen_weight", "ior")
    assert [found.sureness(name) for name in names] == pytest.approx([0.8, 0.0, 0.0, -1.0])


def test_values_are_copied_as_text(scene: SimpleNamespace) -> None:
    from blender_addon.operators.pictures import values_as_text

    assert not scene.bpy.ops.mfo.copy_values.poll()
    fit(scene)
    assert scene.bpy.ops.mfo.copy_values() == {"FINISHED"}
    text = values_as_text(runtime(scene).values)
    color = "#8BBF48" if scene.bpy.app.version >= (5, 0, 0) else "#8BBE48"  # Blender converts, and rounds otherwise
    assert text.splitlines() == [f"Base Color: {color}", "Metallic: 0.125", "Roughness: 0.312"]


def test_damaged_results_are_refused(scene: SimpleNamespace) -> None:
    fit(scene)
    path = Path(scene.job, "result.json")
    good = json.loads(path.read_text())
    for change, words in (
        ({"schema_version": 2}, "schema_version 2"),
        ({"recovered": {"roughness": float("nan")}}, "damaged"),
        ({"recovered": 3}, "damaged"),
        ({"model": "phong"}, "model 'phong'"),
    ):
        path.write_text(json.dumps(good | change))
        with pytest.raises(RuntimeError, match=words):
            scene.bpy.ops.mfo.apply(job_folder=scene.job)
    path.write_text("{")
    with pytest.raises(RuntimeError, match="cannot be read"):
        scene.bpy.ops.mfo.apply(job_folder=scene.job)


def test_blender_model_names_are_socket_names(scene: SimpleNamespace) -> None:
    fit(scene)
    path = Path(scene.job, "result.json")
    found = json.loads(path.read_text())
    found |= {"model": "blender_principled", "recovered": {"ior": 1.75, "coat_tint": [0.5, 0.25, 1.0]}}
    path.write_text(json.dumps(found))
    scene.bpy.ops.mfo.apply(job_folder=scene.job)
    assert sockets(scene.bpy)["IOR"].default_value == pytest.approx(1.75)
    assert plain(sockets(scene.bpy)["Coat Tint"]) == pytest.approx((0.5, 0.25, 1.0, 1.0), abs=FLOAT32)


def test_reference_from_an_image_of_the_file(scene: SimpleNamespace) -> None:
    settings = scene.bpy.context.scene.mfo
    settings.reference_source = "IMAGE"
    with pytest.raises(RuntimeError, match="No reference is chosen"):
        fit(scene, reference="")
    settings.reference_image = scene.bpy.data.images.load(scene.reference)
    assert fit(scene, reference="") == {"FINISHED"}


def test_how_the_picture_was_made_is_the_scenes_setting_or_the_scripts(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    bpy.context.scene.view_settings.view_transform = "AgX"
    assert fit(scene) == {"FINISHED"}
    assert fit(scene, job_folder=scene.job + "1", reference_view="standard") == {"FINISHED"}
    bpy.context.scene.mfo.reference_view = "standard"
    assert fit(scene, job_folder=scene.job + "2") == {"FINISHED"}
    with pytest.raises(RuntimeError, match="reference_view is 'photo': give 'scene' or 'standard'"):
        fit(scene, job_folder=scene.job + "3", reference_view="photo")
    for job, table in ((scene.job, True), (scene.job + "1", False), (scene.job + "2", False)):
        request = json.loads(Path(job, "request.json").read_text("utf-8"))
        assert ("lut" in request["view"]) == table
        assert Path(job, "view_lut.exr").is_file() == table


def test_nothing_heavy_is_in_blenders_process(scene: SimpleNamespace) -> None:
    import subprocess

    code = (
        "import bpy, sys, blender_addon; blender_addon.register();"
        f"bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 96, 64;"
        "bpy.context.scene.view_settings.view_transform = 'Standard';"
        f"bpy.ops.mfo.fit(reference={scene.reference!r}, job_folder={scene.job!r}); bpy.ops.mfo.apply();"
        "print(sorted({'mitsuba', 'drjit', 'OpenEXR', 'mfo_backend', 'scipy'} & set(sys.modules)), flush=True);"
        "import os; os._exit(0)"  # bpy 4.2 may crash in its destructors, with or without an add-on
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_colours_follow_the_working_space(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    if not hasattr(bpy.data, "colorspace"):
        pytest.skip("this Blender has one working space")
    fit(scene)
    path = Path(scene.job, "result.json")
    found = json.loads(path.read_text())
    path.write_text(
        json.dumps(found | {"model": "blender_principled", "recovered": {"base_color": [0.25, 0.5, 0.0625]}})
    )
    bpy.ops.wm.set_working_color_space(working_space="Linear Rec.2020", convert_colors=False)
    bpy.ops.mfo.apply(job_folder=scene.job)
    # ITU-R BT.2087-0, table 1: linear BT.709 to BT.2020
    matrix = ((0.6274, 0.3293, 0.0433), (0.0691, 0.9195, 0.0114), (0.0164, 0.0880, 0.8956))
    wanted = [sum(m * c for m, c in zip(row, (0.25, 0.5, 0.0625), strict=True)) for row in matrix]
    assert plain(sockets(bpy)["Base Color"])[:3] == pytest.approx(wanted, abs=1e-4)  # the table has four digits
    bpy.ops.mfo.revert()
    assert plain(sockets(bpy)["Base Color"]) == pytest.approx((0.8, 0.8, 0.8, 1.0), abs=FLOAT32)


def plain(socket) -> object:
    value = socket.default_value
    return value if isinstance(value, (int, float, str)) else tuple(value)
