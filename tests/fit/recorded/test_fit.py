# SPDX-License-Identifier: Apache-2.0
"""Whole fits on synthetic truths: the values behind the reference are known."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.recover_material import recover_material
from mfo_backend.fit.settings import FitSettings
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.certainty import Level
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.event import Preview, Progress, StageEnd, Started
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.status import Status
from tests.metrics.display.view_tables import baked, filmic
from tests.render.scenes import AREA, POINT, SKY, write_scene

REDUCED = ["base_color", "roughness", "metallic", "specular"]
TRUTHS = [
    {"base_color": (0.7, 0.2, 0.1), "roughness": 0.35, "metallic": 0.2, "specular": 0.6},
    {"base_color": (0.05, 0.3, 0.6), "roughness": 0.7, "metallic": 0.8, "specular": 0.3},
    {"base_color": (0.9, 0.9, 0.85), "roughness": 0.2, "metallic": 0.95, "specular": 0.5},
]


def fit(renderer, reference, *, encoding=Encoding.LINEAR, stop=lambda: False, display=None, **settings):
    events = []
    settings = FitSettings(**{"preset": "fast", "verify_spp": 32} | settings)
    outcome = recover_material(
        renderer, Image(reference, encoding), settings, display=display, listener=events.append, should_stop=stop
    )
    return outcome, events


def load(folder, lights, names=REDUCED, **options):
    return load_renderer(write_scene(folder, lights, **options), "target", model="mitsuba_principled", parameters=names)


def relative_rms(a, b, mask):
    return float(np.sqrt(np.mean((a - b)[mask] ** 2) / np.mean(b[mask] ** 2)))


@pytest.mark.parametrize("truth", TRUTHS, ids=["plastic", "metal-blue", "metal-white"])
def test_point_light_is_solved_from_nothing(tmp_path, truth):
    renderer = load(tmp_path, POINT, size=32)
    x = renderer.table.pack(truth)
    reference = renderer.image(x, seed=5, spp=2048)
    outcome, events = fit(renderer, reference)
    mask = renderer.target_mask()
    result = renderer.image(renderer.table.pack(outcome.result.recovered), seed=5, spp=2048)
    # the same random numbers: what is left is the error of the values; 2048 samples leave 0.5 % in the highlights of
    # the reference
    assert relative_rms(result, reference, mask) < 0.01
    assert outcome.result.status is Status.CONVERGED
    assert outcome.result.passes < 300  # a pass is one primal picture
    assert [type(e) for e in events if isinstance(e, (Started, StageEnd))] == [Started] + [StageEnd] * 3
    assert any(isinstance(e, Progress) for e in events)
    assert outcome.result.errors["mse"][1] < outcome.result.errors["mse"][0]


def test_sky_and_four_samples_a_pixel_reach_the_noise(tmp_path):
    renderer = load(tmp_path, SKY + POINT, size=48)
    x = renderer.table.pack(TRUTHS[0])
    reference = renderer.image(x, seed=5, spp=4)
    outcome, _ = fit(renderer, reference)
    found = renderer.table.pack(outcome.result.recovered)
    clean, result = (renderer.image(v, seed=9, spp=256) for v in (x, found))
    mask = renderer.target_mask()
    noise = relative_rms(reference, clean, mask)
    assert relative_rms(result, clean, mask) < 0.25 * noise  # 100 tiles of 64 samples average the noise away
    np.testing.assert_allclose(found[:4], x[:4], atol=0.05)


@pytest.mark.parametrize("lamp", ['x="2" y="6" z="1"', 'x="0" y="5" z="1.6"'])
def test_a_lamp_behind_the_target_lights_its_silhouette(tmp_path, lamp):
    behind = POINT.replace('x="2" y="-3" z="3"', lamp)
    renderer = load(tmp_path, behind, size=32)
    reference = renderer.image(renderer.table.pack(TRUTHS[0]), seed=5, spp=2048)
    lit = renderer.target_mask() & (reference.max(axis=2) > 0.0)
    assert 0 < lit.sum() < 0.05 * renderer.target_mask().sum()
    outcome, _ = fit(renderer, reference)
    assert outcome.result.status is Status.CONVERGED
    assert np.isfinite(renderer.table.pack(outcome.result.recovered)).all()
    assert outcome.result.errors["mse"][1] <= outcome.result.errors["mse"][0]


def unreachable(reference, mask):
    """A picture whose light is brighter than the scene's, with a response that no material has."""
    return np.where(mask[..., None], 1.3 * reference * (1.0 + 0.3 * reference / (1.0 + reference)), reference)


