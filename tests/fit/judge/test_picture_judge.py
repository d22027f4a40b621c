# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from mfo_backend.fit.judge.minimise_flip import minimise_flip
from mfo_backend.fit.judge.picture_judge import PictureJudge, _MaskedBlur
from mfo_backend.fit.plans import NEAR_EVALUATIONS
from mfo_backend.fit.settings import FitSettings
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.flip import block_means
from mfo_backend.types.image import Encoding, Image

SIZE = 24
RNG = np.random.default_rng(1)
Y, X = np.mgrid[0:SIZE, 0:SIZE] / SIZE
MASK = (X - 0.5) ** 2 + (Y - 0.5) ** 2 < 0.2
BASIS = np.stack([np.ones_like(X), X, np.exp(-40 * ((X - 0.4) ** 2 + (Y - 0.4) ** 2))], -1)[..., None, :] * [
    [1.0],
    [0.7],
    [0.5],
]
TRUTH = np.array([0.3, 0.4, 0.6])


def picture(x):
    image = np.where(MASK[..., None], BASIS @ x, 0.1).astype(np.float32)
    return image, lambda gradient: np.einsum("yxc,yxck->k", gradient * MASK[..., None], BASIS)


def judge(reference, *, blurred=False, ldr=False):
    return PictureJudge(
        "flip-ldr" if ldr else "flip-hdr",
        Image(reference.astype(np.float32), Encoding.LINEAR),
        picture(TRUTH)[0],
        MASK,
        FitSettings(),
        DisplayView(),
        blurred=blurred,
    )


@pytest.mark.parametrize("blurred", [False, True])
def test_gradient_is_that_of_the_value(blurred):
    measure = judge(picture(TRUTH)[0], blurred=blurred)
    # far from the truth the error map is smooth but for changes of its largest part
    x, step = np.array([0.6, 0.9, 0.2]), 5e-3
    image, pullback = picture(x)
    gradient = pullback(measure.value_and_gradient(image)[1])
    slopes = []
    for unit in np.eye(3):
        up, down = (measure.value(picture(x + s * step * unit)[0]) for s in (1, -1))
        slopes.append((up - down) / (2 * step))
    assert gradient @ slopes / (np.linalg.norm(gradient) * np.linalg.norm(slopes)) > 0.99
    assert np.linalg.norm(gradient) == pytest.approx(np.linalg.norm(slopes), rel=0.1)


def smaller_judge(monkeypatch, encoding=Encoding.LINEAR, *, blurred=False, most=40):
    """A judge that compares at a third of the size."""
    monkeypatch.setattr(block_means, "MOST_COUNTED", most)
    shown = DisplayView().display(picture(TRUTH)[0])
    reference = picture(TRUTH)[0] if encoding is Encoding.LINEAR else shown
    name = "flip-hdr" if encoding is Encoding.LINEAR else "flip-ldr"
    background, view = picture(TRUTH)[0], DisplayView()
    return PictureJudge(name, Image(reference, encoding), background, MASK, FitSettings(), view, blurred=blurred)


@pytest.mark.parametrize(("encoding", "blurred"), [*product(Encoding, [False]), (Encoding.LINEAR, True)])
def test_gradient_at_a_fraction_of_the_size_is_that_of_the_value(monkeypatch, encoding, blurred):
    measure = smaller_judge(monkeypatch, encoding, blurred=blurred)
    x, step = np.array([0.5, 0.8, 0.3]), 5e-3
    image, pullback = picture(x)
    gradient = pullback(measure.value_and_gradient(image)[1])
    slopes = [
        (measure.value(picture(x + step * unit)[0]) - measure.value(picture(x - step * unit)[0])) / (2 * step)
        for unit in np.eye(3)
    ]
    assert gradient @ slopes / (np.linalg.norm(gradient) * np.linalg.norm(slopes)) > 0.99
    assert np.linalg.norm(gradient) == pytest.approx(np.linalg.norm(slopes), rel=0.1)


@pytest.mark.parametrize("encoding", Encoding)
def test_noise_counts_less_at_a_fraction_of_the_size(monkeypatch, encoding):
    noisy = picture(TRUTH)[0] * (1 + 0.1 * RNG.normal(size=(SIZE, SIZE, 3))).astype(np.float32)
    whole = smaller_judge(monkeypatch, encoding, most=10**6)
    smaller = smaller_judge(monkeypatch, encoding)
    assert smaller.value(noisy) < 0.6 * whole.value(noisy)
    other = picture(1.2 * TRUTH)[0]
    assert smaller.value(other) == pytest.approx(whole.value(other), rel=0.15)


