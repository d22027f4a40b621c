# SPDX-License-Identifier: Apache-2.0
"""What a fit kept is written as the scene has it, also where no fit may begin there."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mfo_backend.job.folder.job_folder import JobFolder
from mfo_backend.job.folder.request import Request, read_request
from mfo_backend.job.run.as_in_scene import as_in_scene
from mfo_backend.material.principled.principled_parameters import BLENDER_PRINCIPLED, SOCKET_OF_PARAMETER
from mfo_backend.types.certainty import Certainty, Level
from mfo_backend.types.parameter import Parameter, Value
from mfo_backend.types.result import FitResult
from mfo_backend.types.status import Status

MOVED = {"metallic": (0.0, 0.4)}  # so that the result is not its start
LIMITED = [p for p in BLENDER_PRINCIPLED if p.lower > 0.0]  # Blender has 0 for each


@pytest.fixture
def asked(job: Path) -> Callable[..., Request]:
    """The job's request of a material with these sockets."""

    def read(sockets: dict[str, Any], leaves: list[Any] | None = None, **fit: Any) -> Request:
        data = json.loads((job / "request.json").read_text("utf-8"))
        material = {"name": "Glaze", "sockets": {n: {"value": v, "linked": False} for n, v in sockets.items()}}
        data["materials"]["glaze"] = material | ({"leaves": leaves, "weight": {"value": 0.5}} if leaves else {})
        (job / "request.json").write_text(json.dumps(data | {"fit": fit}), "utf-8")
        return read_request(JobFolder.open(job))

    return read


def result(name: str, begin: Value, end: Value, level: Level | None, item: Parameter, **more: Any) -> FitResult:
    values = {name: (begin, end)} | more
    sure = {} if level is None else {name: Certainty((0.3,) * item.size, level)}
    return FitResult(
        Status.CONVERGED, "", "blender_principled", {n: v[0] for n, v in values.items()},
        {n: v[1] for n, v in values.items()}, {name: (item.lower, item.upper)}, (), {}, 1.0, 1.0, certainty=sure,
    )  # fmt: skip


@pytest.mark.parametrize("item", LIMITED, ids=lambda item: item.name)
def test_a_kept_value_below_the_least_of_a_fit_is_the_scenes(asked: Callable[..., Request], item: Parameter) -> None:
    """A Coat Roughness of 0 that was "not visible, kept" was written as 0.03."""
    nothing: Value = (0.0,) * 3 if item.size == 3 else 0.0
    least: Value = (item.lower,) * 3 if item.size == 3 else item.lower
    request = asked({SOCKET_OF_PARAMETER[item.name]: nothing})
    found = as_in_scene(request, result(item.name, least, least, Level.NOT_VISIBLE, item, **MOVED))
    assert found.recovered[item.name] == found.initial[item.name] == nothing
    assert found.bounds[item.name] == (0.0, item.upper)
    assert found.recovered["metallic"] == 0.4


def test_values_above_the_most_and_single_channels_are_the_scenes(asked: Callable[..., Request]) -> None:
    own, item = (1.0, 0.25, 0.0), BLENDER_PRINCIPLED["base_color"]
    begin = tuple(np.clip(own, item.lower, item.upper).tolist())
    request = asked({"Base Color": list(own)})
    found = as_in_scene(request, result("base_color", begin, begin, Level.NOT_VISIBLE, item, **MOVED))
    assert found.recovered["base_color"] == own


def test_a_shader_of_a_mix_keeps_its_own(asked: Callable[..., Request]) -> None:
    pane = {
        "name": "Pane", "shader": "principled", "weight": {"value": 0.5, "linked": False},
        "sockets": {"Coat Roughness": {"value": 0.0, "linked": False}},
        "free": {"Coat Roughness": "Pane/Coat Roughness"},
    }  # fmt: skip
    item = BLENDER_PRINCIPLED["coat_roughness"]
    kept = result("Pane/Coat Roughness", 0.03, 0.03, Level.NOT_VISIBLE, item, **MOVED)
    assert as_in_scene(asked({}, [pane]), kept).recovered["Pane/Coat Roughness"] == 0.0


def test_a_result_that_is_its_start_is_the_scene(asked: Callable[..., Request]) -> None:
    """No fit came nearer: no value was changed, whatever is known of it."""
    item = BLENDER_PRINCIPLED["coat_roughness"]
    for level in (None, Level.DETERMINED):
        found = as_in_scene(asked({"Coat Roughness": 0.0}), result("coat_roughness", 0.03, 0.03, level, item))
        assert found.recovered["coat_roughness"] == 0.0


@pytest.mark.parametrize("level", [Level.DETERMINED, Level.WEAK, Level.NOT_TOLD_APART, Level.DOUBTFUL])
@pytest.mark.parametrize("end", [0.03, 0.2])
def test_what_a_fit_found_stays(asked: Callable[..., Request], level: Level, end: float) -> None:
    """Also at the least of a fit; the start is the scene's."""
    item = BLENDER_PRINCIPLED["coat_roughness"]
    found = as_in_scene(asked({"Coat Roughness": 0.0}), result("coat_roughness", 0.03, end, level, item, **MOVED))
    assert (found.initial["coat_roughness"], found.recovered["coat_roughness"]) == (0.0, end)


def test_a_value_within_the_bounds_and_bounds_of_the_user_change_nothing(asked: Callable[..., Request]) -> None:
    item = BLENDER_PRINCIPLED["coat_roughness"]
    before = result("coat_roughness", 0.1, 0.1, Level.NOT_VISIBLE, item, **MOVED)
    assert as_in_scene(asked({"Coat Roughness": 0.1}), before) == before
    limited = result("coat_roughness", 0.03, 0.03, Level.NOT_VISIBLE, item, **MOVED)
    request = asked({"Coat Roughness": 0.0}, parameters=["coat_roughness"], bounds={"coat_roughness": [0.01, 0.5]})
    assert as_in_scene(request, limited) == limited
