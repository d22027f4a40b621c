# SPDX-License-Identifier: Apache-2.0
"""An export in steps: what a timer takes, how it ends, and that nothing of an export that was ended is left."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from .test_operators import runtime


@pytest.fixture
def taken(scene: SimpleNamespace) -> Iterator[list[object]]:
    """What was handed over; nothing runs on after a test."""
    from blender_addon.running import running_export

    found: list[object] = []
    yield found
    running_export.close()


def steps(log: list[str], *, fails: bool = False, holds_scene: bool = False):
    """Steps that wait after each until the log says `go`."""
    from blender_addon.export.steps import Pause

    def is_over() -> bool:
        return log[-1:] == ["go"]

    try:
        log.append("first")
        yield Pause(is_over, holds_scene)
        log.append("second")
        yield Pause(is_over, holds_scene)
        if fails:
            raise ValueError("A node is of no use.")
    finally:
        log.append("closed")
    return "fit"


def test_a_timer_takes_the_steps(scene: SimpleNamespace, taken: list[object]) -> None:
    from blender_addon.running import running_export, running_job

    log: list[str] = []
    running_export.start(scene.bpy.context, steps(log), taken.append)
    assert log == ["first"]
    assert not scene.bpy.ops.mfo.fit.poll()
    assert scene.bpy.ops.mfo.cancel.poll()
    assert running_export._tick() == running_job.TICK
    assert log == ["first"]  # which it waits for
    log.append("go")
    assert running_export._tick() is not None
    assert (log, taken) == (["first", "go", "second"], [])
    log.append("go")
    assert running_export._tick() is None
    assert taken == ["fit"]
    assert running_export.current is None


def test_cancel_ends_it_silently_and_an_undo_with_a_word(scene: SimpleNamespace, taken: list[object]) -> None:
    from blender_addon.running import running_export

    log: list[str] = []
    running_export.start(scene.bpy.context, steps(log), taken.append)
    assert scene.bpy.ops.mfo.cancel() == {"FINISHED"}
    assert (log, runtime(scene).state) == (["first", "closed"], "IDLE")
    running_export.start(scene.bpy.context, steps(log), taken.append)
    running_export.undone()
    assert (running_export.current, runtime(scene).state) == (None, "FAILED")
    assert "ended by an undo" in runtime(scene).sentence
    assert taken == []


def test_an_error_of_a_later_step_is_told(scene: SimpleNamespace, taken: list[object]) -> None:
    from blender_addon.running import running_export

    log: list[str] = []
    running_export.start(scene.bpy.context, steps(log, fails=True), taken.append)
    log.append("go")
    running_export._tick()
    log.append("go")
    assert running_export._tick() is None
    assert (runtime(scene).state, runtime(scene).sentence) == ("FAILED", "A node is of no use.")


def test_steps_that_need_not_wait_are_taken_at_once(scene: SimpleNamespace, taken: list[object]) -> None:
    from blender_addon.export.steps import Pause
    from blender_addon.running import running_export

    def plain():
        yield Pause()
        yield Pause()
        return "fit"

    running_export.start(scene.bpy.context, plain(), taken.append)
    assert (taken, running_export.current) == (["fit"], None)


def test_long_steps_give_the_windows_back(scene: SimpleNamespace, taken: list[object]) -> None:
    from blender_addon.export.steps import STEP_SECONDS, Pause
    from blender_addon.running import running_export

    def long():
        time.sleep(1.02 * running_export.AT_ONCE)
        for _ in range(3):
            time.sleep(1.2 * STEP_SECONDS)
            yield Pause(share=0.5, text="Picture 2 of 4")
        return "fit"

    running_export.start(scene.bpy.context, long(), taken.append)
    assert running_export.progress() == (0.5, "Picture 2 of 4")
    assert [running_export._tick() for _ in range(3)] == [running_export.DRAWN, running_export.DRAWN, None]
    assert taken == ["fit"]


def test_windows_are_drawn_between_pictures(scene: SimpleNamespace, taken: list[object]) -> None:
    """Each needs something shown, which is put back before they are; pieces of one picture are taken together."""
    from contextlib import contextmanager

    from blender_addon.export.steps import Pause, held
    from blender_addon.running import running_export, running_job

    log: list[str] = []

    @contextmanager
    def show():
        log.append("shown")
        yield
        log.append("back")

    def picture():
        log.append("read")
        yield Pause()
        log.append("written")
        yield Pause(lambda: log[-1] == "evaluated")
        log.append("more")
        return "fit"

    def both():
        for number in (1, 2):
            fit = yield from held(picture(), show, f"Picture {number} of 2", number / 2)
        return fit

    running_export.start(scene.bpy.context, both(), taken.append)
    piece = ["shown", "read", "written", "back"]
    assert log == piece
    assert running_export._tick() == running_job.TICK
    assert log == piece  # nothing is shown for a look at what is waited for
    log.append("evaluated")
    running_export._tick()
    assert log == [*piece, "evaluated", "shown", "more", "back", *piece]
    assert running_export.progress() == (1.0, "Picture 2 of 2")
    log.append("evaluated")
    assert running_export._tick() is None
    assert taken == ["fit"]


@pytest.mark.parametrize("holds_scene", [True, False])
@pytest.mark.parametrize("change", ["move", "resolution", "select"])
def test_a_change_ends_what_is_still_to_be_read(
    scene: SimpleNamespace, taken: list[object], holds_scene: bool, change: str
) -> None:
    from blender_addon.running import handlers, running_export

    bpy, log = scene.bpy, []
    bpy.context.view_layer.update()
    running_export.start(bpy.context, steps(log, holds_scene=holds_scene), taken.append)
    target = bpy.data.objects["Väse"]
    if change == "move":
        target.location.x += 1.0
    elif change == "resolution":
        bpy.context.scene.render.resolution_x = 50
    else:
        bpy.data.objects["Light"].select_set(True)
    assert handlers._after_update in bpy.app.handlers.depsgraph_update_post
    bpy.context.view_layer.update()
    log.append("go")
    running_export._tick()
    ends = holds_scene and change != "select"
    assert ("second" in log, "closed" in log) == (not ends, ends)
    assert (runtime(scene).sentence[:21] == "The scene was changed") == ends


def test_an_export_that_is_ended_leaves_nothing(scene: SimpleNamespace, tmp_path: Path) -> None:
    from blender_addon.export.job import export_steps
    from blender_addon.export.materials import node_graph

    bpy = scene.bpy
    tree = bpy.data.materials["Glaze"].node_tree
    shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], shader.inputs["Roughness"])
    pids: list[int] = []

    class Noted(node_graph.Probe):
        def __init__(self) -> None:
            super().__init__()
            pids.append(self.pid)

    node_graph.Probe, before = Noted, node_graph.Probe
    try:
        fit = {"preset": "fast", "parameters": "all"}
        target = bpy.data.objects["Väse"]
        running = export_steps(
            bpy.context, target, tmp_path / "job", Path(scene.reference), fit, "scene", upright=False
        )
        next(running)  # waits for the second Blender
        running.close()
    finally:
        node_graph.Probe = before
    assert not (tmp_path / "job").exists()
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith(".") or "job" in path.name] == []
    with pytest.raises(ProcessLookupError):
        os.kill(pids[0], 0)


@pytest.fixture
def three(scene: SimpleNamespace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Three selected objects with materials of their own; the second has a socket that nothing can evaluate."""
    from blender_addon.operators import fit, fit_options
    from blender_addon.running import fit_queue, running_job

    bpy = scene.bpy
    for number in (1, 2):
        bpy.ops.mesh.primitive_cube_add(location=(0.0, 3.0 * number, 0.0))
        bpy.context.object.name = f"Cup {number}"
        bpy.context.object.data.materials.append(bpy.data.materials["Glaze"].copy())
        bpy.context.object.active_material.name = f"Clay {number}"
    bpy.data.objects["Väse"].select_set(True)
    bpy.data.objects["Cup 1"].select_set(True)
    bpy.context.scene.mfo.reference_path = scene.reference
    folders = iter(tmp_path / f"job_{i}" for i in range(9))
    monkeypatch.setattr(fit_options, "new_job_folder", lambda *_: next(folders))
    monkeypatch.setattr(fit, "bpy", SimpleNamespace(app=SimpleNamespace(background=False), types=bpy.types))
    monkeypatch.setattr(fit, "why_no_fit", lambda: "")
    monkeypatch.setattr(fit.waiting_backend, "prepare", lambda *_: None)
    started: list[str] = []
    monkeypatch.setattr(fit, "start_or_queue", lambda prepared: started.append(prepared.material_name))
    yield SimpleNamespace(bpy=bpy, started=started, folder=tmp_path, runtime=lambda: runtime(scene))
    fit_queue.clear()
    running_job.close()


