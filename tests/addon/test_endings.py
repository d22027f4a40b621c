# SPDX-License-Identifier: Apache-2.0
"""How fits end otherwise than with a result: cancelled, killed, by another file, with the add-on, refused."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import pytest

from .fake_backend import RECOVERED, write_result
from .test_operators import FLOAT32, fit, plain, runtime, sockets, step_until


def test_cancel_keeps_the_best_values(scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    from blender_addon.running import running_job

    monkeypatch.setattr("blender_addon.process.job_process.CANCEL_GRACE", 3600.0)  # the fake answers, nobody kills it
    monkeypatch.setenv("MFO_FAKE", json.dumps({"seconds": 60}))
    assert fit(scene, wait=False) == {"FINISHED"}
    assert not scene.bpy.ops.mfo.fit.poll()
    step_until(scene, lambda: runtime(scene).fraction > 0)
    assert runtime(scene).progress_text.startswith("Refining · ")
    for stage, said in (("Floor: start", "Refining · "), ("refine", "Checking the values")):
        running_job._handle(running_job.current, {"event": "stage_end", "stage": stage})
        assert runtime(scene).progress_text.startswith(said)
    assert scene.bpy.ops.mfo.cancel() == {"FINISHED"}
    assert not scene.bpy.ops.mfo.cancel.poll()
    step_until(scene, lambda: runtime(scene).state != "CANCELLING")
    assert runtime(scene).has_result
    assert "best values so far" in runtime(scene).sentence
    assert scene.bpy.ops.mfo.apply() == {"FINISHED"}


def test_a_fit_that_is_cancelled_before_it_began_has_not_failed(
    scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    from blender_addon.panel import run

    monkeypatch.setattr("blender_addon.process.job_process.CANCEL_GRACE", 3600.0)
    monkeypatch.setenv("MFO_FAKE", json.dumps({"end": "cancelled"}))
    assert fit(scene, wait=False) == {"FINISHED"}
    assert scene.bpy.ops.mfo.cancel() == {"FINISHED"}
    step_until(scene, lambda: runtime(scene).state != "CANCELLING")
    drawn: list[tuple[str, str]] = []
    monkeypatch.setattr(run, "draw_sentence", lambda _layout, _context, text, icon: drawn.append((text, icon)))
    run._draw_end(MagicMock(), scene.bpy.context)
    assert drawn == [("Cancelled before the fit had begun; nothing was changed.", "INFO")]
    assert not runtime(scene).has_result


def test_a_killed_backend_leaves_its_best_values(scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    bpy = scene.bpy
    before = {s.name: plain(s) for s in sockets(bpy) if hasattr(s, "default_value")}
    monkeypatch.setenv("MFO_FAKE", json.dumps({"end": "killed"}))
    with pytest.raises(RuntimeError, match=r"killed \(SIGKILL\).*best values so far are kept and can be applied"):
        fit(scene)
    assert runtime(scene).state == "FAILED"
    assert runtime(scene).has_result
    assert {r.name: r.result for r in runtime(scene).values}["Roughness"] == "0.312"
    kept = bpy.data.materials["Glaze"].mfo
    assert [(entry.partial, entry.job_folder) for entry in kept.history] == [(True, scene.job)]
    assert {s.name: plain(s) for s in sockets(bpy) if hasattr(s, "default_value")} == before  # until Apply

    assert bpy.ops.mfo.apply() == {"FINISHED"}
    assert sockets(bpy)["Roughness"].default_value == pytest.approx(RECOVERED["roughness"], abs=FLOAT32)
    assert bpy.ops.mfo.toggle(material="Glaze") == {"FINISHED"}
    assert sockets(bpy)["Roughness"].default_value == pytest.approx(0.5, abs=FLOAT32)
    assert bpy.ops.mfo.revert() == {"FINISHED"}
    assert {s.name: plain(s) for s in sockets(bpy) if hasattr(s, "default_value")} == before
    assert bpy.ops.mfo.apply(job_folder=scene.job) == {"FINISHED"}  # as in a later session
    left = json.loads(Path(scene.job, "result.json").read_text("utf-8"))
    assert (left["partial"], left["status"]) == (True, "failed")
    assert not Path(scene.job, "partial.json").exists()
    Path(scene.job, "partial.json").write_text("{}")
    monkeypatch.setenv("MFO_FAKE", "{}")
    assert fit(scene) == {"FINISHED"}  # a folder with one is still taken for a job, and is emptied
    assert not Path(scene.job, "partial.json").exists()


def test_an_addon_that_is_switched_off_says_what_became_of_its_fit(
    scene: SimpleNamespace, addon: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MFO_FAKE", json.dumps({"seconds": 60}))
    fit(scene, wait=False)
    step_until(scene, lambda: runtime(scene).fraction > 0)
    request = json.loads(Path(scene.job, "request.json").read_text("utf-8"))
    write_result(Path(scene.job), "partial", "failed", "The fit ended by itself.", request, partial=True)
    addon.unregister()
    addon.register()
    assert runtime(scene).state == "IDLE"
    assert runtime(scene).sentence == (
        "The fit of Glaze was ended as the add-on was switched off. Load Result shows its best values so far, from its "
        f"folder: {scene.job}"
    )
    assert scene.bpy.ops.mfo.open_job(directory=scene.job) == {"FINISHED"}
    assert len(scene.bpy.data.materials["Glaze"].mfo.history) == 1


def test_opening_a_file_ends_the_running_fit(scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    from blender_addon.running import running_job

    monkeypatch.setenv("MFO_FAKE", json.dumps({"seconds": 60, "end": "deaf"}))
    fit(scene, wait=False)
    process = running_job.current.process
    scene.bpy.ops.wm.read_factory_settings()
    assert process.outcome is not None
    assert running_job.current is None
    assert runtime(scene).state == "IDLE"


def test_what_a_file_that_was_never_saved_leaves_is_one_press_away(
    scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch
) -> None:
    from blender_addon.panel import run

    monkeypatch.setenv("MFO_FAKE", json.dumps({"seconds": 8}))
    fit(scene, wait=False)
    step_until(scene, lambda: runtime(scene).fraction > 0)
    scene.bpy.ops.wm.read_factory_settings()
    assert f"Load Result shows its best values so far, from its folder: {scene.job}" in runtime(scene).sentence
    layout = MagicMock()
    monkeypatch.setattr(run, "draw_sentence", lambda *_: None)  # a Blender without windows has no width
    run._draw_end(layout, scene.bpy.context)
    box = layout.box.return_value
    box.operator.assert_called_once_with("mfo.open_job", text="Load Result", icon="FILE_FOLDER")
    assert (box.operator_context, box.operator.return_value.directory) == ("EXEC_DEFAULT", scene.job)
    assert scene.bpy.ops.mfo.open_job(directory=scene.job) == {"FINISHED"}
    assert runtime(scene).has_result
    scene.bpy.ops.wm.read_factory_settings()
    assert (runtime(scene).sentence, runtime(scene).job_folder) == ("", "")


def test_disable_and_enable_with_a_running_fit(scene: SimpleNamespace, addon, monkeypatch: pytest.MonkeyPatch) -> None:
    from blender_addon.running import running_job

    bpy = scene.bpy
    handlers = {name: len(getattr(bpy.app.handlers, name)) for name in ("load_pre", "load_post", "undo_post")}
    monkeypatch.setenv("MFO_FAKE", json.dumps({"seconds": 60}))
    for _ in range(3):
        fit(scene, wait=False)
        process = running_job.current.process
        addon.unregister()
        assert process.outcome is not None
        assert not hasattr(bpy.types.Scene, "mfo")
        assert not hasattr(bpy.types.Material, "mfo")
        assert not hasattr(bpy.types.WindowManager, "mfo_runtime")
        assert not [n for n in dir(bpy.types) if n.startswith("MFO_")]
        assert not hasattr(bpy.ops.mfo, "fit") or "fit" not in dir(bpy.ops.mfo)
        addon.register()
        Path(scene.job, "result.json").unlink(missing_ok=True)
        scene.job += "x"
    assert {name: len(getattr(bpy.app.handlers, name)) for name in handlers} == handlers


@pytest.mark.parametrize("end", ["refused", "failed", "crash"])
def test_a_refusal_is_said_until_what_it_was_about_is_changed(
    scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, end: str
) -> None:
    from blender_addon.running import running_job

    monkeypatch.setenv("MFO_FAKE", json.dumps({"end": end}))
    context, settings = scene.bpy.context, scene.bpy.context.scene.mfo
    settings.reference_path = "/nowhere/reference.exr" if end == "refused" else scene.reference
    with pytest.raises(RuntimeError):
        scene.bpy.ops.mfo.fit(job_folder=scene.job)
    assert runtime(scene).state == "FAILED"
    assert not running_job.is_answered(context)
    settings.reference_path = scene.reference + " other"
    assert running_job.is_answered(context) == (end != "crash")  # which no other picture mends
