# SPDX-License-Identifier: Apache-2.0
"""Real fits of tiny scenes. Counts are guarded, not seconds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest

from mfo_backend.bench.judge import judge as judge_module
from mfo_backend.bench.judge.judge import DOUBTED_JOD, MORE_PARTS, Judge
from mfo_backend.bench.rows.method import method_settings
from mfo_backend.bench.rows.row import Task
from mfo_backend.bench.rows.summary import SOLVED_FLIP
from mfo_backend.bench.runs import fit_runner
from mfo_backend.bench.runs.fit_runner import FitRunner
from mfo_backend.bench.scenes.assets import Assets
from mfo_backend.metrics.compare import compare_images
from mfo_backend.types.image import Encoding, Image


@pytest.fixture(scope="module")
def runner(tmp_path_factory):
    return FitRunner(tmp_path_factory.mktemp("bench"), 32, Assets(None))


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    """For what depends neither on the size of the pictures nor on seconds."""
    return FitRunner(tmp_path_factory.mktemp("small"), 16, Assets(None), warm_up=False)


def never() -> bool:
    return False


def test_fast_solves_the_reduced_set(runner):
    rows = [runner(Task("parameters", scene, "fast"), never) for scene in range(4)]
    assert sum(r.flip <= SOLVED_FLIP for r in rows) == 4
    # 88, 45, 36 and 36 when this was written; a stage that runs to its limit costs hundreds
    assert max(r.passes for r in rows) < 120
    for r in rows:
        ends = [stage["processor_seconds"] for stage in r.stages]
        assert ends[0] > 0.0
        assert ends == sorted(ends)
        assert ends[-1] < r.processor_seconds
    assert rows[0].warm_up_seconds > 0
    assert rows[1].warm_up_seconds == 0
    for r in rows:
        assert r.flip < r.start_flip
        assert r.relative_rmse >= 0
        assert set(r.parameter_errors) == {"base_color", "roughness", "metallic", "specular"}


def test_every_light_is_warmed_up_for(tmp_path, monkeypatch):
    """A probe of another size has kernels of its own, whose compilation is no part of a fit's time."""
    lights, write = ("small", "small", "large", "small"), fit_runner.write_scene
    monkeypatch.setattr(fit_runner, "write_scene", lambda s, k, *rest: replace(write(s, k, *rest), light=lights[k]))
    runner = FitRunner(tmp_path, 8, Assets(None))
    rows = [runner(Task("parameters", scene, "fast"), never) for scene in range(4)]
    assert [row.light for row in rows] == [*lights]
    assert [row.warm_up_seconds > 0 for row in rows] == [True, False, True, False]


def test_the_truth_itself_has_no_error(runner):
    runner(Task("parameters", 0, "fast"), never)
    judge = runner._judge
    difference = judge.difference(judge.true_values())
    assert (difference.flip, difference.relative_rmse) == (0.0, 0.0)  # the same picture twice
    assert judge.relit(judge.true_values())[0].relative_rmse == 0.0
    assert judge.pictures.floor.relative_rmse > 0


def test_a_score_alone_renders_the_truth_and_the_values_and_nothing_else(runner, monkeypatch):
    row = runner(Task("parameters", 0, "fast"), never)
    pictures = runner._judge.pictures
    runner._at = None
    monkeypatch.setattr(Judge, "_render", lambda _judge: pytest.fail("all true pictures were rendered"))
    truth, found = runner.judged_pair(row)
    np.testing.assert_array_equal(truth, pictures.truth[0])
    assert compare_images(Image(truth, Encoding.LINEAR), Image(found, Encoding.LINEAR), mask=pictures.mask).metrics[
        "flip"
    ] == pytest.approx(row.flip, rel=1e-5)


@dataclass(frozen=True)
class Said:
    jod: float
    hdrvdp3_q_jod: float | None = None


def test_a_score_that_the_judges_own_noise_lowers_is_taken_again(runner, monkeypatch):
    runner(Task("noise", 0, "fast"), never)
    judge = runner._judge
    values = judge.true_values()
    picture = judge._renderer.image(judge.truth, seed=judge._seed + 77, spp=judge._spp)

    def scored(scale):
        def judged(true, test):
            error = np.sqrt(np.mean(np.square(true.pixels - test.pixels))) / true.pixels.mean()
            return Said(10.0 - scale * float(error))

        monkeypatch.setattr(judge_module, "judge_images", judged)
        return judge.settled(judge.difference_of(picture), values, picture)

    monkeypatch.setattr(judge_module, "judges_present", lambda: True)
    noisy = judge.difference_of(judge._renderer.image(judge.truth, seed=judge._seed + 78, spp=judge._spp))
    clear, spp = scored(1e-9)
    assert spp == judge._spp
    scale = 2.0 / (10.0 - scored(1.0)[0].jod)  # two pictures of the truth get about 8
    again, spp = scored(scale)
    assert spp == MORE_PARTS * judge._spp
    assert again.jod > DOUBTED_JOD > judge.difference_of(picture).jod
    assert again.flip == judge.difference_of(picture).flip == pytest.approx(noisy.flip, rel=0.2)
    assert clear.jod == pytest.approx(10.0)


def test_a_wrong_picture_is_not_saved_by_more_samples(runner, monkeypatch):
    runner(Task("parameters", 0, "fast"), never)
    judge = runner._judge
    monkeypatch.setattr(judge_module, "judges_present", lambda: True)
    monkeypatch.setattr(judge_module, "judge_images", lambda true, test: Said(10.0 - 2.0 * (true is not test)))
    start = judge._renderer.table.unpack(judge._renderer.start)
    picture = judge.picture(start)
    again, _ = judge.settled(judge.difference_of(picture), start, picture)
    assert again.jod == 8.0


def test_glass_is_fitted_in_blenders_model(small):
    row = small(Task("transparency_4spp", 0, "fast"), never)
    assert set(row.recovered) == {"base_color", "roughness", "ior", "transmission_weight"}
    assert row.flip < row.start_flip


def test_the_papers_loop_improves_on_the_start_under_a_probe(small, monkeypatch):
    monkeypatch.setattr(fit_runner, "method_settings", lambda *a: replace(method_settings(*a), max_iterations=8))
    row = small(Task("noise", 0, "mfo-hdr"), never)
    assert row.status == "max_iterations"
    assert row.flip < row.start_flip
    # start; two stages, whose last iteration needs no slope; the final pictures of start and both stages
    assert row.passes == 1 + 2 * (8 + 7 * 2) + 3


def test_a_stopped_fit_is_no_row(small):
    assert small(Task("parameters", 0, "balanced"), lambda: True).status == "cancelled"
