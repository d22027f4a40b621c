# SPDX-License-Identifier: Apache-2.0
"""Whole fits of glass without the preset `paper`. Oracle: the values the reference was rendered with."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.judge import verification as verified_end
from mfo_backend.fit.recover_material import recover_material
from mfo_backend.fit.settings import FitSettings
from mfo_backend.fit.traced import fit as traced_fit
from mfo_backend.fit.traced import sample_count as equal_counts
from mfo_backend.fit.traced.polish import MOST_SAMPLES
from mfo_backend.fit.traced.polished import Polished
from mfo_backend.fit.traced.sample_pools import TilePools
from mfo_backend.types.certainty import Level
from mfo_backend.types.event import Preview, Progress, StageEnd, Started
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.status import Status
from tests.fit.stage_ends import assert_stages_leave_their_values
from tests.fit.traced.glass import NAMES, TRUTH, fit, load
from tests.render.scenes import FLOOR, SKY

# few paths through the glass find it
SMALL_LAMP = """<shape type="sphere"><point name="center" x="1" y="-2" z="3"/><float name="radius" value="0.1"/>
<emitter type="area"><rgb name="radiance" value="3000, 2800, 2400"/></emitter></shape>"""


def test_glass_is_recovered_from_a_noisy_picture(tmp_path):
    renderer = load(tmp_path, size=40)
    x = renderer.table.pack(TRUTH)
    result, events = fit(renderer, renderer.image(x, seed=5, spp=32), preset="balanced")
    assert result.status is Status.CONVERGED
    (note,) = result.notes
    assert "transmission_weight" in note  # why not on recorded paths
    assert "'scan', 'race', 'polish'" in note  # and what was done instead
    assert [e.stage for e in events if isinstance(e, StageEnd)] == ["scan", "race", "polish"]
    assert sum(isinstance(e, Started) for e in events) == 1
    assert any(isinstance(e, Progress) for e in events)
    assert any(isinstance(e, Preview) for e in events)
    assert_stages_leave_their_values(events, result, renderer)
    found = renderer.table.pack(result.recovered)
    sd = np.concatenate([result.certainty[name].sd for name in renderer.table.names])
    assert np.all(np.abs(found - x) < 4.0 * sd + 0.005)
    np.testing.assert_allclose(found[:3], x[:3], atol=0.05)
    mask = renderer.target_mask()
    clean, got, again = (renderer.image(v, seed=s, spp=256)[mask] for v, s in ((x, 8), (found, 9), (x, 10)))
    weight = 1.0 / (clean + 0.1 * clean.mean())
    error, noise = (float(np.mean(((image - clean) * weight) ** 2)) for image in (got, again))
    assert error < 1.3 * noise  # of two pictures with 256 samples; the reference's noise is eight times as large
    assert result.errors["flip"][1] < result.errors["flip"][0]


def test_the_intervals_hold_the_truth(tmp_path):
    renderer = load(tmp_path, size=96)
    x = renderer.table.pack(TRUTH)
    deviations = []
    for seed in range(5, 11):
        result, _ = fit(renderer, renderer.image(x, seed=seed, spp=32))
        sd = np.concatenate([result.certainty[name].sd for name in renderer.table.names])
        deviations.append((renderer.table.pack(result.recovered) - x) / sd)
    assert np.mean(np.abs(deviations) < 1.96) >= 0.88  # 36 values
    assert 0.6 < np.sqrt(np.mean(np.square(deviations))) < 1.4  # as exact as 36 values tell, in six independent fits


def test_values_the_picture_does_not_show_stay_the_users(tmp_path):
    sockets = {"Sheen Tint": {"value": [0.3, 0.3, 0.3], "linked": False}}
    renderer = load(tmp_path, [*NAMES, "sheen_weight", "sheen_tint"], sockets, size=48)
    # at 32 x 32 pixels the FLIP of either end is noisy by what no eye sees, 0.002, which decides
    # with 64 samples the sheen is unsure by 0.07, and another BLAS kernel's rounding moves it from 0.028 to 0.042
    reference = renderer.image(renderer.table.pack({**TRUTH, "sheen_tint": (0.9, 0.1, 0.1)}), seed=5, spp=256)
    result, _ = fit(renderer, reference)
    assert result.certainty["sheen_tint"].level is Level.NOT_VISIBLE
    assert result.recovered["sheen_tint"] == pytest.approx((0.3, 0.3, 0.3))
    assert "sheen_tint" in result.notes[0]
    assert result.recovered["sheen_weight"] == 0.0  # the picture does not ask for it by three deviations


def test_a_coat_is_found_with_all_values_free(tmp_path):
    renderer = load(tmp_path, "all", size=64)
    truth = {**renderer.table.unpack(renderer.start), **TRUTH, "coat_weight": 0.5, "coat_roughness": 0.03}
    # with 64 samples a pixel three seeds have 0.605, 0.579 and 0.552 of the coat on a processor without AVX-512
    result, _ = fit(renderer, renderer.image(renderer.table.pack(truth), seed=5, spp=256))
    for name, atol in {"base_color": 0.02, "roughness": 0.03, "ior": 0.02, "coat_weight": 0.1}.items():
        np.testing.assert_allclose(result.recovered[name], truth[name], atol=atol, err_msg=name)
    # its roughness free from the start, it came out as 1 with a roughness of 0.98; other lobes are not asked for
    assert [result.recovered[name] for name in ("metallic", "sheen_weight")] == [0.0, 0.0]
    assert result.certainty["coat_weight"].level is not Level.NOT_VISIBLE
    for name, certainty in result.certainty.items():
        wrong = np.abs(np.subtract(result.recovered[name], truth[name])) > np.maximum(3 * np.array(certainty.sd), 0.02)
        assert not (certainty.level is Level.DETERMINED and wrong.any()), name


@pytest.mark.parametrize("visible", [False, True])
def test_values_go_back_to_the_users_only_where_no_eye_sees_it(tmp_path, monkeypatch, visible):
    renderer = load(tmp_path, size=32)
    good = renderer.table.pack(TRUTH)
    kept = renderer.table.pack({**TRUTH, "roughness": 0.7 if visible else 0.352})
    variance = np.diag((renderer.table.upper - renderer.table.lower) ** 2)
    unseen = np.zeros(len(good), bool)
    unseen[renderer.table.slice_of("roughness")] = True
    none = np.zeros_like(unseen)
    ends = [Polished(good, 1e-6 * variance + np.diag(unseen) * variance, none, none, None, variance),
            Polished(kept, 1e-6 * variance, unseen, unseen, None, variance)]  # fmt: skip
    monkeypatch.setattr(traced_fit, "polish", lambda setting, raced: (list(ends), setting.pictures))
    monkeypatch.setattr(traced_fit, "choose_end", lambda *given: 0)  # squares under fireflies cannot tell
    result, _ = fit(renderer, renderer.image(good, seed=5, spp=64))
    assert result.certainty["roughness"].level is Level.NOT_TOLD_APART
    assert result.recovered["roughness"] == pytest.approx(0.35 if visible else 0.352)
    assert any("roughness: kept as in the scene" in note for note in result.notes) is not visible


@pytest.mark.parametrize(
    ("lights", "grows"), [(SKY + FLOOR, False), (SKY + FLOOR + SMALL_LAMP, True)], ids=["sky", "fireflies"]
)
def test_a_polish_takes_more_samples_where_an_eye_would_see_their_noise(tmp_path, monkeypatch, lights, grows):
    renderer = load(tmp_path, size=56, lights=lights)
    # a reference of 32 samples is calm enough under the sky for one of three seeds to ask for more
    reference = renderer.image(renderer.table.pack(TRUTH), seed=5, spp=16)
    monkeypatch.setattr(equal_counts, "LOUD", np.inf)  # as where a reference has more samples than are compared
    weights, add = [], TilePools.add

    def added(self, samples, weight):
        weights.append(weight)
        add(self, samples, weight)

    monkeypatch.setattr(TilePools, "add", added)
    # the first step with more samples says all
    fit(renderer, reference, stop=lambda: bool(weights) and max(weights) > weights[0])
    assert weights[0] < MOST_SAMPLES
    assert (max(weights) > weights[0]) is grows
    assert max(weights) <= MOST_SAMPLES


def test_fireflies_do_not_decide_where_counts_are_equal(tmp_path, monkeypatch):
    renderer = load(tmp_path, size=48, lights=SKY + FLOOR + SMALL_LAMP)
    x = renderer.table.pack(TRUTH)
    width = renderer.table.upper - renderer.table.lower
    errors = {True: [], False: []}
    for seed in (5, 6):
        reference = renderer.image(x, seed=seed, spp=8)
        for equal in errors:
            monkeypatch.setattr(equal_counts, "LOUD", 0.25 if equal else np.inf)
            result, _ = fit(renderer, reference)
            assert any("as noisy as one of" in note for note in result.notes) is equal
            errors[equal].append(np.mean(np.abs(renderer.table.pack(result.recovered) - x) / width))
    assert np.mean(errors[True]) < 0.3 * np.mean(errors[False])  # 0.011 and 0.092


def test_a_start_that_is_right_stays_so_within_the_noise(tmp_path):
    """The picture moves by 0.10 to 0.53 of the reference's noise; six values of 300 pixels would be 0.14."""
    renderer = load(tmp_path, size=24)
    reference = renderer.image(renderer.start, seed=5, spp=512)
    result, _ = fit(renderer, reference)
    found = renderer.table.pack(result.recovered)
    before, after = (renderer.image(x, seed=9, spp=4096) for x in (renderer.start, found))
    moved, noise = (np.sqrt(np.mean((image - before)[renderer.target_mask()] ** 2)) for image in (after, reference))
    assert moved < 0.7 * noise


