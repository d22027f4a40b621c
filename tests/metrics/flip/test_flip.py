# SPDX-License-Identifier: Apache-2.0
"""FLIP and HDR-FLIP against the authors' package, golden values and finite differences."""

from __future__ import annotations

from types import SimpleNamespace

import flip_evaluator as oracle
import numpy as np
import pytest

from mfo_backend.metrics.display.colour import linear_from_srgb
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.flip.exposure_range import ExposureRange, lit_exposures, official_exposures
from mfo_backend.metrics.flip.flip_difference import FlipDifference
from mfo_backend.metrics.flip.flip_error import flip_error
from mfo_backend.metrics.flip.flip_features import Perceived
from mfo_backend.metrics.flip.flip_reference import FlipReference
from mfo_backend.metrics.flip.hdr_flip import HdrFlip, hdr_flip_map
from mfo_backend.metrics.flip.ldr_flip import flip_map, planes_of
from mfo_backend.metrics.flip.tone_curve import ToneCurve
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image

# Generated with flip-evaluator 1.7, printed to six digits: mean, min, max, [0, 0], [24, 35], [47, 63]
LDR_GOLDEN = {
    ("srgb", None): (0.356002, 0.079243, 0.986772, 0.280248, 0.980162, 0.234204),
    ("srgb", 30.0): (0.362295, 0.042669, 0.985298, 0.311625, 0.983119, 0.214287),
    ("linear", None): (0.240005, 0.110879, 0.980932, 0.146164, 0.977500, 0.179887),
}
HDR_GOLDEN = {
    "aces": (-1.975201, 1.909503, 4, (0.451589, 0.112274, 0.988785, 0.262437, 0.984984, 0.333753)),
    "hable": (-1.413373, 2.471331, 4, (0.417374, 0.129352, 0.989075, 0.329770, 0.984919, 0.310201)),
    "reinhard": (-0.555997, 3.328706, 4, (0.377867, 0.137949, 0.990604, 0.286113, 0.984996, 0.332374)),
}
# Both sides compute in float32
PIXEL_TOLERANCE = 1e-5
MEAN_TOLERANCE = 1e-6
ROUNDED = 5e-7  # half a unit of the goldens' sixth digit
# The detectors answer to a flat area with rounding, some 1e-8 of luminance, and FLIP takes its square root: there the
# package is up to 4e-5 from FLIP in exact arithmetic
FLAT_TOLERANCE = 4e-5


def ldr_map(reference, test, encoding, ppd):
    options = {} if ppd is None else {"pixels_per_degree": ppd}
    if encoding == "srgb":
        return flip_map(reference, test, **options)
    return FlipReference(planes_of(reference), **options).compare(planes_of(test)).error


def assert_golden(error, golden):
    at = [error[0, 0], error[24, 35], error[47, 63]]
    assert error.mean(dtype=np.float64) == pytest.approx(golden[0], abs=MEAN_TOLERANCE + ROUNDED)
    np.testing.assert_allclose([error.min(), error.max(), *at], golden[1:], rtol=0, atol=PIXEL_TOLERANCE)


@pytest.mark.parametrize(("encoding", "ppd"), LDR_GOLDEN)
def test_ldr_flip_equals_the_golden_values_and_the_package(golden_pair, encoding, ppd):
    reference, test = golden_pair()
    error = ldr_map(reference, test, encoding, ppd)
    assert_golden(error, LDR_GOLDEN[encoding, ppd])
    parameters = {} if ppd is None else {"ppd": ppd}
    expected, mean, _ = oracle.evaluate(
        reference, test, "LDR", inputsRGB=encoding == "srgb", applyMagma=False, parameters=parameters
    )
    np.testing.assert_allclose(error, expected[..., 0], rtol=0, atol=PIXEL_TOLERANCE)
    assert error.mean(dtype=np.float64) == pytest.approx(mean, abs=MEAN_TOLERANCE)


@pytest.mark.parametrize("curve", HDR_GOLDEN)
def test_hdr_flip_equals_the_golden_values_and_the_package(golden_hdr_pair, curve):
    reference, test = golden_hdr_pair()
    start, stop, count, golden = HDR_GOLDEN[curve]
    exposures = official_exposures(reference, ToneCurve(curve))
    assert (exposures.start, exposures.stop) == pytest.approx((start, stop), abs=1e-6)
    assert exposures.count == count
    error = hdr_flip_map(reference, test, curve=ToneCurve(curve))
    assert_golden(error, golden)
    expected, mean, _ = oracle.evaluate(reference, test, "HDR", applyMagma=False, parameters={"tonemapper": curve})
    np.testing.assert_allclose(error, expected[..., 0], rtol=0, atol=PIXEL_TOLERANCE)
    assert error.mean(dtype=np.float64) == pytest.approx(mean, abs=MEAN_TOLERANCE)


