# SPDX-License-Identifier: Apache-2.0
"""Fits of classes: what a row says of a job, with Blender, fit and Cycles by stand-ins."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from studies.ablate import class_fit
from studies.verdicts.cases import class_case, sockets_of

METAL = 1  # the second class


@pytest.fixture
def fitted(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What the next job finds; `pictures` counts those that Cycles was asked for."""
    state: dict[str, Any] = {"recovered": {}, "flip": 0.03, "pictures": 0}

    def blender(module: str, *words: Any) -> None:
        if module == "blender_addon.headless":
            Path(words[words.index("--job") + 1]).mkdir(parents=True)

    def run(job: Path, *_: Any) -> None:
        recovered = state["recovered"]
        certainty = {name: {"level": "determined", "sd": [0.001]} for name in recovered}
        result = {"recovered": recovered, "certainty": certainty, "initial": {}, "verdict": "same"}
        (job / "result.json").write_text(json.dumps(result), "utf-8")

    def picture(*_: Any) -> tuple[float, float, float, float]:
        state["pictures"] += 1
        return 0.0, 0.0, state["flip"], 0.02

    monkeypatch.setattr(class_fit, "run_module", blender)
    monkeypatch.setattr(class_fit, "run_job", run)
    monkeypatch.setattr(class_fit, "flips_in_cycles", picture)
    return state


def test_solved_is_at_the_noise_and_wrong_what_is_sure_and_far_from_the_truth(fitted: Any, tmp_path: Path) -> None:
    truth = sockets_of(class_case(METAL))
    assert truth["Metallic"] == 1.0
    fit = class_fit.ClassFit(tmp_path)
    fitted["recovered"] = {"metallic": 1.0, "roughness": truth["Roughness"] + 0.1}
    row = fit(METAL)
    assert (row["solved"], row["error"], row["wrong"]) == (True, 0.03, ["roughness"])
    fitted |= {"recovered": {"metallic": 0.9, "roughness": truth["Roughness"]}, "flip": 0.05}
    row = fit(METAL)
    assert (row["solved"], row["error"], row["wrong"]) == (False, 0.05, ["metallic"])


def test_cycles_is_asked_again_only_of_other_values(fitted: Any, tmp_path: Path) -> None:
    fit = class_fit.ClassFit(tmp_path)
    for metallic in (1.0, 1.0, 0.9):
        fitted["recovered"] = {"metallic": metallic}
        fit(METAL)
    assert fitted["pictures"] == 2
