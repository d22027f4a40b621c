# SPDX-License-Identifier: Apache-2.0
"""A queue of small things, rendered by Cycles: what each of them is made of is found in a few hundred pixels."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from studies.child_module import run_module

THINGS = 10
SCENE = "studies.materials.scene"


def test_colours_of_small_things_are_found(tmp_path: Path) -> None:
    """With as much own noise as `fast` allows elsewhere half of the colours were more than 1.5 % off."""
    run_module(SCENE, "build", 0, tmp_path, "--size", 330, "--things", THINGS)
    run_module(SCENE, "render", tmp_path / "truth.blend", tmp_path / "reference.exr", 3)
    truth = json.loads((tmp_path / "truth.json").read_text("utf-8"))
    answer = run_module(
        "mfo_backend", "blend", tmp_path / "start.blend", *(word for name in truth for word in ("--object", name)),
        "--queue", "--parameters", "Base Color, Roughness, Metallic", "--reference", tmp_path / "reference.exr",
        "--out", tmp_path / "job", "--json",
    ).answer  # fmt: skip
    assert [found["object"] for found in answer["materials"]] == [*truth]
    colours, roughnesses, missed = [], [], []
    for found in answer["materials"]:
        true, recovered = truth[found["object"]], found["recovered"]
        colours.append(abs(np.mean(np.divide(recovered["base_color"], true["Base Color"][:3])) - 1.0))
        roughnesses.append(abs(recovered["roughness"] - true["Roughness"]))
        if abs(recovered["metallic"] - true["Metallic"]) >= 0.1 or found["verdict"] != "same":
            missed.append(found)
            colours.pop()
    # by the noise of the picture: of six pictures three have one thing that is 0.13 to 0.16 metal, for none
    assert len(missed) <= 1
    assert all(found["verdict"] == "close" for found in missed)
    assert all(abs(f["recovered"]["metallic"] - truth[f["object"]]["Metallic"]) < 0.2 for f in missed)
    assert np.median(colours) < 0.006
    assert np.max(colours) < 0.03
    assert np.median(roughnesses) < 0.05