def test_hdr_flip_in_a_given_range(golden_hdr_pair):
    error = hdr_flip_map(*golden_hdr_pair(), exposures=ExposureRange(-2, 2, 3))
    assert_golden(error, (0.450604, 0.124941, 0.988438, 0.265069, 0.985378, 0.337344))


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (7, 5), (161, 200)])
def test_any_size_works_as_in_the_package(size):
    """161x200 takes the blocked filters, the others the dense ones, some shorter than the kernels."""
    rng = np.random.default_rng(3)
    reference, test = rng.random((2, *size, 3)).astype(np.float32)
    expected = oracle.evaluate(reference, test, "LDR", applyMagma=False)[0][..., 0]
    tolerance = FLAT_TOLERANCE if size == (1, 1) else PIXEL_TOLERANCE
    np.testing.assert_allclose(flip_map(reference, test), expected, rtol=0, atol=tolerance)


def test_a_black_background_in_the_official_range():
    """More than half black: the package floors the median at 2^-23 (23 exposures); the loss looks at lit pixels."""
    rng = np.random.default_rng(4)
    reference, test = np.zeros((2, 24, 24, 3), np.float32)
    reference[8:16, 8:16], test[8:16, 8:16] = rng.uniform(0.1, 3, (2, 8, 8, 3))
    expected, _, used = oracle.evaluate(reference, test, "HDR", applyMagma=False)
    exposures = official_exposures(reference)
    assert exposures.stop == pytest.approx(used["stopExposure"], abs=1e-5)  # 24 + log2 of 2.12, in float32 there
    assert exposures.count == used["numExposures"] > 20
    np.testing.assert_allclose(hdr_flip_map(reference, test), expected[..., 0], rtol=0, atol=FLAT_TOLERANCE)
    lit = lit_exposures(reference)
    assert lit.count <= 4
    assert lit == lit_exposures(reference, reference[..., 0] > 0)
    assert lit.start == pytest.approx(exposures.start)


def test_an_all_black_reference_is_defined():
    black = np.zeros((8, 8, 3), np.float32)
    assert official_exposures(black).count == 2
    assert hdr_flip_map(black, black).max() == 0
    assert hdr_flip_map(black, black + 1).min() > 0.5


@pytest.mark.parametrize("level", [0.0, 0.25, 1.0])
def test_equal_images_have_exactly_no_error_and_no_gradient(level):
    image = np.full((12, 16, 3), level, np.float32)
    image[3:6, 4:9] = (0.2, 0.9, 0.4)
    assert flip_map(image, image).max() == 0
    error, gradient = HdrFlip(image).map_and_pullback(image, 1.0)
    assert error.max() == 0
    assert np.abs(gradient).max() == 0


def directional(value, image, directions, step):
    return np.array([(value(image + step * d) - value(image - step * d)) / (2 * step) for d in directions])