def test_each_preset_has_no_more_flip_than_the_one_before(tmp_path):
    renderer = load(tmp_path, POINT, size=32)
    reference = renderer.image(renderer.table.pack(TRUTHS[1]), seed=5, spp=256)
    reference = unreachable(reference, renderer.target_mask()).astype(np.float32)
    found, stages, events = {}, {}, []
    for preset in ("fast", "balanced", "best"):
        outcome, events = fit(renderer, reference, preset=preset)
        found[preset] = outcome.result.errors["hdr_flip"][1]
        stages[preset] = [e.stage for e in events if isinstance(e, StageEnd)]
    assert stages["balanced"] == ["scan", "start", "refine", "itp"]
    assert stages["best"] == [*stages["balanced"], "flip"]
    # chosen by the FLIP of blurred pictures of the target, compared by that of whole ones: 1 % apart
    assert found["balanced"] <= 1.01 * found["fast"]
    assert found["best"] <= 1.01 * found["balanced"]
    fractions = [e.fraction for e in events if isinstance(e, Progress)]
    assert all(0.0 < f < 1.0 for f in fractions)
    assert fractions == sorted(fractions)


def test_a_narrow_highlight_is_found_where_the_metallic_is_given(tmp_path):
    """No start is opposite then; from the scene's 0.9 and from this seed's random start no slope leads to it."""
    given = '<float name="metallic" value="0.5"/><float name="roughness" value="0.9"/>'
    truth = {"base_color": (0.6, 0.3, 0.1), "roughness": 0.08, "specular": 0.6, "clearcoat": 0.4}
    renderer = load(tmp_path, POINT, tuple(truth), size=32, material=given)
    reference = renderer.image(renderer.table.pack(truth), seed=9, spp=16)
    outcome, _ = fit(renderer, reference, seed=1)
    assert outcome.result.recovered["roughness"] < 0.1
    assert outcome.result.errors["flip"][1] < 0.05  # 0.16 without the nodes of the scan


def test_perceptual_stages_do_not_fit_noise(tmp_path):
    renderer = load(tmp_path, SKY + POINT, size=32)
    reference = renderer.image(renderer.table.pack(TRUTHS[0]), seed=5, spp=4)
    outcome, events = fit(renderer, reference, preset="best")
    assert [e.stage for e in events if isinstance(e, StageEnd)] == ["scan", "start", "refine"]
    assert any("has reached the noise of the picture" in note for note in outcome.result.notes)


def test_perceptual_stages_do_not_begin_where_nothing_is_left_to_see(tmp_path, monkeypatch):
    renderer = load(tmp_path, POINT, size=32)
    from mfo_backend.fit.recorded.recording import Recording

    reference = renderer.image(renderer.table.pack(TRUTHS[1]), seed=5, spp=1024)
    asked, misfit = [], Recording.misfit
    monkeypatch.setattr(Recording, "misfit", lambda self, x: asked.append(x) or misfit(self, x))
    outcome, events = fit(renderer, reference, preset="best")
    assert [e.stage for e in events if isinstance(e, StageEnd)] == ["scan", "start", "refine"]
    assert any("nobody sees" in note for note in outcome.result.notes)
    assert not asked  # how noisy the picture is does not matter then
    # a picture that no values give has more to show
    outcome, _ = fit(renderer, reference * np.linspace(0.8, 1.2, 32, dtype=np.float32)[:, None, None], preset="best")
    assert not any("nobody sees" in note for note in outcome.result.notes)


def test_a_firefly_and_noise_do_not_switch_lobes_on(tmp_path):
    names = [*REDUCED, "sheen", "clearcoat", "anisotropic"]
    renderer = load(tmp_path, SKY + POINT, names, size=48)
    x = renderer.table.pack({**TRUTHS[0], "sheen": 0.0, "clearcoat": 0.0, "anisotropic": 0.0})
    reference = renderer.image(x, seed=5, spp=4)
    reference[20, 24] += 300.0 * reference[20, 24]
    outcome, _ = fit(renderer, reference)
    found = outcome.result.recovered
    assert [found[name] for name in names[4:]] == pytest.approx([0.001, 0.001, 0.001], abs=2e-3)
    clean, result = (renderer.image(v, seed=9, spp=256) for v in (x, renderer.table.pack(found)))
    assert relative_rms(result, clean, renderer.target_mask()) < 0.05


