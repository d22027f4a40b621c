# SPDX-License-Identifier: Apache-2.0
"""The best values a running fit tells: when, of which stage, and inside which bounds."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.paper.loop import run_stages
from mfo_backend.fit.recover_material import recover_material
from mfo_backend.fit.result import best_so_far
from mfo_backend.fit.result.best_so_far import BestSoFar
from mfo_backend.fit.result.outcome import Candidate
from mfo_backend.fit.settings import FitSettings
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.event import BestValues
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.parameter_bounds import narrowed
from mfo_backend.types.status import Status
from tests.fit.stage_ends import assert_stages_leave_their_values
from tests.render.scenes import POINT, write_scene


def test_once_a_second_only_what_is_new_and_at_once_when_asked(sphere) -> None:
    told = []
    best = BestSoFar(sphere, told.append, began=100.0)
    x = sphere.start
    best.found("mse-hdr", x)
    best.tell(100.5)
    assert not told  # the first second of a fit
    best.tell(101.0)
    best.tell(105.0)
    assert len(told) == 1  # nothing new
    best.found("mse-hdr", x + 0.01)
    best.tell(101.5)
    best.tell(101.6, at_once=True)
    assert [event.result.seconds for event in told] == [pytest.approx(1.0), pytest.approx(1.6)]
    result = told[-1].result
    assert result.status is Status.FAILED
    assert "'mse-hdr'" in result.message
    np.testing.assert_allclose(sphere.table.pack(result.recovered), x + 0.01)
    np.testing.assert_array_equal(sphere.table.pack(result.initial), x)


def test_values_are_finite_and_inside_the_bounds(sphere) -> None:
    told = []
    sphere.table = narrowed(sphere.table, {"roughness": (0.3, 0.6)})
    best = BestSoFar(sphere, told.append, began=0.0)
    best.found("scan", np.array([0.5, 0.5, 0.5, 0.05, 0.5]))
    best.found("scan", np.full(5, np.nan))
    best.tell(2.0)
    assert told[0].result.recovered["roughness"] == 0.3
    assert told[0].result.bounds["roughness"] == (0.3, 0.6)


def test_the_papers_stages_tell_the_best_under_their_own_loss(sphere, truth, monkeypatch) -> None:
    monkeypatch.setattr(best_so_far, "ONCE_SECONDS", 0.0)
    loss, told = make_loss("mse-hdr", sphere.reference(truth)), []

    def listener(event) -> None:
        if isinstance(event, BestValues):
            told.append(sphere.table.pack(event.result.recovered))

    start = Candidate(sphere.start, sphere.image(sphere.start, seed=0, spp=1))
    settings = FitSettings(max_iterations=60)
    outcome = run_stages(sphere, [loss], start, settings, listener=listener, should_stop=lambda: False)
    values = [loss.value(sphere.image(x, seed=0, spp=1)) for x in told]
    assert len(told) > 10
    assert values == sorted(values, reverse=True)  # the sphere has no noise
    np.testing.assert_array_equal(told[-1], outcome.candidates[-1].vector)


def test_every_stage_on_recorded_paths_leaves_its_values(tmp_path) -> None:
    """Preset `best`, which has all stages of `fast` and `balanced`; here each takes less than a second."""
    path = write_scene(tmp_path, POINT, size=16)
    renderer = load_renderer(path, "target", model="mitsuba_principled", parameters=["base_color", "roughness"])
    truth = renderer.table.pack({"base_color": (0.7, 0.4, 0.2), "roughness": 0.4})
    reference = Image(renderer.image(truth, seed=5, spp=64), Encoding.LINEAR)
    events = []
    outcome = recover_material(
        renderer, reference, FitSettings(preset="best", verify_spp=4, losses=("mse", "itp")),
        listener=events.append, should_stop=lambda: False,
    )  # fmt: skip
    stages = [stage.name for stage in outcome.result.stages]
    assert stages == ["scan", "start", "refine", "mse-hdr", "itp-hdr", "flip"]
    assert_stages_leave_their_values(events, outcome.result, renderer)