def test_selected_objects_are_exported_in_steps(three: SimpleNamespace, taken: list[object]) -> None:
    """Each fit begins when its object has been read; a click on another object meanwhile ends nothing."""
    from blender_addon.running import running_export

    bpy = three.bpy
    chosen = [obj.active_material.name for obj in bpy.context.selected_objects]
    assert bpy.ops.mfo.fit_selected(wait=False) == {"FINISHED"}
    assert three.started == []
    assert running_export.progress() == (0.0, "Object 1 of 3")
    assert not bpy.ops.mfo.fit_selected.poll()
    seen = []
    while running_export.current is not None:
        seen.append((len(three.started), *running_export.progress()))
        bpy.context.view_layer.objects.active = bpy.data.objects["Light"]
        running_export._tick()
    assert three.started == chosen
    assert sorted({text for _, _, text in seen}) == [f"Object {n} of 3" for n in (1, 2, 3)]
    shares = [share for _, share, _ in seen]
    assert shares == sorted(shares)
    assert {count for count, _, _ in seen} == {0, 1, 2}  # windows are drawn between them


def test_cancel_keeps_the_fits_that_have_begun(three: SimpleNamespace, taken: list[object]) -> None:
    from blender_addon.running import running_export

    three.bpy.ops.mfo.fit_selected(wait=False)
    while len(three.started) < 1:
        running_export._tick()
    assert three.bpy.ops.mfo.cancel() == {"FINISHED"}
    assert running_export.current is None
    assert len(three.started) == 1
    assert sorted(path.name for path in three.folder.iterdir() if "job" in path.name) == ["job_0"]


