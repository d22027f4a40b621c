# SPDX-License-Identifier: Apache-2.0
"""Real fits of tiny scenes. Counts are guarded, not seconds."""

from __future__ import annotations

import pytest

from mfo_backend.bench.assets import Assets
from mfo_backend.bench.fit_runner import FitRunner
from mfo_backend.bench.row import Task
from mfo_backend.bench.summary import SOLVED_FLIP
from mfo_backend.types.errors import BadInputError


@pytest.fixture(scope="module")
def runner(tmp_path_factory):
    return FitRunner(tmp_path_factory.mktemp("bench"), 32, Assets(None))


def never() -> bool:
    return False


def test_fast_solves_the_reduced_set(runner):
    rows = [runner(Task("parameters", scene, "fast"), never) for scene in range(4)]
    assert sum(r.flip <= SOLVED_FLIP for r in rows) >= MOST_SOLVED
    assert max(r.passes for r in rows) < MOST_PASSES
    assert rows[0].warm_up_seconds > 0
    assert rows[1].warm_up_seconds == 0
    for r in rows:
        assert r.flip < r.start_flip
        assert 0 <= r.relative_rmse
        assert set(r.parameter_errors) == {"base_color", "roughness", "metallic", "specular"}


def test_the_truth_itself_has_no_error(runner):
    runner(Task("parameters", 0, "fast"), never)
    judge = runner._judge
    difference = judge.difference(judge.true_values())
    assert (difference.flip, difference.relative_rmse) == (0.0, 0.0)  # the same picture twice
    assert judge.relit_relative_rmse(judge.true_values()) == 0.0
    assert 0 < judge.floor.relative_rmse


def test_glass_is_refused_by_our_presets(runner):
    with pytest.raises(BadInputError, match="spec_trans"):
        runner(Task("transparency", 0, "fast"), never)


def test_the_papers_loop_improves_on_the_start_under_a_probe(runner):
    row = runner(Task("noise", 0, "mse-hdr"), never)
    assert row.status in ("stale", "unchanged", "max_iterations")
    assert row.flip < 0.7 * row.start_flip


def test_a_stopped_fit_is_no_row(runner):
    assert runner(Task("parameters", 0, "balanced"), lambda: True).status == "cancelled"
