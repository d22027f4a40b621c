# SPDX-License-Identifier: Apache-2.0
"""Going back: the history of a material, A/B, the queue, and pictures of old jobs."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from ..fake_backend import RECOVERED
from ..test_operators import FLOAT32, fit, runtime, sockets, step_until


def glaze(scene: SimpleNamespace):
    return scene.bpy.data.materials["Glaze"]


def change_result(job: str, **recovered: object) -> None:
    path = Path(job, "result.json")
    found = json.loads(path.read_text())
    path.write_text(json.dumps(found | {"recovered": found["recovered"] | recovered}))


def test_results_are_kept_on_the_material_and_in_the_file(scene: SimpleNamespace, tmp_path: Path) -> None:
    bpy = scene.bpy
    fit(scene)
    fit(scene, job_folder=scene.job + "2", preset="fast")
    from blender_addon.result import shown_result

    assert shown_result.result is not None
    assert shown_result.result.weak_combinations == ("Metallic and roughness.",)
    history = glaze(scene).mfo.history
    assert [(e.preset, e.partial, round(e.flip, 4)) for e in history] == [
        ("fast", False, 0.012), ("balanced", False, 0.012),
    ]  # fmt: skip
    assert {v.name: v.certainty for v in history[0].values}["Roughness"] == "determined"
    path = str(tmp_path / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    shutil.rmtree(scene.job)
    bpy.ops.wm.open_mainfile(filepath=path)
    glaze(scene).mfo.history_index = 1
    assert bpy.ops.mfo.apply_past() == {"FINISHED"}  # its folder is gone, its values are here
    assert sockets(bpy)["Roughness"].default_value == pytest.approx(RECOVERED["roughness"], abs=FLOAT32)
    with pytest.raises(RuntimeError, match="There is no result"):
        bpy.ops.mfo.show_past()
    assert bpy.ops.mfo.remove_past() == {"FINISHED"}
    assert len(glaze(scene).mfo.history) == 1
    assert bpy.ops.mfo.show_past() == {"FINISHED"}
    assert runtime(scene).job_folder == scene.job + "2"


def test_every_result_can_come_back(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    for name, roughness in (("a", 0.25), ("b", 0.75)):
        fit(scene, job_folder=scene.job + name)
        change_result(scene.job + name, roughness=roughness)
        bpy.ops.mfo.open_job(directory=scene.job + name)
        bpy.ops.mfo.apply()
        assert sockets(bpy)["Roughness"].default_value == pytest.approx(roughness)
    assert len(glaze(scene).mfo.history) == 2  # a job that is opened again replaces itself
    glaze(scene).mfo.history_index = 1
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.mfo.apply_past("EXEC_DEFAULT", True)
    assert sockets(bpy)["Roughness"].default_value == pytest.approx(0.25)
    bpy.ops.ed.undo()
    assert sockets(bpy)["Roughness"].default_value == pytest.approx(0.75)
    bpy.ops.mfo.revert()
    assert sockets(bpy)["Roughness"].default_value == pytest.approx(0.5)
    assert len(glaze(scene).mfo.history) == 2


def test_history_is_bounded_and_keeps_what_is_applied(scene: SimpleNamespace) -> None:
    from blender_addon.result import history
    from blender_addon.result.job_result import read_job_result

    fit(scene)
    scene.bpy.ops.mfo.apply()
    for i in range(history.LIMIT + 3):
        folder = Path(f"{scene.job}_{i}")
        shutil.copytree(scene.job, folder)
        history.record(glaze(scene), read_job_result(folder))
    kept = [entry.job_folder for entry in glaze(scene).mfo.history]
    assert len(kept) == history.LIMIT
    assert kept[-1] == scene.job
    assert kept[0].endswith(f"_{history.LIMIT + 2}")


def test_a_and_b(scene: SimpleNamespace) -> None:
    bpy = scene.bpy
    with pytest.raises(RuntimeError, match="Nothing was applied"):
        bpy.ops.mfo.toggle()
    tree = glaze(scene).node_tree
    value = tree.nodes.new("ShaderNodeValue")
    tree.links.new(value.outputs[0], sockets(bpy)["Metallic"])
    fit(scene)
    bpy.ops.mfo.apply()
    graph = [(n.name, n.bl_idname) for n in tree.nodes], len(tree.links)
    sockets(bpy)["Roughness"].default_value = 0.375  # a change by hand belongs to the side it was made on
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.mfo.toggle("EXEC_DEFAULT", True)
    assert sockets(bpy)["Roughness"].default_value == 0.5
    bpy.ops.ed.undo()
    assert sockets(bpy)["Roughness"].default_value == 0.375
    assert not glaze(scene).mfo.shows_original
    bpy.ops.ed.redo()
    assert sockets(bpy)["Roughness"].default_value == 0.5
    bpy.ops.mfo.toggle()
    assert sockets(bpy)["Roughness"].default_value == 0.375
    tree = glaze(scene).node_tree
    assert ([(n.name, n.bl_idname) for n in tree.nodes], len(tree.links)) == graph
    assert sockets(bpy)["Metallic"].is_linked
    bpy.ops.mfo.toggle()
    bpy.ops.mfo.apply()  # while A is shown: A stays what revert leads to
    assert sockets(bpy)["Roughness"].default_value == pytest.approx(RECOVERED["roughness"])
    bpy.ops.mfo.revert()
    assert sockets(bpy)["Roughness"].default_value == 0.5
    assert not glaze(scene).mfo.applied


def test_queue_fits_one_after_the_other(scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    from blender_addon.running import fit_queue, running_job
    from blender_addon.running.fit_queue import PreparedFit

    bpy = scene.bpy
    fit(scene, wait=False)
    first = running_job.current.fit
    others = [bpy.data.materials.new(f"Other {i}") for i in range(3)]
    for i, other in enumerate(others):
        folder = Path(f"{scene.job}_{i}")
        folder.mkdir()
        shutil.copyfile(Path(scene.job, "request.json"), folder / "request.json")
        uid = other.session_uid
        fit_queue.add(PreparedFit(first.python, folder, other.name, (uid,), (), True))
    bpy.ops.mfo.drop_queued(index=1)
    assert not Path(f"{scene.job}_1").exists()  # it was made for the fit that is not to be
    fit_queue.waiting[0] = PreparedFit(Path("/nowhere/python"), *list(vars(fit_queue.waiting[0]).values())[1:])

    def turn() -> bool:
        if running_job.current is None:
            running_job._start_next()
        return running_job.current is None and not fit_queue.waiting

    monkeypatch.setattr(bpy.app.timers, "register", lambda *_, **__: None, raising=False)
    step_until(scene, turn)
    assert [(e.material_name, e.icon) for e in fit_queue.finished] == [
        ("Glaze", "CHECKMARK"), ("Other 0", "ERROR"), ("Other 2", "CHECKMARK"),
    ]  # fmt: skip
    assert [len(m.mfo.history) for m in (glaze(scene), *others)] == [1, 0, 0, 1]
    running_job.close()
    assert not fit_queue.finished


def test_selected_objects_are_all_fitted(
    scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from blender_addon.operators import fit_options

    folders = iter(tmp_path / f"job_{i}" for i in range(9))
    monkeypatch.setattr(fit_options, "new_job_folder", lambda *_: next(folders))
    bpy = scene.bpy
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0.0, 2.0, 0.0), segments=8, ring_count=4)
    ball = bpy.context.object
    ball.data.materials.append(glaze(scene).copy())
    bpy.data.objects["Väse"].select_set(True)
    bpy.context.scene.mfo.reference_path = scene.reference
    assert bpy.ops.mfo.fit_selected() == {"FINISHED"}
    assert [len(m.mfo.history) for m in (glaze(scene), ball.active_material)] == [1, 1]


def test_old_jobs_open_without_their_material(scene: SimpleNamespace) -> None:
    fit(scene)
    scene.bpy.data.materials["Glaze"].name = "Other"
    assert scene.bpy.ops.mfo.open_job(directory=scene.job) == {"FINISHED"}
    assert runtime(scene).has_result
    assert scene.bpy.ops.mfo.open_job(directory=scene.job, material="Other") == {"FINISHED"}
    with pytest.raises(RuntimeError, match="There is no result in"):
        scene.bpy.ops.mfo.open_job(directory=str(Path(scene.job).parent))


def test_split_of_reference_and_result(scene: SimpleNamespace) -> None:
    fit(scene)
    runtime(scene).split = 0.25
    assert scene.bpy.ops.mfo.show_pictures(show="split") == {"FINISHED"}
    image = scene.bpy.data.images["Material Fit split"]

    def line() -> int:
        row = list(image.pixels)[2 * 96 * 4 : 3 * 96 * 4]
        return next(x for x in range(96) if row[4 * x] == 1.0)

    assert tuple(image.size) == (96, 64)
    assert line() == 24
    runtime(scene).split = 0.5
    assert line() == 48
    middle = [list(image.pixels)[(32 * 96 + x) * 4] for x in (40, 56)]
    assert middle == pytest.approx([180 / 255, 178 / 255], abs=1e-6)  # the reference left of it, the result right
    assert scene.bpy.ops.mfo.show_pictures(show="curve") == {"FINISHED"}
    with pytest.raises(RuntimeError, match="cannot be read"):
        scene.bpy.ops.mfo.show_pictures(show="nothing")


def test_check_in_cycles_and_reference_from_cycles(scene: SimpleNamespace) -> None:
    from blender_addon.running import cycles_check
    from mfo_backend.scene.image_file import read_image

    bpy = scene.bpy
    bpy.context.scene.render.engine = "CYCLES"
    bpy.context.scene.cycles.samples = 1
    with pytest.raises(RuntimeError, match="no result"):
        bpy.ops.mfo.check_in_cycles()
    fit(scene)
    assert bpy.ops.mfo.check_in_cycles() == {"FINISHED"}
    assert runtime(scene).cycles_flip == pytest.approx(0.0234)
    assert not cycles_check.is_running()
    assert bpy.ops.mfo.render_reference() == {"FINISHED"}
    path = bpy.context.scene.mfo.reference_path
    try:
        assert read_image(Path(path)).pixels.shape == (64, 96, 3)
    finally:
        shutil.rmtree(Path(path).parent)
    bpy.context.scene.camera = None
    assert not bpy.ops.mfo.render_reference.poll()
    fit_folder = runtime(scene).job_folder
    bpy.context.scene.camera = bpy.data.objects["Camera"]
    glaze(scene).node_tree.nodes.clear()
    with pytest.raises(RuntimeError, match="has no Principled BSDF"):
        bpy.ops.mfo.check_in_cycles()
    assert Path(fit_folder).is_dir()