@pytest.mark.parametrize("ppd", [67.0, 20.0])
def test_ldr_gradient_equals_finite_differences(golden_pair, ppd):
    """In float64. The map has kinks (HyAB, the larger of edge and point), so a step of 1e-7 rarely crosses one."""
    reference, test = (linear_from_srgb(image)[:20, 26:50] for image in golden_pair(np.float64))
    test = np.clip(test, 0.02, 0.98)
    weight = np.random.default_rng(0).random(test.shape[:2])
    flip = FlipReference(planes_of(reference), ppd)
    gradient = np.moveaxis(flip.compare(planes_of(test)).pullback(weight), 0, -1)
    directions = np.random.default_rng(1).standard_normal((12, *test.shape))
    expected = directional(lambda image: (weight * flip.compare(planes_of(image)).error).sum(), test, directions, 1e-7)
    # the quotient's rounding: 1e-16 * 100 / 1e-7 = 1e-7 of values near 10; kinks crossed cost more
    np.testing.assert_allclose([(gradient * d).sum() for d in directions], expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("curve", HDR_GOLDEN)
def test_hdr_gradient_equals_finite_differences(golden_hdr_pair, curve):
    reference, test = (image[:20, 26:50] for image in golden_hdr_pair(np.float64))
    flip = HdrFlip(reference, curve=ToneCurve(curve))
    weight = np.random.default_rng(0).random(test.shape[:2])
    _, gradient = flip.map_and_pullback(test, weight)
    directions = np.random.default_rng(1).standard_normal((8, *test.shape)) * test
    expected = directional(lambda image: (weight * flip.map(image)).sum(), test, directions, 1e-7)
    np.testing.assert_allclose([(gradient * d).sum() for d in directions], expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("scale", [1e-2, 1e-4, 1e-6, 1e-7])
def test_gradients_stay_finite_and_bounded_next_to_the_optimum(golden_hdr_pair, scale):
    reference, _ = golden_hdr_pair()
    reference[:20] = 0
    _, gradient = HdrFlip(reference).map_and_pullback(reference * np.float32(1 + scale), 1 / reference[..., 0].size)
    assert np.isfinite(gradient).all()
    assert np.abs(gradient[:8]).max() < 1e4  # black rows, seen through 24 stops


def test_extreme_pixels_are_clamped_as_documented():
    reference = np.full((10, 10, 3), 0.5, np.float32)
    negative, zero, huge = reference.copy(), reference.copy(), reference.copy()
    negative[4, 4], zero[4, 4], huge[4, 4] = -7, 0, 3e38
    np.testing.assert_array_equal(hdr_flip_map(reference, negative), hdr_flip_map(reference, zero))
    error, gradient = HdrFlip(reference).map_and_pullback(huge, 1.0)
    assert np.isfinite(error).all()
    assert np.isfinite(gradient).all()


@pytest.mark.parametrize(
    ("reference", "test", "sentence"),
    [
        (np.zeros((4, 4, 3)), np.zeros((4, 5, 3)), "The test image is 5x4 but the reference is 4x4"),
        (np.full((4, 4, 3), np.nan), np.zeros((4, 4, 3)), "The reference has 16 pixels with NaN and 0 with infinite"),
        (np.zeros((4, 4, 3)), np.full((4, 4, 3), np.inf), "The test image has 0 pixels with NaN and 16 with infinite"),
    ],
)
@pytest.mark.parametrize("metric", [flip_map, hdr_flip_map])
def test_pixels_without_a_meaning_are_refused(metric, reference, test, sentence):
    with pytest.raises(BadInputError, match=sentence):
        metric(reference, test)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: ExposureRange(2, 1, 3), "start must not exceed stop"),
        (lambda: ExposureRange(0, 100, 3), "between -60 and 60"),
        (lambda: ExposureRange(float("nan"), 1, 3), "start must not exceed stop"),
        (lambda: ExposureRange(0, 1, 1), "between 2 and 200"),
        (lambda: ToneCurve("filmic"), "choose one of aces, hable, reinhard"),
        (lambda: lit_exposures(np.ones((4, 4, 3)), np.zeros((4, 4), bool)), "The mask is empty"),
        (lambda: lit_exposures(np.ones((4, 4, 3)), np.ones((4, 5), bool)), "The mask has shape"),
    ],
)
def test_bad_options_are_refused(make, sentence):
    with pytest.raises(BadInputError, match=sentence):
        make()


def test_a_feature_that_rounding_lifts_above_its_largest_has_a_finite_error():
    """An edge of sqrt(2) and a little more, on equal colours: 0 to the power of less than 0 would be infinite."""
    flat, colours = np.zeros((1, 1), np.float32), np.zeros((3, 1, 1), np.float32)
    edge = np.full((1, 1), np.sqrt(2.0) * (1.0 + 1e-6), np.float32)
    test = SimpleNamespace(perceived=Perceived(colours, edge, flat))
    difference = FlipDifference(Perceived(colours, flat, flat), test)
    assert difference.error[0, 0] == 1.0


@pytest.mark.parametrize("curve", HDR_GOLDEN)
def test_black_has_the_slope_that_light_added_to_it_sees(curve):
    """0 is the end that clips; a fit must see that a black pixel grows brighter."""
    tone, black, step = ToneCurve(curve), np.zeros((3, 1, 2)), 1e-6
    slope = tone.pullback(black, 1.0, np.ones_like(black))
    rise = (tone.apply(black + step, 1.0) - tone.apply(black, 1.0)) / step
    np.testing.assert_allclose(slope, rise, rtol=1e-3, atol=1e-6)
    assert (slope > 0.0).all()
    assert (tone.pullback(black - step, 1.0, np.ones_like(black)) == 0.0).all()


def test_a_picture_of_a_display_is_compared_without_an_exposure_of_ours():
    linear = np.random.default_rng(3).uniform(0.0, 0.2, (9, 12, 3)).astype(np.float32)  # dark: it would be exposed
    shown = Image(DisplayView().display(linear), Encoding.SRGB)
    for pair in ((shown, Image(linear, Encoding.LINEAR)), (Image(linear, Encoding.LINEAR), shown)):
        assert flip_error(*pair).mean < 1e-6
    darker = Image(0.5 * linear, Encoding.LINEAR)
    exposed = flip_error(Image(linear, Encoding.LINEAR), darker).mean
    assert exposed > 1.2 * flip_error(shown, darker).mean  # a brighter picture shows the difference better
