# SPDX-License-Identifier: Apache-2.0
"""An export in steps: what a timer takes, how it ends, and that nothing of an export that was ended is left."""

from __future__ import annotations

import os
from collections.abc import Generator, Iterator
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


def steps(log: list[str], *, fails: bool = False) -> Generator[None, None, str]:
    try:
        log.append("first")
        yield
        log.append("second")
        yield
        if fails:
            raise ValueError("A node is of no use.")
    finally:
        log.append("closed")
    return "fit"


def test_a_timer_takes_the_steps(scene: SimpleNamespace, taken: list[object]) -> None:
    from blender_addon.running import running_export

    log: list[str] = []
    running_export.start(scene.bpy.context, steps(log), taken.append)
    assert log == ["first"]
    assert not scene.bpy.ops.mfo.fit.poll()
    assert scene.bpy.ops.mfo.cancel.poll()
    assert running_export._tick() is not None
    assert (log, taken) == (["first", "second"], [])
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

    running_export.start(scene.bpy.context, steps([], fails=True), taken.append)
    running_export._tick()
    assert running_export._tick() is None
    assert (runtime(scene).state, runtime(scene).sentence) == ("FAILED", "A node is of no use.")


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
