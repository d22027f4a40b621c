# SPDX-License-Identifier: Apache-2.0
"""Results of a file that was left: on the shelf until the file is saved, back when it is opened, none told twice."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest


@pytest.fixture
def kept(scene: SimpleNamespace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The module, with a shelf of the test's own and the scene in a file; `job` is the folder of a finished fit."""
    from blender_addon.running import kept_results

    monkeypatch.setattr(kept_results, "shelf_folder", lambda: tmp_path / "shelf")
    scene.blend = str(tmp_path / "vase.blend")
    scene.bpy.ops.wm.save_as_mainfile(filepath=scene.blend)
    assert scene.bpy.ops.mfo.fit(reference=scene.reference, job_folder=scene.job, object="Väse") == {"FINISHED"}
    return kept_results


def history(scene: SimpleNamespace):
    return scene.bpy.data.materials["Glaze"].mfo.history


def test_a_result_that_was_not_saved_comes_back_until_the_file_is_saved(scene: SimpleNamespace, kept) -> None:
    open_file = scene.bpy.ops.wm.open_mainfile
    kept.keep(Path(scene.job))
    open_file(filepath=scene.blend)
    assert not history(scene)
    assert kept.restore() == ["The history of Glaze has results that were not saved: save the file to keep them."]
    assert [entry.job_folder for entry in history(scene)] == [scene.job]
    kept.restore()
    assert len(history(scene)) == 1  # no second time
    open_file(filepath=scene.blend)  # left without saving
    assert len(kept.restore()) == 1
    scene.bpy.ops.wm.save_mainfile()
    kept.saved([])
    open_file(filepath=scene.blend)
    assert (len(history(scene)), kept.restore()) == (1, [])


def test_a_result_in_a_material_that_is_not_saved_waits_on(scene: SimpleNamespace, kept) -> None:
    """A material that nothing uses is not written, and its history with it."""
    kept.keep(Path(scene.job))
    mesh = scene.bpy.data.objects["Väse"].data
    scene.bpy.data.objects.remove(scene.bpy.data.objects["Väse"])
    scene.bpy.data.meshes.remove(mesh)
    assert len(history(scene)) == 1
    scene.bpy.ops.wm.save_mainfile()
    kept.saved([])
    scene.bpy.ops.wm.open_mainfile(filepath=scene.blend)
    assert "Glaze" not in scene.bpy.data.materials
    assert kept.restore() == [
        f"A result that was not saved is of Glaze, which this file does not have: {scene.job}",
    ]


def test_another_file_gets_nothing(scene: SimpleNamespace, kept, tmp_path: Path) -> None:
    kept.keep(Path(scene.job))
    other = str(tmp_path / "other.blend")
    shutil.copy(scene.blend, other)
    scene.bpy.ops.wm.open_mainfile(filepath=other)
    assert kept.restore() == []
    kept.saved([])  # which does not take it off
    scene.bpy.ops.wm.open_mainfile(filepath=scene.blend)
    assert len(kept.restore()) == 1


def test_the_best_values_of_a_backend_that_died_come_back(scene: SimpleNamespace, kept) -> None:
    folder = Path(scene.job)
    (folder / "result.json").rename(folder / "partial.json")
    kept.keep(folder)
    scene.bpy.ops.wm.open_mainfile(filepath=scene.blend)
    assert len(kept.restore()) == 1
    assert (folder / "result.json").is_file()


def test_a_job_that_another_blender_is_at_is_left_alone(scene: SimpleNamespace, kept, tmp_path: Path) -> None:
    folder = Path(scene.job)
    (folder / "result.json").rename(folder / "partial.json")
    kept.keep(folder)
    note = next((tmp_path / "shelf").iterdir())
    note.write_text(json.dumps(json.loads(note.read_text("utf-8")) | {"pid": os.getppid()}), "utf-8")
    scene.bpy.ops.wm.open_mainfile(filepath=scene.blend)
    assert kept.restore() == []
    assert (folder / "partial.json").is_file()
    assert note.is_file()


@pytest.mark.parametrize("gone", ["folder", "result", "material"])
def test_what_cannot_come_back_is_forgotten(scene: SimpleNamespace, kept, tmp_path: Path, gone: str) -> None:
    folder = Path(scene.job)
    kept.keep(folder)
    scene.bpy.ops.wm.open_mainfile(filepath=scene.blend)
    if gone == "folder":
        shutil.rmtree(folder)
    elif gone == "result":
        (folder / "result.json").unlink()
    else:
        scene.bpy.data.materials["Glaze"].name = "Other"
    said = kept.restore()
    assert [f"{folder}" in sentence for sentence in said] == [True] * (gone == "material")
    assert not list((tmp_path / "shelf").iterdir())


def test_a_result_that_is_removed_does_not_come_back(scene: SimpleNamespace, kept) -> None:
    kept.keep(Path(scene.job))
    scene.bpy.context.view_layer.objects.active = scene.bpy.data.objects["Väse"]
    assert scene.bpy.ops.mfo.remove_past() == {"FINISHED"}
    scene.bpy.ops.wm.open_mainfile(filepath=scene.blend)
    assert (kept.restore(), len(history(scene))) == ([], 0)


def test_a_file_that_was_never_saved_has_no_shelf(scene: SimpleNamespace, kept, tmp_path: Path) -> None:
    scene.bpy.ops.wm.read_factory_settings()
    kept.keep(Path(scene.job))
    assert not (tmp_path / "shelf").exists()
    assert kept.restore() == []


@pytest.mark.parametrize(("end", "saved"), [("", True), ("", False), ("deaf", True)])
def test_it_is_said_what_became_of_the_fit(
    scene: SimpleNamespace, kept, monkeypatch: pytest.MonkeyPatch, end: str, saved: bool
) -> None:
    from blender_addon.running import running_job

    monkeypatch.setenv("MFO_FAKE", json.dumps({"seconds": 8, "end": end}))
    bpy = scene.bpy
    if not saved:
        bpy.ops.wm.read_homefile(use_factory_startup=True)
        bpy.context.scene.render.resolution_x, bpy.context.scene.render.resolution_y = 96, 64
        bpy.context.scene.view_settings.view_transform = "Standard"
    target = bpy.context.view_layer.objects.active or bpy.data.objects["Väse"]
    job = scene.job + "2"
    bpy.ops.mfo.fit(reference=scene.reference, job_folder=job, object=target.name, wait=False)
    while bpy.context.window_manager.mfo_runtime.fraction == 0.0:
        running_job.step()
    name = target.active_material.name
    bpy.ops.wm.read_factory_settings()
    said = bpy.context.window_manager.mfo_runtime.sentence
    assert said.startswith(f"The fit of {name} was ended as another file was opened. ")
    if end == "deaf":
        assert said.endswith("It had found no values yet.")
    elif saved:
        assert "Its best values so far are in the history when vase.blend is opened again." in said
    else:
        assert said.endswith(job)
