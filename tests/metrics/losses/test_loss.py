# SPDX-License-Identifier: Apache-2.0
"""The losses by name: values by hand, gradients by finite differences, and what they refuse."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.flip.flip_error import flip_error, hdr_flip_error
from mfo_backend.metrics.losses.flip_loss import FlipLoss
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.metrics.losses.loss_names import LOSS_NAMES
from mfo_backend.metrics.losses.squared_loss import SquaredLoss
from mfo_backend.metrics.responses.response import Displayed
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image

VIEWS = [DisplayView(), DisplayView(1.5), DisplayView(-0.5, 1.8)]


def scene(seed, shape=(18, 22)):
    """Radiance over two decades on a black background, as a render of an object."""
    rng = np.random.default_rng(seed)
    pixels = np.zeros((*shape, 3), np.float32)
    pixels[3:-3, 3:-3] = 0.02 * 10 ** rng.uniform(0, 2, (shape[0] - 6, shape[1] - 6, 3))
    return pixels


@pytest.mark.parametrize("name", LOSS_NAMES)
def test_value_is_zero_at_the_reference_and_equals_the_gradients_value(name):
    reference, image = scene(0), scene(1)
    loss = make_loss(name, Image(reference, Encoding.LINEAR))
    assert loss.name == name
    assert loss.value(reference) == 0
    value, gradient = loss.value_and_gradient(image)
    assert value == pytest.approx(loss.value(image), rel=1e-6)
    assert gradient.shape == image.shape
    assert gradient.dtype == np.float32
    assert np.isfinite(gradient).all()
    assert np.abs(loss.value_and_gradient(reference)[1]).max() == 0


@pytest.mark.parametrize("name", LOSS_NAMES)
def test_a_small_step_against_the_gradient_lowers_the_loss_as_predicted(name):
    """Float32 through the public path; the exact checks of the gradients are in float64 elsewhere."""
    reference, image = scene(0), scene(1)
    loss = make_loss(name, Image(reference, Encoding.LINEAR))
    value, gradient = loss.value_and_gradient(image)
    object_pixels = image > 0
    direction = np.where(object_pixels, -gradient, 0)
    slope = float((gradient.astype(np.float64) * direction).sum())
    step = 3e-3 * value / -slope
    lower = loss.value((image + step * direction).astype(np.float32))
    # a step of 0.3 % of the loss: curvature and kinks stay below a tenth of it
    assert lower - value == pytest.approx(step * slope, rel=0.1)


def test_mse_by_hand():
    reference, image = np.zeros((2, 1, 3), np.float32), np.full((2, 1, 3), 0.5, np.float32)
    reference[0] = 1
    value, gradient = make_loss("mse-hdr", Image(reference, Encoding.LINEAR)).value_and_gradient(image)
    assert value == pytest.approx(0.25)
    np.testing.assert_allclose(gradient[:, 0, 0], [-1 / 6, 1 / 6], rtol=1e-6)


def test_ldr_mse_with_a_displayed_reference_uses_the_view():
    """sRGB of 0.5 is 0.735357 (IEC 61966-2-1); one stop more shows 1, and clipped pixels have no slope."""
    shown = np.full((4, 4, 3), 0.735357, np.float32)
    image = np.full((4, 4, 3), 0.25, np.float32)
    exact = make_loss("mse-ldr", Image(shown, Encoding.SRGB), display=DisplayView(1.0))
    assert exact.value(image) == pytest.approx(0, abs=1e-11)
    clipped = make_loss("mse-ldr", Image(shown, Encoding.SRGB), display=DisplayView(3.0))
    value, gradient = clipped.value_and_gradient(image)
    assert value == pytest.approx((1 - 0.735357) ** 2, rel=1e-4)
    assert np.abs(gradient).max() == 0


@pytest.mark.parametrize("view", VIEWS, ids=str)
@pytest.mark.parametrize("kind", ["mse", "flip"])
def test_ldr_gradients_equal_finite_differences_through_every_view(kind, view):
    rng = np.random.default_rng(5)
    target, image = rng.uniform(0.03, 0.6, (2, 14, 12, 3))
    image[:3] = 4.0  # clipped by every view
    loss = SquaredLoss("mse", target, Displayed(view)) if kind == "mse" else FlipLoss("flip", target, view)
    _, gradient = loss.value_and_gradient(image)
    directions = rng.standard_normal((6, *image.shape))
    step = 1e-7
    expected = [(loss.value(image + step * d) - loss.value(image - step * d)) / (2 * step) for d in directions]
    # rounding of the quotient is 1e-16 / 1e-7 of values near 0.1
    np.testing.assert_allclose([(gradient * d).sum() for d in directions], expected, rtol=1e-5, atol=1e-8)


def test_the_scene_view_keeps_99_percent_of_the_lit_pixels_below_the_clip():
    reference = scene(3, (60, 60))
    view = DisplayView.for_scene(reference)
    lit = reference[reference.max(axis=-1) > 0] @ [0.2126, 0.7152, 0.0722]
    assert np.mean(lit * 2**view.exposure_ev > 1) == pytest.approx(0.01, abs=1 / lit.size)
    assert DisplayView.for_scene(4 * reference).exposure_ev == pytest.approx(view.exposure_ev - 2, abs=1e-5)


def test_the_mask_moves_exposures_only():
    reference, image = scene(0), scene(1)
    mask = np.zeros(reference.shape[:2], bool)
    mask[4:8, 4:8] = True
    for name in ("flip-hdr", "mse-ldr"):
        plain = make_loss(name, Image(reference, Encoding.LINEAR))
        masked = make_loss(name, Image(reference, Encoding.LINEAR), mask=mask)
        assert masked.value(reference) == 0
        assert masked.value(image) != plain.value(image)
    assert make_loss("mse-hdr", Image(reference, Encoding.LINEAR), mask=mask).value(image) == pytest.approx(
        np.mean((reference - image) ** 2.0)
    )


def test_flip_error_shows_linear_pictures_through_the_view():
    linear = scene(0)
    shown = Image(DisplayView(0.5).display(linear), Encoding.SRGB)
    assert flip_error(shown, Image(linear, Encoding.LINEAR), display=DisplayView(0.5)).mean < 1e-6
    other = Image(scene(1), Encoding.LINEAR)
    error = flip_error(Image(linear, Encoding.LINEAR), other)
    assert error.map.shape == linear.shape[:2]
    assert error.mean == pytest.approx(
        make_loss("flip-ldr", Image(linear, Encoding.LINEAR)).value(other.pixels), abs=1e-6
    )
    assert 0 < hdr_flip_error(Image(linear, Encoding.LINEAR), other).mean < 1
    with pytest.raises(BadInputError, match="needs two scene-linear pictures"):
        hdr_flip_error(shown, other)


def broken(value):
    pixels = scene(1)
    pixels[5, 5, 1] = value
    return pixels


@pytest.mark.parametrize(
    ("image", "sentence"),
    [
        (broken(np.nan), "The rendered image has 1 pixels with NaN and 0 with infinite values of 396"),
        (broken(-np.inf), "The rendered image has 0 pixels with NaN and 1 with infinite"),
        (scene(1, (18, 20)), "The rendered image is 20x18 but the reference is 22x18"),
    ],
)
@pytest.mark.parametrize("name", LOSS_NAMES)
def test_images_a_loss_is_not_defined_for_are_refused(name, image, sentence):
    loss = make_loss(name, Image(scene(0), Encoding.LINEAR))
    with pytest.raises(BadInputError, match=sentence):
        loss.value(image)
    with pytest.raises(BadInputError, match=sentence):
        loss.value_and_gradient(image)


@pytest.mark.parametrize(
    ("name", "encoding", "pixels", "mask", "sentence"),
    [
        ("ssim", Encoding.LINEAR, scene(0), None, "Unknown loss 'ssim': choose one of mse-ldr"),
        ("mse-hdr", Encoding.SRGB, scene(0), None, "Loss mse-hdr needs a scene-linear reference .* use mse-ldr"),
        ("flip-hdr", Encoding.LINEAR, broken(np.nan), None, "The reference has 1 pixels with NaN"),
        ("flip-hdr", Encoding.LINEAR, scene(0), np.ones((3, 3), bool), r"The mask has shape \(3, 3\)"),
        ("flip-hdr", Encoding.LINEAR, scene(0), np.zeros((18, 22), bool), "The mask is empty"),
        ("mse-ldr", Encoding.LINEAR, scene(0), np.zeros((18, 22), bool), "The mask is empty"),
    ],
)
def test_references_a_loss_is_not_defined_for_are_refused(name, encoding, pixels, mask, sentence):
    with pytest.raises(BadInputError, match=sentence):
        make_loss(name, Image(pixels, encoding), mask=mask)


@pytest.mark.parametrize(("ev", "gamma"), [(np.nan, 1), (99, 1), (0, 0), (0, -1), (0, np.inf)])
def test_views_without_a_meaning_are_refused(ev, gamma):
    with pytest.raises(BadInputError, match=r"View (exposure|gamma) is"):
        DisplayView(ev, gamma)


def test_a_black_reference_still_gives_a_loss():
    """A fit refuses it earlier (`check_reference`); the losses themselves stay defined."""
    black = Image(np.zeros((6, 6, 3), np.float32), Encoding.LINEAR)
    for name in LOSS_NAMES:
        value, gradient = make_loss(name, black).value_and_gradient(np.full((6, 6, 3), 0.5, np.float32))
        assert value > 0
        assert np.isfinite(gradient).all()


@pytest.mark.parametrize("name", LOSS_NAMES)
@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (5, 1)])
def test_one_pixel_and_one_line_have_a_loss(name, shape):
    rng = np.random.default_rng(0)
    reference, image = rng.uniform(0.1, 2, (2, *shape, 3)).astype(np.float32)
    loss = make_loss(name, Image(reference, Encoding.LINEAR))
    value, gradient = loss.value_and_gradient(image)
    assert 0 < value < np.inf
    assert loss.value(reference) == 0
    assert np.isfinite(gradient).all()


@pytest.mark.parametrize("name", LOSS_NAMES)
def test_negative_pixels_of_the_reference_count_as_zero_and_those_of_an_image_keep_the_loss_finite(name):
    reference, image = scene(0), scene(1)
    negative = np.where(reference > 0, reference, np.float32(-0.5))
    expected = make_loss(name, Image(reference, Encoding.LINEAR)).value(image)
    assert make_loss(name, Image(negative, Encoding.LINEAR)).value(image) == pytest.approx(expected, rel=1e-6)
    loss = make_loss(name, Image(reference, Encoding.LINEAR))
    value, gradient = loss.value_and_gradient(np.where(image > 0, image, np.float32(-0.5)))
    assert np.isfinite(value)
    assert np.isfinite(gradient).all()
    if name not in ("mse-hdr", "relative-hdr"):  # linear, so that the slope leads back from below zero
        assert value == pytest.approx(loss.value(image), rel=1e-6)
