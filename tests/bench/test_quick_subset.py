# SPDX-License-Identifier: Apache-2.0
"""A part of the bench that runs with every change: solved counts and passes, which no busy machine changes."""

from __future__ import annotations

import pytest

from mfo_backend.bench.assets import Assets
from mfo_backend.bench.fit_runner import FitRunner
from mfo_backend.bench.row import Task


@pytest.fixture(scope="module")
def runner(tmp_path_factory):
    return FitRunner(tmp_path_factory.mktemp("bench"), 32, Assets(None))


@pytest.mark.parametrize(
    ("scenario", "method", "flips", "passes"),
    [
        # FLIP and passes when this was written:
        ("base", "fast", (0.0006, 0.0008), (113, 130)),
        ("noise", "fast", (0.041, 0.093), (280, 286)),  # 4 samples a pixel; noise alone is 0.054 and 0.317
        ("objects", "fast", (0.051, 0.049), (601, 360)),  # 4 samples a pixel; noise alone is 0.116 and 0.175
        ("relighting", "balanced", (0.012,), (322,)),
    ],
)
def test_no_scene_gets_worse_or_dearer(runner, scenario, method, flips, passes):
    rows = [runner(Task(scenario, scene, method), lambda: False) for scene in range(len(flips))]
    # other compilers and processors round differently, and a fit that takes one step more is no loss
    assert [row.flip <= 1.25 * flip + 0.002 for row, flip in zip(rows, flips, strict=True)] == [True] * len(flips)
    assert [row.passes <= 1.3 * limit for row, limit in zip(rows, passes, strict=True)] == [True] * len(flips)
    for row in rows:
        assert row.relit_flips
        assert all(flip < row.start_flip for flip in row.relit_flips)
        assert set(row.certainty) == set(row.recovered)
        assert [stage["name"] for stage in row.stages][:3] == ["scan", "start", "refine"]
        assert sum(row.parts.values()) == pytest.approx(row.seconds, rel=0.2, abs=0.05)  # watched all the time
