# SPDX-License-Identifier: Apache-2.0
"""Results and progress of a stranger, or of a backend that has gone wrong, in Blender's process."""

from __future__ import annotations

import io
import json
import math
from pathlib import Path
from types import SimpleNamespace

import pytest

from blender_addon.process.progress_lines import LINE_LIMIT, read_events

from ..test_operators import fit, sockets


def numbers(bpy) -> dict[str, tuple[float, ...] | float]:
    values = {s.name: getattr(s, "default_value", None) for s in sockets(bpy)}
    return {name: v if isinstance(v, (int, float)) else tuple(v) for name, v in values.items() if v is not None}


@pytest.mark.parametrize(
    ("recovered", "words"),
    [
        ({"roughness": 10**400}, "damaged"),
        ({"roughness": 1e39}, "not finite"),
        ({"roughness": "0.5"}, "no value of a socket"),
        ({"roughness": []}, "no value of a socket"),
        ({"roughness": [0.5] * 5}, "no value of a socket"),
        ({"roughness": {"a": 1}}, "damaged"),
        ({"ior": 1.9, "roughness": [0.1, 0.2]}, "2 numbers for Roughness"),
        ({"roughness": 0.9, "base_color": 0.3}, "1 numbers for Base Color"),
        ({"roughness": 0.9, "base_color": [0.3, 0.4]}, "2 numbers for Base Color"),
    ],
)
def test_nothing_is_half_applied(scene: SimpleNamespace, recovered: dict, words: str) -> None:
    fit(scene)
    path = Path(scene.job, "result.json")
    found = json.loads(path.read_text()) | {"model": "blender_principled", "recovered": recovered}
    path.write_text(json.dumps(found))
    before = numbers(scene.bpy)
    with pytest.raises(RuntimeError, match=words):
        scene.bpy.ops.mfo.apply(job_folder=scene.job)
    assert numbers(scene.bpy) == before
    assert not scene.bpy.data.materials["Glaze"].mfo.originals


def test_originals_of_another_size_are_not_set(scene: SimpleNamespace) -> None:
    fit(scene)
    scene.bpy.ops.mfo.apply()
    originals = scene.bpy.data.materials["Glaze"].mfo.originals
    originals["Roughness"].size = 3
    roughness = sockets(scene.bpy)["Roughness"].default_value
    scene.bpy.ops.mfo.revert(material="Glaze")
    assert sockets(scene.bpy)["Roughness"].default_value == roughness
    assert not originals


def test_lines_that_are_no_events_are_skipped() -> None:
    deep = b'{"event": "progress", "a": ' + b"[" * 200_000 + b"]" * 200_000 + b"}"
    long = b'{"event": "progress", "a": "' + b"x" * LINE_LIMIT + b'"}'
    whole = b'{"event": "finished"}'
    lines = [deep, long, b"\xff\xfe", b"[1]", b'{"event": 3}', b"null", whole, whole[:-1]]
    assert list(read_events(io.BytesIO(b"\n".join(lines)))) == [{"event": "finished"}]


def test_numbers_json_does_not_know_are_none() -> None:
    (event,) = read_events(io.BytesIO(b'{"event": "progress", "fraction": NaN, "loss": -Infinity}\n'))
    assert event == {"event": "progress", "fraction": None, "loss": None}


@pytest.mark.parametrize(
    "event",
    [
        {"event": "progress", "fraction": 10**400},
        {"event": "progress", "fraction": math.inf, "stage_index": 0, "stage_count": 1, "remaining_seconds": math.inf},
        {"event": "progress", "fraction": 0.5, "stage_index": "0"},
        {"event": "preview", "path": "../" * 30 + "etc/passwd"},
        {"event": "preview", "path": "a\0b"},
        {"event": "preview", "path": 3},
        {"event": "preview", "path": "a" * 5000},
        {"event": "stage_end", "stage": "{process}", "loss_start": "x"},
    ],
)
def test_events_with_wrong_values_are_passed_over(scene: SimpleNamespace, tmp_path: Path, event: dict) -> None:
    from blender_addon.running import running_job
    from blender_addon.running.fit_queue import PreparedFit

    process = SimpleNamespace(folder=tmp_path, cancelling=False)
    prepared = PreparedFit(tmp_path, tmp_path, "Glaze", (0,), (), True)
    running_job._handle(running_job.RunningJob(process, prepared), event)