def test_pressed_again_nothing_is_fitted_twice(
    three: SimpleNamespace, taken: list[object], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One runs and one waits when a change ends the export of the third; then all three are asked for again."""
    from blender_addon.operators import fit
    from blender_addon.running import fit_queue, running_export, running_job

    prepared: list[fit_queue.PreparedFit] = []

    def start_or_queue(each: fit_queue.PreparedFit) -> None:
        prepared.append(each)
        if len(prepared) == 1:
            monkeypatch.setattr(running_job, "current", SimpleNamespace(fit=each))
        else:
            fit_queue.add(each)

    monkeypatch.setattr(fit, "start_or_queue", start_or_queue)
    three.bpy.ops.mfo.fit_selected(wait=False)
    while len(prepared) < 2:
        running_export._tick()
    running_export.close("The scene was changed.")
    first, second = prepared
    three.bpy.ops.mfo.fit_selected(wait=False)
    while running_export.current is not None:
        running_export._tick()
    names = [each.material_name for each in prepared]
    assert names == [*names[:2], names[1], names[3]]
    assert sorted({*names}) == ["Clay 1", "Clay 2", "Glaze"]
    assert fit_queue.waiting == prepared[2:]
    assert first.folder.exists()
    assert not second.folder.exists()
    assert [(each.material_name, each.icon) for each in fit_queue.finished] == [(first.material_name, "INFO")]
    assert "runs already" in fit_queue.finished[0].sentence
    monkeypatch.setattr(running_job, "current", None)


def test_one_that_cannot_be_exported_stops_no_other(three: SimpleNamespace, taken: list[object]) -> None:
    from blender_addon.running import fit_queue, running_export

    three.bpy.data.objects["Cup 1"].hide_render = True
    three.bpy.ops.mfo.fit_selected(wait=False)
    while running_export.current is not None:
        running_export._tick()
    assert len(three.started) == 2
    assert [(each.material_name, each.icon) for each in fit_queue.finished] == [("Clay 1", "ERROR")]
    assert "hidden in the render" in fit_queue.finished[0].sentence


def test_where_none_can_be_exported_it_is_said(three: SimpleNamespace, taken: list[object]) -> None:
    from blender_addon.running import fit_queue, running_export

    for obj in three.bpy.context.selected_objects:
        obj.hide_render = True
    three.bpy.ops.mfo.fit_selected(wait=False)
    while running_export.current is not None:
        running_export._tick()
    assert (three.started, fit_queue.finished) == ([], [])
    assert three.runtime().state == "FAILED"
    assert "hidden in the render" in three.runtime().sentence
    assert len(three.runtime().messages) == 2


def test_a_renamed_scene_goes_on(scene: SimpleNamespace, taken: list[object]) -> None:
    from blender_addon.running import running_export

    log: list[str] = []
    running_export.start(scene.bpy.context, steps(log, holds_scene=True), taken.append)
    scene.bpy.context.scene.name = "Room"
    log.append("go")
    running_export._tick()
    log.append("go")
    running_export._tick()
    assert taken == ["fit"]


def test_the_cross_beside_a_fit_leaves_an_export(scene: SimpleNamespace, taken: list[object]) -> None:
    from blender_addon.running import running_export

    running_export.start(scene.bpy.context, steps([]), taken.append)
    assert scene.bpy.ops.mfo.cancel(fit_alone=True) == {"FINISHED"}
    assert running_export.current is not None
    assert scene.bpy.ops.mfo.cancel() == {"FINISHED"}
    assert running_export.current is None


def test_a_result_that_goes_into_its_history_ends_no_export(scene: SimpleNamespace, taken: list[object]) -> None:
    """Of several objects the first may be fitted while others are read."""
    from blender_addon.result import history
    from blender_addon.result.job_result import read_job_result
    from blender_addon.running import running_export

    bpy, log = scene.bpy, []
    assert bpy.ops.mfo.fit(reference=scene.reference, job_folder=scene.job) == {"FINISHED"}
    bpy.context.view_layer.update()
    running_export.start(bpy.context, steps(log, holds_scene=True), taken.append)
    history.record(bpy.data.materials["Glaze"], read_job_result(Path(scene.job)))
    bpy.context.view_layer.update()
    for _ in range(2):
        log.append("go")
        running_export._tick()
    assert taken == ["fit"]
