# SPDX-License-Identifier: Apache-2.0
"""A result that does not match its reference: said, and applied only when that is asked for."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from ..fake_backend import RECOVERED
from ..test_operators import FLOAT32, fit, runtime, sockets

SENTENCE = "The result does not match the reference."


@pytest.fixture
def mismatch(scene: SimpleNamespace) -> SimpleNamespace:
    """A finished fit that does not match, shown in the panel."""
    fit(scene)
    path = Path(scene.job, "result.json")
    found = json.loads(path.read_text()) | {"status": "different", "verdict": "different", "sentence": SENTENCE}
    found["certainty"] = {"roughness": {"sd": [0.01], "level": "doubtful", "words": "doubtful"}}
    path.write_text(json.dumps(found))
    scene.bpy.ops.mfo.open_job(directory=scene.job)
    return scene


def roughness(scene: SimpleNamespace) -> float:
    return sockets(scene.bpy)["Roughness"].default_value


def is_applied(scene: SimpleNamespace) -> bool:
    return roughness(scene) == pytest.approx(RECOVERED["roughness"], abs=FLOAT32)


def test_panel_and_history_know_the_verdict(mismatch: SimpleNamespace) -> None:
    assert (runtime(mismatch).verdict, runtime(mismatch).sentence) == ("different", SENTENCE)
    assert {row.name: row.words for row in runtime(mismatch).values}["Roughness"] == "doubtful"
    history = mismatch.bpy.data.materials["Glaze"].mfo.history
    assert [entry.verdict for entry in history] == ["different"]


def test_a_script_has_to_force_it(mismatch: SimpleNamespace) -> None:
    apply = mismatch.bpy.ops.mfo.apply
    for words in ({}, {"job_folder": mismatch.job}):
        with pytest.raises(RuntimeError, match=r"does not match.* Nothing was applied; force=True applies it anyway"):
            apply(**words)
    assert roughness(mismatch) == 0.5
    assert apply(force=True) == {"FINISHED"}
    assert is_applied(mismatch)


def test_a_script_has_to_force_an_earlier_one(mismatch: SimpleNamespace) -> None:
    with pytest.raises(RuntimeError, match="force=True"):
        mismatch.bpy.ops.mfo.apply_past()
    assert roughness(mismatch) == 0.5
    assert mismatch.bpy.ops.mfo.apply_past(force=True) == {"FINISHED"}
    assert is_applied(mismatch)


def test_a_button_applies_it_at_the_second_press(mismatch: SimpleNamespace) -> None:
    """Buttons exist in windows only; what they ask does not need one."""
    from blender_addon.operators.apply import was_asked

    context = mismatch.bpy.context
    assert [was_asked(context, mismatch.job) for _ in range(2)] == [False, True]
    assert not was_asked(context, mismatch.job + "2")  # a press counts for its own result only
    mismatch.bpy.ops.mfo.open_job(directory=mismatch.job)
    assert not was_asked(context, mismatch.job)


def test_the_headless_command_refuses_it(mismatch: SimpleNamespace, tmp_path: Path, capsys) -> None:
    from blender_addon.headless import main

    bpy, blend, out = mismatch.bpy, tmp_path / "a.blend", tmp_path / "b.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), copy=True)
    words = ["apply", str(blend), "--job", mismatch.job, "--save-as", str(out)]
    assert main(words) == 2
    assert "Nothing was applied; --force applies it anyway." in capsys.readouterr().out
    assert not out.exists()
    assert main([*words, "--force"]) == 0
    assert out.is_file()


def test_results_without_a_verdict_are_applied_as_ever(scene: SimpleNamespace) -> None:
    fit(scene)
    assert runtime(scene).verdict == "same"
    path = Path(scene.job, "result.json")
    path.write_text(json.dumps({k: v for k, v in json.loads(path.read_text()).items() if "verdict" not in k}))
    scene.bpy.ops.mfo.open_job(directory=scene.job)
    assert runtime(scene).verdict == ""
    assert scene.bpy.ops.mfo.apply() == {"FINISHED"}
    assert is_applied(scene)
