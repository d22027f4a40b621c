# SPDX-License-Identifier: Apache-2.0
"""Limits of a user hold in a real fit, also where the best value lies outside them."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from .conftest import Fitted, run_mfo


@pytest.mark.parametrize("preset", ["fast", "paper"])
def test_recovered_values_stay_inside(fitted: Fitted, tmp_path: Path, preset: str) -> None:
    job = shutil.copytree(fitted.job, tmp_path / "job")
    free = json.loads((job / "result.json").read_text("utf-8"))["recovered"]["roughness"]
    limits = [0.7, 0.9] if free < 0.6 else [0.1, 0.3]
    request = json.loads((job / "request.json").read_text("utf-8"))
    request["fit"] |= {"bounds": {"roughness": limits}, "preset": preset, "parameters": ["roughness", "base_color"]}
    request["fit"] |= {"max_iterations": 3, "spp": 4}
    (job / "request.json").write_text(json.dumps(request), "utf-8")
    done = run_mfo("run", job, "--progress", "none")
    assert done.code in (0, 5), done.stderr  # the limits keep it from the truth, and it may say that it does not match
    result = json.loads((job / "result.json").read_text("utf-8"))
    assert limits[0] <= result["recovered"]["roughness"] <= limits[1]
    assert result["bounds"]["roughness"] == limits
