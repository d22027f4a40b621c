# SPDX-License-Identifier: Apache-2.0
"""A bench scene that Cycles renders, from Blender to a row."""

from __future__ import annotations

import importlib.util
from dataclasses import replace

import pytest

from mfo_backend.bench.rows.row import Task
from mfo_backend.bench.runs import fit_runner
from mfo_backend.bench.runs.fit_runner import FitRunner
from mfo_backend.bench.scenes.assets import Assets
from mfo_backend.bench.scenes.cycles_scene import write_cycles_scene
from mfo_backend.bench.scenes.scenario import SCENARIOS
from mfo_backend.cli.blender_host import find_blender_host
from mfo_backend.types.errors import SetupError

TASK = Task("cycles", 0, "balanced")


@pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="needs the bpy module")
def test_a_material_is_recovered_from_cycles_pictures(tmp_path, monkeypatch):
    # at this size the picture's noise decides where `fast` ends: 0.020 to 0.145 at six counts of samples, for 0.029 to
    # 0.038 here
    scenario = replace(SCENARIOS["cycles"], reference_spp=64)
    monkeypatch.setitem(fit_runner.SCENARIOS, "cycles", scenario)
    row = FitRunner(tmp_path, 32, Assets(None), host=find_blender_host(), warm_up=False)(TASK, lambda: False)
    assert row.flip < 0.25 * row.start_flip
    # our picture of the true values: noise of 512 samples in both, and a few hundredths of export and renderer
    assert row.flip < row.gap_flip + 0.06
    assert row.gap_flip < 0.08
    assert (row.relit_flips, row.relit_relative_rmse) == ([], None)
    assert {"base_color", "roughness", "metallic"} <= set(row.truth)

    class Forbidden:
        def call(self, *arguments):
            raise AssertionError(f"Blender was called again: {arguments}")

    again = write_cycles_scene(scenario, 0, 32, Forbidden(), tmp_path / "cycles-000")
    assert again.truth.keys() >= {"base_color", "roughness"}
    assert again.given[0].is_file()


def test_without_blender_it_is_said(tmp_path):
    with pytest.raises(SetupError, match="bpy module"):
        FitRunner(tmp_path, 32, Assets(None))(TASK, lambda: False)
