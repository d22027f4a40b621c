# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace

import numpy as np
import pytest

from mfo_backend.fit.recover_material import recover_material
from mfo_backend.fit.result.outcome import FitOutcome
from mfo_backend.fit.settings import FitSettings
from mfo_backend.metrics.display.colour import srgb_from_linear
from mfo_backend.types.errors import BadInputError, SetupError
from mfo_backend.types.event import Started
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.status import Status


def fit(renderer, reference, *, listener=lambda event: None, should_stop=lambda: False, **settings) -> FitOutcome:
    return recover_material(renderer, reference, FitSettings(**settings), listener=listener, should_stop=should_stop)


@pytest.mark.parametrize("range_", ["hdr", "ldr"])
def test_the_paper_preset_recovers_the_sphere(sphere, truth, range_: str) -> None:
    events = []
    outcome = fit(sphere, sphere.reference(truth), range=range_, listener=events.append)
    result = outcome.result
    assert events[0] == Started((f"mse-{range_}", f"flip-{range_}"), sphere.table.names, events[0].seconds)
    assert [stage.name for stage in result.stages] == [f"mse-{range_}", f"flip-{range_}"]
    for name in ("flip", "hdr_flip", "mse"):
        start, end = result.errors[name]
        assert end < 0.1 * start
    np.testing.assert_allclose(sphere.table.pack(result.recovered), truth, atol=0.05)
    assert result.initial == sphere.table.unpack(sphere.start)
    assert result.bounds["roughness"] == (0.2, 1.0)
    assert result.passes == sphere.passes


def test_a_display_reference_is_fitted_by_ldr_losses(sphere, truth) -> None:
    shown = srgb_from_linear(np.clip(sphere.reference(truth).pixels, 0, 1)).astype(np.float32)
    outcome = fit(sphere, Image(shown, Encoding.SRGB))
    assert [stage.name for stage in outcome.result.stages] == ["mse-ldr", "flip-ldr"]
    assert set(outcome.result.errors) == {"flip", "mse"}
    assert outcome.result.errors["flip"][1] < 0.1 * outcome.result.errors["flip"][0]


@pytest.mark.parametrize(
    "losses", [("pu21", "itp", "flip"), ("log", "flip-ldr"), ("relative", "mse-ldr"), ("itp",)], ids="-".join
)
def test_any_losses_make_a_ladder(sphere, truth, losses) -> None:
    settings = FitSettings(preset="paper", losses=losses)
    outcome = fit(sphere, sphere.reference(truth), preset="paper", losses=losses)
    assert tuple(stage.name for stage in outcome.result.stages) == settings.stage_names(Encoding.LINEAR)
    np.testing.assert_allclose(sphere.table.pack(outcome.result.recovered), truth, atol=0.06)


@pytest.mark.judges
def test_color_video_vdp_is_a_stage(sphere, truth) -> None:
    if not all(map(importlib.util.find_spec, ("torch", "pycvvdp"))):
        pytest.skip("the extra `judges` is not installed")
    outcome = fit(sphere, sphere.reference(truth), preset="paper", losses=("mse", "cvvdp"), max_iterations=25)
    assert [stage.name for stage in outcome.result.stages] == ["mse-hdr", "cvvdp-hdr"]
    mse, judged = outcome.result.stages
    assert judged.loss_best < judged.loss_start
    assert mse.values != judged.values


@pytest.mark.parametrize("name", ["cvvdp", "lpips", "lpips_pu", "lpips_vgg"])
def test_a_loss_whose_package_is_missing_is_refused_before_the_fit(sphere, truth, name, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    events = []
    with pytest.raises(SetupError, match="-m pip install"):
        fit(sphere, sphere.reference(truth), preset="paper", losses=("mse", name), listener=events.append)
    assert events == []


def test_the_last_pictures_have_a_seed_and_samples_of_their_own(noisy_sphere, sphere, truth) -> None:
    outcome = fit(noisy_sphere, sphere.reference(truth), max_iterations=5, seed=3, spp=4, verify_spp=32)
    *fitted, _, _, last, first_half, second_half = noisy_sphere.calls
    assert set(fitted) == {(3, 4)}
    assert last[0] != 3
    assert last[1] == 32
    # two pictures of the result with numbers of their own say how far it is from the reference beyond the noise
    assert len({0, last[0], first_half[0], second_half[0]}) == 4
    assert first_half[1] == second_half[1] == 16
    vector = noisy_sphere.table.pack(outcome.result.recovered)
    np.testing.assert_array_equal(outcome.result_image, noisy_sphere.image(vector, seed=last[0], spp=last[1]))


def test_a_gain_that_only_the_fits_own_noise_shows_is_rejected(noisy_sphere, truth) -> None:
    # the start is the truth, so whatever lowers the loss under seed 0 fits that seed's noise
    noisy_sphere.start = truth
    reference = replace(noisy_sphere.reference(truth))
    outcome = fit(noisy_sphere, reference, spp=1, verify_spp=4096, losses=("mse",))
    assert outcome.result.stages[0].loss_best < outcome.result.stages[0].loss_start
    assert outcome.result.recovered == outcome.result.initial
    assert "the start was kept" in outcome.result.message


def test_the_perceptual_stage_never_makes_the_result_worse(sphere, truth) -> None:
    reference = sphere.reference(truth)
    low = fit(sphere, reference, losses=("mse",), max_iterations=40)
    both = fit(sphere, reference, max_iterations=40)
    assert both.result.errors["hdr_flip"][1] <= low.result.errors["hdr_flip"][1]


@pytest.mark.parametrize("after", [0, 4, 30])
def test_cancel_returns_the_best_without_another_picture(sphere, truth, after: int) -> None:
    polls = iter([False] * after + [True] * 1000)
    outcome = fit(sphere, sphere.reference(truth), should_stop=lambda: next(polls))
    assert outcome.result.status is Status.CANCELLED
    assert sphere.calls == [(0, 16)] * (1 + after)
    start, end = outcome.result.errors["mse"]
    assert end < start if after else end == start


def test_a_background_of_its_own_does_not_disturb_the_fit(sphere, truth) -> None:
    reference = sphere.reference(truth)
    pixels = np.where(sphere.target_mask()[..., None], reference.pixels, np.float32(30.0))
    outcome = fit(sphere, replace(reference, pixels=pixels), losses=("mse",))
    assert outcome.result.stages[0].loss_best < 1e-4
    np.testing.assert_allclose(sphere.table.pack(outcome.result.recovered), truth, atol=0.05)


def test_a_reference_that_is_the_start_is_done_at_once(sphere) -> None:
    outcome = fit(sphere, sphere.reference(sphere.start))
    assert [stage.iterations for stage in outcome.result.stages] == [11, 11]
    assert outcome.result.recovered == outcome.result.initial


@pytest.mark.parametrize(
    ("pixels", "sentence"),
    [
        (np.ones((24, 12, 3), np.float32), "Reference is 12x24 but the scene renders 24x24"),
        (np.zeros((24, 24, 3), np.float32), "black where the target is"),
        (np.full((24, 24, 3), np.nan, np.float32), "NaN"),
    ],
)
def test_refuses_references_that_do_not_fit(sphere, pixels, sentence: str) -> None:
    with pytest.raises(BadInputError, match=sentence):
        fit(sphere, Image(pixels, Encoding.LINEAR))


def test_refuses_a_target_the_camera_does_not_see(sphere, truth, monkeypatch) -> None:
    monkeypatch.setattr(sphere, "target_mask", lambda: np.zeros((24, 24), bool))
    with pytest.raises(BadInputError, match="does not see the target"):
        fit(sphere, sphere.reference(truth))