def test_previews_come_at_most_once_a_second_and_show_the_fit(tmp_path):
    from mfo_backend.fit.result.course import Course

    renderer = load(tmp_path, POINT, size=16)
    events = []
    course = Course(renderer, ("scan", "start", "refine"), events.append, lambda: False, -1e9)
    with course.stage("start") as stage:
        stage.picture = lambda x: np.full((2, 2, 3), x[0], np.float32)
        for step in range(50):
            course.note(stage, np.array([float(step)]), 1.0 / (step + 1))
    previews = [e for e in events if isinstance(e, Preview)]
    assert len(previews) == 1  # all 50 within a second
    assert previews[0].image[0, 0, 0] == 0.0


@pytest.mark.parametrize("size", [32, 256])  # recorded whole, and in part of the pixels
def test_the_first_picture_comes_with_the_end_of_the_search(tmp_path, size):
    renderer = load(tmp_path, POINT, size=size)
    reference = renderer.image(renderer.table.pack(TRUTHS[0]), seed=5, spp=64)
    _, events = fit(renderer, reference)
    ends = {e.stage: at for at, e in enumerate(events) if isinstance(e, StageEnd)}
    shown = [e.image for e in events[ends["scan"] : ends["start"]] if isinstance(e, Preview)]
    mask = renderer.target_mask()
    assert (
        relative_rms(shown[-1], reference, mask)
        < 0.1
        < relative_rms(renderer.image(renderer.start, seed=1, spp=16), reference, mask)
    )
    np.testing.assert_array_equal(shown[-1][0, 0], reference[0, 0])  # background, of which a look knows nothing


def test_a_start_without_finite_numbers_is_left_out(tmp_path, monkeypatch):
    from mfo_backend.render.paths.recorded_jacobian import RecordedJacobian

    renderer = load(tmp_path, POINT, size=24)
    reference = renderer.image(renderer.table.pack(TRUTHS[0]), seed=5, spp=256)
    exact = RecordedJacobian.__call__

    def broken(self, vector, *others, **growth):
        table = exact(self, vector, *others, **growth)
        return np.full_like(table, np.nan) if vector[4] > 0.9 or vector[3] > 0.8 else table

    monkeypatch.setattr(RecordedJacobian, "__call__", broken)
    outcome, _ = fit(renderer, reference)
    assert outcome.result.recovered["roughness"] == pytest.approx(TRUTHS[0]["roughness"], abs=0.01)


def test_no_finite_number_anywhere_falls_back_to_the_paper_and_says_so(tmp_path, monkeypatch):
    from mfo_backend.render.paths.recorded_jacobian import RecordedJacobian

    renderer = load(tmp_path, POINT, ["roughness"], size=16)
    reference = renderer.image(renderer.table.pack({"roughness": 0.3}), seed=5, spp=64)
    exact = RecordedJacobian.__call__
    monkeypatch.setattr(RecordedJacobian, "__call__", lambda *a: np.full_like(exact(*a), np.nan))
    outcome, _ = fit(renderer, reference, max_iterations=5)  # of the paper's loop
    (note,) = outcome.result.notes
    assert "No start of the fit gives finite numbers" in note
    assert "'paper' was used" in note
    assert np.isfinite(outcome.result.recovered["roughness"])


def test_a_clipped_display_picture_is_fitted_below_its_white(tmp_path):
    renderer = load(tmp_path, POINT, size=32)
    x = renderer.table.pack(TRUTHS[2])
    linear = renderer.image(x, seed=5, spp=256)
    mask = renderer.target_mask()
    view = DisplayView(exposure_ev=DisplayView.for_scene(linear, mask).exposure_ev + 2.0)
    shown = view.display(linear)
    assert 0.002 < (shown[mask] > 0.999).mean() < 0.5
    outcome, _ = fit(renderer, shown, encoding=Encoding.SRGB, display=view)
    result = renderer.image(renderer.table.pack(outcome.result.recovered), seed=5, spp=256)
    assert np.abs(view.display(result) - shown)[mask].mean() < 0.004  # one step of an 8-bit picture