@pytest.mark.parametrize("calls", [2, 12, 30])
def test_cancel_returns_the_best_so_far(tmp_path, calls):
    renderer = load(tmp_path, size=24)
    left = iter(range(10**6))
    result, _ = fit(renderer, renderer.image(renderer.start, seed=5, spp=16), stop=lambda: next(left) > calls)
    assert result.status is Status.CANCELLED
    assert np.isfinite(renderer.table.pack(result.recovered)).all()


def test_an_alpha_that_is_free_needs_no_other_preset(tmp_path):
    renderer = load(
        tmp_path, ["base_color", "roughness", "alpha"], {"Metallic": {"value": 0.7, "linked": False}}, size=40
    )
    x = renderer.table.pack({"base_color": (0.7, 0.4, 0.2), "roughness": 0.4, "alpha": 0.6})
    result, _ = fit(renderer, renderer.image(x, seed=5, spp=64))
    assert [stage.name for stage in result.stages] == ["scan", "race", "polish"]
    np.testing.assert_allclose(renderer.table.pack(result.recovered), x, atol=0.06)


def test_every_step_can_be_shown(tmp_path, monkeypatch):
    monkeypatch.setattr("mfo_backend.fit.result.course.ONCE_SECONDS", 0.0)
    renderer = load(tmp_path, size=24)
    result, events = fit(renderer, renderer.image(renderer.table.pack(TRUTH), seed=5, spp=16))
    previews = [e.image for e in events if isinstance(e, Preview)]
    assert len(previews) == sum(stage.iterations for stage in result.stages) + 1
    last, seen = previews[-1], previews[-2]
    assert seen.shape == last.shape
    assert abs(seen.mean() / last.mean() - 1.0) < 0.05  # 4 paths a pixel of 576, their noise is a hundredth


