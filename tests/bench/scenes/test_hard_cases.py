# SPDX-License-Identifier: Apache-2.0
"""The hard cases as data, and a few of them small enough for every run."""

from __future__ import annotations

import re
from dataclasses import asdict
from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.bench.report.hard_section import hard_table
from mfo_backend.bench.runs.hard_runs import HardRun, run_hard_case, wrongly_determined
from mfo_backend.bench.scenes.hard_cases import HARD_CASES, write_hard_scene
from mfo_backend.material.mitsuba_parameters import MITSUBA_PRINCIPLED
from mfo_backend.types.certainty import Certainty, Level


def test_every_hard_case_is_there():
    # seventeen, of which metallic counts twice, glass three times, and eight materials in two models
    assert len(HARD_CASES) == 28
    assert all(case.limit > 0.0 for case in HARD_CASES.values())


def test_glass_is_fitted_by_the_stages_of_the_presets(tmp_path):
    run = run_hard_case(HARD_CASES["glass-0.1"], 0, 32, tmp_path, preset="fast")
    assert run.error < 0.05 < 0.3 < run.start_error  # FLIP above the noise; 32 pixels hold a quarter of the usual
    assert any("whole light paths were traced" in guard for guard in run.guards)


@pytest.mark.parametrize("name", ["sheen", "blender-sheen"])
def test_sheen_is_lit_from_behind(name, tmp_path):
    for seed in range(4):
        text = write_hard_scene(HARD_CASES[name], seed, 16, tmp_path).file.read_text()
        camera = np.array(re.search(r'origin="([^"]*)"', text)[1].split(","), float)
        lamp = np.array(re.search(r'position" x="([^"]*)" y="([^"]*)" z="([^"]*)"', text).groups(), float)
        angle = np.degrees(np.arccos(camera @ lamp / np.linalg.norm(camera) / np.linalg.norm(lamp)))
        assert 90.0 < angle < 165.0  # Mitsuba's sheen goes with (1 - cos(angle / 2))^5


def test_light_at_the_silhouette_is_as_exact_as_elsewhere(tmp_path):
    """Most light is in pixels of which slivers are lit: an error of 0.05 without them."""
    run = run_hard_case(HARD_CASES["blender-sheen"], 9, 64, tmp_path)
    assert run.solved
    assert not run.wrong


@pytest.mark.parametrize("name", ["mirror-like", "blender-black", "soft-light", "fireflies", "tiny", "glass-0.6"])
def test_scenes_follow_from_name_and_seed(name, tmp_path):
    first, again, other = (
        write_hard_scene(HARD_CASES[name], n, 16, tmp_path / f"{k}") for k, n in enumerate([3, 3, 4])
    )
    assert first.truth == again.truth != other.truth
    text = first.file.read_text().replace(str(first.file.parent), "")
    assert text == again.file.read_text().replace(str(again.file.parent), "")
    shown = first.true_file.read_text() != first.file.read_text()  # Blender's model has its values beside the scene
    assert shown == (not first.materials)
    assert first.start != first.truth
    for key, value in HARD_CASES[name].truth.items():
        assert first.truth[key] == value


@pytest.mark.parametrize(
    "name", ["metallic-0", "blender-black", "clipped", "exposure", "other-object", "fireflies", "all-locked"]
)
def test_small_hard_cases(name, tmp_path):
    run = run_hard_case(HARD_CASES[name], 0, 24, tmp_path, preset="fast")
    assert run.finite
    assert run.error <= run.start_error + 0.005
    if name in ("metallic-0", "clipped"):
        assert run.error < 0.03  # 24 pixels hold a tenth of what the limit of 1 % is for
    if name == "all-locked":
        assert run.solved
        assert "No parameter is selected" in run.guards[0]


def test_the_table_counts_failures_and_names_guards():
    runs = [
        HardRun("black", 0, True, 0.001, 0.5, True, 40.0, (), ("roughness",)),  # solved: the picture does not tell
        HardRun("black", 1, False, np.inf, 0.5, False, 60.0, ("The light was recorded 2 times: it moved.",)),
        HardRun("black", 2, False, 0.2, 0.5, True, 70.0, (), ("roughness",)),
    ]
    line = hard_table([asdict(run) for run in runs]).rows[-1]
    assert line == ("black", "3", "1 (33%)", "–", "60", "1", "1", "2", "The light was recorded times (1)")


def test_a_determined_value_is_wrong_beyond_three_deviations_and_what_determined_promises():
    table = MITSUBA_PRINCIPLED
    truth = {"base_color": (0.2, 0.5, 0.9), "roughness": 0.3, "metallic": 0.5, "specular": 1.5}
    found = {"base_color": (0.2, 0.5, 0.84), "roughness": 0.315, "metallic": 0.9, "specular": 0.999}
    certainty = {
        "base_color": Certainty((0.001, 0.001, 0.015), Level.DETERMINED),  # one channel by four deviations
        "roughness": Certainty((0.001,), Level.DETERMINED),  # by fifteen, and less than an eye sees
        "metallic": Certainty((0.1,), Level.WEAK),
        "specular": Certainty((0.001,), Level.DETERMINED),  # the truth lies outside the box
    }
    result = SimpleNamespace(certainty=certainty, recovered=found)
    assert wrongly_determined(result, truth, table) == ("base_color",)
