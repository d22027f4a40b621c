# SPDX-License-Identifier: Apache-2.0
"""The check in Cycles, and beside it in the engine that the scene has."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

ANSWERS = [{}, {"metrics": {"flip": 0.0234}}, {}, {"metrics": {"flip": 0.15}}]


@pytest.fixture
def begun(scene: SimpleNamespace, monkeypatch: pytest.MonkeyPatch):
    """Starts a check of a job and returns its steps' labels and commands, and what is done with the answers."""
    from blender_addon.running import cycles_check

    found = SimpleNamespace()

    def begin(folder, steps, done):
        found.labels, found.done = [step.label for step in steps], done
        found.commands = [" ".join(step.words) for step in steps]

    monkeypatch.setattr(cycles_check, "_begin", begin)
    app = SimpleNamespace(binary_path="blender", background=True)
    monkeypatch.setattr(cycles_check, "bpy", SimpleNamespace(app=app, context=scene.bpy.context))

    def start(engine: str):
        scene.bpy.context.scene.render.engine = engine
        cycles_check.check_result(Path(scene.job), "Glaze", Path("python"))
        return found

    return start


def test_eevee_is_rendered_beside_cycles(scene: SimpleNamespace, begun) -> None:
    found = begun("BLENDER_EEVEE" if scene.bpy.app.version >= (5, 0, 0) else "BLENDER_EEVEE_NEXT")
    assert found.labels == ["Rendering in Cycles", "Comparing", "Rendering in Eevee", "Comparing"]
    assert ["--engine scene" in command for command in found.commands] == [False, False, True, False]
    assert "--name engine" in found.commands[3]
    found.done(ANSWERS)
    runtime = scene.bpy.context.window_manager.mfo_runtime
    assert runtime.cycles_text == "FLIP in Cycles: 0.0234. In Eevee: 0.1500."
    assert runtime.cycles_flip == pytest.approx(0.0234)
    found.done(ANSWERS[:2])  # where the scene's engine could not render
    assert runtime.cycles_text == "FLIP in Cycles: 0.0234"


def test_a_scene_of_cycles_is_rendered_once(scene: SimpleNamespace, begun) -> None:
    assert begun("CYCLES").labels == ["Rendering in Cycles", "Comparing"]


@pytest.mark.parametrize(
    ("engine", "name"),
    [("BLENDER_EEVEE_NEXT", "Eevee"), ("BLENDER_EEVEE", "Eevee"), ("BLENDER_WORKBENCH", "Workbench")],
)
def test_engines_are_called_as_in_blender(addon: object, engine: str, name: str) -> None:
    from blender_addon.running.cycles_check import engine_name

    assert engine_name(engine) == name