def test_under_a_view_a_coat_does_not_stand_in_for_the_highlight_of_the_base(tmp_path):
    """Without the noise of what the view shows the fit ended with a coat of 1 and a roughness of 1."""
    names = ("base_color", "roughness", "specular_ior_level", "coat_weight", "coat_roughness")
    truth = dict(zip(names, ((0.3, 0.2, 0.1), 0.35, 0.5, 0.0, 0.1), strict=True))
    renderer = load_renderer(
        write_scene(tmp_path, AREA + SKY, size=40),
        "target",
        model="blender_principled",
        parameters=names,
        materials={"target_bsdf": {"name": "Paint", "distribution": "MULTI_GGX", "sockets": {}}},
    )
    start = {"base_color": (0.5, 0.5, 0.5), "roughness": 0.2, "specular_ior_level": 0.3}
    renderer.start = renderer.table.pack(truth | start)
    view = baked(filmic)
    linear = renderer.image(renderer.table.pack(truth), seed=5, spp=64)
    shown = np.round(view.display(linear) * 255.0) / np.float32(255.0)
    outcome, _ = fit(renderer, shown.astype(np.float32), encoding=Encoding.SRGB, display=view)
    found = outcome.result.recovered
    assert found["coat_weight"] == 0.0
    assert found["roughness"] == pytest.approx(truth["roughness"], abs=0.06)
    np.testing.assert_allclose(found["base_color"], truth["base_color"], atol=0.02)


@pytest.mark.parametrize(
    ("richer_error", "chosen"), [(0.100, 0), (0.099, 0), (0.097, 1)], ids=["as good", "unseen", "seen"]
)
def test_a_richer_material_is_taken_where_an_eye_sees_that_it_is_better(richer_error, chosen):
    from types import SimpleNamespace

    from mfo_backend.fit.recorded.fit import RecordedRoute
    from mfo_backend.fit.result.outcome import Choice

    judge = SimpleNamespace(value=lambda image: image)
    task = SimpleNamespace(linear=True, light=None, judge=lambda background, *, blurred: judge)
    choose = RecordedRoute._unless_seen(SimpleNamespace(_task=task), 1, lambda images: Choice.of(images))
    assert choose([0.3, 0.1, richer_error]) == Choice(chosen, True)
    # the end of a later stage is better still
    assert choose([0.3, 0.1, richer_error, 0.05]) == Choice(2, True)
    assert choose([0.05, 0.1, richer_error]) == Choice(chosen, False)


def test_a_value_the_picture_does_not_show_stays_the_users(tmp_path):
    # a black dielectric: sheen tint has nothing to colour without sheen
    names = [*REDUCED, "sheen_tint", "sheen"]
    material = '<float name="sheen" value="0.001"/><float name="sheen_tint" value="0.7"/>'
    renderer = load(tmp_path, POINT, names, size=32, material=material)
    truth = renderer.table.pack({**TRUTHS[0], "metallic": 0.999, "sheen": 0.001, "sheen_tint": 0.2})
    outcome, _ = fit(renderer, renderer.image(truth, seed=5, spp=256))
    assert outcome.result.certainty["sheen_tint"].level is Level.NOT_VISIBLE
    assert outcome.result.recovered["sheen_tint"] == pytest.approx(0.7, abs=1e-6)
    assert "sheen_tint" in outcome.result.notes[-1]


def test_the_start_is_kept_where_nothing_is_better(tmp_path):
    renderer = load(tmp_path, POINT, size=24)
    reference = renderer.image(renderer.start, seed=5, spp=256)
    outcome, _ = fit(renderer, reference)
    assert outcome.result.errors["mse"][1] <= outcome.result.errors["mse"][0] * 1.01


def test_cancel_returns_the_best_so_far(tmp_path):
    renderer = load(tmp_path, POINT, size=24)
    reference = renderer.image(renderer.table.pack(TRUTHS[0]), seed=5, spp=64)
    calls = iter(range(10**6))
    outcome, _ = fit(renderer, reference, stop=lambda: next(calls) > 20)
    assert outcome.result.status is Status.CANCELLED
    assert np.isfinite(renderer.table.pack(outcome.result.recovered)).all()


def test_a_reference_with_holes_is_refused(tmp_path):
    renderer = load(tmp_path, POINT, size=24)
    reference = renderer.image(renderer.start, seed=5, spp=4)
    reference[12, 12] = np.nan
    with pytest.raises(BadInputError, match="1 pixels with NaN"):
        fit(renderer, reference)