@pytest.mark.parametrize("encoding", Encoding)
def test_only_the_target_counts_at_a_fraction_of_the_size(monkeypatch, encoding):
    measure = smaller_judge(monkeypatch, encoding)
    elsewhere = np.where(MASK[..., None], picture(TRUTH)[0], RNG.random((SIZE, SIZE, 3))).astype(np.float32)
    assert measure.value(elsewhere) == pytest.approx(0.0, abs=1e-4)


def test_blur_has_its_own_adjoint():
    blur = _MaskedBlur(MASK)
    a, b = RNG.normal(size=(2, SIZE, SIZE, 3)).astype(np.float32)
    assert np.vdot(blur(a), b) == pytest.approx(np.vdot(a, blur.pullback(b)), rel=1e-4)
    flat = np.full((SIZE, SIZE, 3), 0.7, np.float32)
    np.testing.assert_allclose(blur(flat), flat, rtol=1e-5)
    outside = ~MASK
    np.testing.assert_array_equal(blur(a)[outside], a[outside])


def test_blurred_judge_prefers_the_truth_where_plain_flip_prefers_less_contrast():
    rng = np.random.default_rng(5)
    scale = np.concatenate([np.linspace(0.7, 1.0, 7), [1.03, 1.06]])
    best = []
    for blurred in (False, True):
        reference = picture(TRUTH)[0] * rng.gamma(0.7, 1 / 0.7, MASK.shape)[..., None]  # skewed, mean 1, as few samples
        measure = judge(reference, blurred=blurred)
        best.append(scale[np.argmin([measure.value(picture(s * TRUTH)[0]) for s in scale])])
    # the mean of a skewed noise lies above its median, which plain FLIP is drawn to
    assert best[0] < 0.85
    assert abs(best[1] - 1.0) < abs(best[0] - 1.0)


def test_flip_is_lowered_inside_the_box_and_never_raised():
    reference = picture(TRUTH)[0] * np.float32(1.02)
    measure = judge(reference)
    told = []
    start, lower, upper = np.array([0.4, 0.2, 0.3]), np.zeros(3), np.array([1.0, 1.0, 0.5])
    options = {"on_value": lambda x, value: told.append(value), "should_stop": lambda: False}
    x, value = minimise_flip(measure, picture, start, lower, upper, **options)
    assert told[0] == pytest.approx(measure.value(picture(start)[0]))
    assert value == min(told) < 0.5 * told[0]
    assert np.all((x >= lower) & (x <= upper))


def test_flip_is_asked_a_limited_number_of_times():
    """Of the valley of H. Rosenbrock (1960), which takes far more steps."""
    told = []

    class Valley:
        def value_and_gradient(self, image):
            x, y = image
            slope = np.array([-400.0 * x * (y - x**2) - 2.0 * (1.0 - x), 200.0 * (y - x**2)])
            return 100.0 * (y - x**2) ** 2 + (1.0 - x) ** 2, slope

    start, box = np.array([-1.2, 1.0]), (np.full(2, -2.0), np.full(2, 2.0))
    options = {"on_value": lambda x, value: told.append((tuple(x), value)), "should_stop": lambda: False}
    x, value = minimise_flip(Valley(), lambda x: (x, lambda gradient: gradient), start, *box, **options)
    assert len(told) == NEAR_EVALUATIONS
    assert (tuple(x), value) == min(told, key=lambda seen: seen[1])


def test_flip_stage_survives_numbers_that_are_not_finite():
    measure = judge(picture(TRUTH)[0])
    calls = iter(range(100))

    def broken(x):
        image, pullback = picture(x)
        return image, pullback if next(calls) < 2 else lambda gradient: np.full(3, np.nan)

    start = np.array([0.4, 0.2, 0.3])
    box = np.zeros(3), np.ones(3)
    x, value = minimise_flip(measure, broken, start, *box, on_value=lambda x, value: None, should_stop=lambda: False)
    assert np.isfinite(x).all()
    assert value <= measure.value(picture(start)[0])