@pytest.mark.parametrize("shape", [(24, 24), (90, 150), (61, 400)])
def test_a_preview_costs_the_same_for_every_picture(tmp_path, monkeypatch, shape):
    renderer = load(tmp_path, size=24)
    from mfo_backend.render.traced.traced_paths import TracedPaths

    paths = TracedPaths(renderer)
    monkeypatch.setattr(traced_fit, "_PREVIEW_PATHS", 1 << 11)
    traced = []

    def images(xs, pixels, *, samples, **_):
        assert pixels.max() < shape[0] * shape[1]
        traced.append(len(pixels) * samples)
        return np.ones((1, len(pixels), 3, 1), np.float32)

    monkeypatch.setattr(paths, "images", images)
    picture = traced_fit._preview(paths, renderer.start, shape, 0)
    assert picture.shape == (*shape, 3)
    assert np.all(picture == 1.0)
    assert traced[0] < 1.3 * (1 << 11)  # rows and columns are rounded up


def test_no_launch_is_longer_than_a_request_to_stop_may_wait(tmp_path, monkeypatch):
    renderer = load(tmp_path, size=160)
    reference = renderer.image(renderer.table.pack(TRUTH), seed=5, spp=16)
    from mfo_backend.render.traced import traced_paths

    launches, parts = [], []
    launch, pictures = traced_paths.TracedPaths._launch, renderer.pixels_later

    def launched(self, vectors, pixels, begin, seed, samples, jacobian):
        launches.append(len(vectors) * len(pixels) * samples)
        return launch(self, vectors, pixels, begin, seed, samples, jacobian)

    def part(x, pixels, *, seed, spp):
        parts.append(len(pixels) * spp)
        return pictures(x, pixels, seed=seed, spp=spp)

    monkeypatch.setattr(traced_paths.TracedPaths, "_launch", launched)
    monkeypatch.setattr(renderer, "pixels_later", part)
    fit(renderer, reference)
    assert max(launches) <= traced_paths.LANES_OF_A_LAUNCH == 1 << 17
    assert len(parts) > 4
    assert max(parts) <= verified_end.PATHS_OF_A_PART == 1 << 19


def test_losses_of_the_users_choice_are_no_stages_of_glass(tmp_path):
    renderer = load(tmp_path, size=16)
    settings = FitSettings(
        model="blender_principled", preset="fast", losses=("mse",), max_iterations=1, spp=1, verify_spp=1
    )
    result = recover_material(
        renderer,
        Image(renderer.image(renderer.start, seed=5, spp=4), Encoding.LINEAR),
        settings,
        listener=lambda event: None,
        should_stop=lambda: False,
    ).result
    assert "losses" in result.notes[-1]
    assert "'paper' was used instead of 'fast'" in result.notes[-1]


def test_paths_to_the_noise_of_a_small_picture(tmp_path, monkeypatch):
    renderer = load(tmp_path, size=64)
    from mfo_backend.render.traced.traced_paths import TracedPaths

    monkeypatch.setattr("mfo_backend.fit.result.course.ONCE_SECONDS", np.inf)  # they come by the clock
    launch, launches, passes = TracedPaths._launch, [], []
    monkeypatch.setattr(TracedPaths, "_launch", lambda *given: launches.append(given) or launch(*given))
    for truth in ({}, {"roughness": 0.1, "ior": 1.6}):
        reference = renderer.image(renderer.table.pack({**TRUTH, **truth}), seed=5, spp=32)
        before = renderer.passes
        result, _ = fit(renderer, reference)
        passes.append(result.passes - before)
    # 31 and 56, of which verification is 2, in 66 launches when this was written: counts that no machine changes; a
    # fifth more is a change worth a look
    assert np.sum(passes) < 104.0, passes
    assert len(launches) < 79