def test_a_mirror_like_metal_is_not_taken_for_a_black_plastic(tmp_path):
    names = [*REDUCED, "spec_tint", "anisotropic", "sheen", "sheen_tint", "clearcoat", "clearcoat_gloss"]
    renderer = load(tmp_path, POINT, names, size=80)
    truth = {
        "base_color": (0.16, 0.59, 0.82),
        "roughness": 0.05,
        "metallic": 0.999,
        "anisotropic": 0.54,
        "spec_tint": 0.9,
        "sheen": 0.99,
        "sheen_tint": 0.24,
        "clearcoat": 0.11,
        "clearcoat_gloss": 0.35,
    }
    x = renderer.table.pack(truth)
    from mfo_backend.fit.recorded.where_to_look import detail_grid
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    # a recording as reference: path tracing finds a highlight narrower than a pixel by luck only
    scene, mask = RecordedScene(renderer, 3000), renderer.target_mask()
    reference = np.zeros((80, 80, 3), np.float32)
    grid: int | np.ndarray = 4
    for _ in range(2):
        paths = scene.record(x, grid=grid, seed=3, near=False)
        groups = paths.pixel_groups()
        reference.reshape(-1, 3)[groups.pixels] = scene.evaluator(paths, groups)(x)[:, :, 0]
        grid = detail_grid(reference, mask) + 2
    outcome, _ = fit(renderer, reference)
    recovered = outcome.result.recovered
    assert recovered["metallic"] == pytest.approx(0.999, abs=0.02)
    assert recovered["roughness"] == pytest.approx(0.05, abs=0.005)
    np.testing.assert_allclose(recovered["base_color"], truth["base_color"], atol=0.03)


def test_what_cannot_be_recorded_is_fitted_by_the_paper_and_says_so(tmp_path):
    checker = (
        '<texture type="checkerboard" name="clearcoat"><float name="color0" value="0.2"/>'
        '<float name="color1" value="0.9"/></texture>'
    )
    renderer = load(tmp_path, POINT, ["roughness"], size=16, material=checker)
    reference = renderer.image(renderer.table.pack({"roughness": 0.3}), seed=5, spp=64)
    outcome, events = fit(renderer, reference, preset="balanced")
    (note,) = outcome.result.notes
    assert "'clearcoat' is a texture" in note
    assert "'paper' was used instead of 'balanced'" in note
    assert [stage.name for stage in outcome.result.stages] == ["mse-hdr", "flip-hdr"]
    assert sum(isinstance(e, Started) for e in events) == 1
    assert outcome.result.errors["mse"][1] < outcome.result.errors["mse"][0]


@pytest.mark.parametrize("losses", [None, ("mse", "itp")])
def test_a_large_target_is_fitted_on_some_of_its_pixels(tmp_path, monkeypatch, losses):
    from mfo_backend.fit.plans import RecordedPlan
    from mfo_backend.fit.recorded import fit as recorded_fit
    from mfo_backend.fit.recorded import where_to_look as choose_groups
    from mfo_backend.render.paths import recorded_scene

    renderer = load(tmp_path, POINT, size=64)
    reference = renderer.image(renderer.table.pack(TRUTHS[1]), seed=5, spp=1024)
    recorded = []
    original = recorded_scene.record_paths
    monkeypatch.setattr(
        recorded_scene, "record_paths", lambda *a, **b: recorded.append(original(*a, **b)) or recorded[-1]
    )
    # as for a picture of 256 x 256 pixels: fine recordings are too much, and so are the first one's pixels
    monkeypatch.setattr(choose_groups, "MOST_FINE_RAYS", 0)
    monkeypatch.setattr(recorded_fit.RecordedPlan, "of", staticmethod(lambda preset: RecordedPlan(refine_lanes=1500)))
    outcome, _ = fit(renderer, reference, preset="balanced", losses=losses)
    found = renderer.table.pack(outcome.result.recovered)
    np.testing.assert_allclose(found[:4], renderer.table.pack(TRUTHS[1])[:4], atol=0.01)
    for stage in outcome.result.stages[2:]:  # a stage after another recording still has the residuals of its own pixels
        np.testing.assert_allclose(renderer.table.pack(stage.values)[:4], found[:4], atol=0.01, err_msg=stage.name)
    covered = renderer.target_mask().sum()
    assert len(recorded[0].pixel) < 0.5 * covered
    # all pixels are recorded where a stage looks at their picture
    assert [len(paths.pixel) > 0.9 * covered for paths in recorded[1:]] == [True] * (losses is not None)
    assert not any("recorded" in note for note in outcome.result.notes)
