# SPDX-License-Identifier: Apache-2.0
"""Pointwise responses: check values of their sources, and both derivatives against finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.metrics.losses.loss_names import LOSS_NAMES
from mfo_backend.metrics.losses.squared_loss import SquaredLoss
from mfo_backend.metrics.responses import itp
from mfo_backend.metrics.responses.itp import Itp, de_itp_map
from mfo_backend.metrics.responses.pu21 import Pu21, pu21
from mfo_backend.metrics.responses.response import (
    Displayed,
    Logarithmic,
    OnDisplay,
    Scaled,
    displayed_by,
    nits_per_unit,
    relative_to,
)
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image

from ..display.view_tables import baked, filmic

RNG = np.random.default_rng(7)
RADIANCE = 10 ** RNG.uniform(-2, 1, (5, 6, 3))
RESPONSES = {
    "scaled": Scaled(3.0),
    "relative": relative_to(RADIANCE[::-1].copy()),
    "logarithmic": Logarithmic(0.2),
    "displayed": Displayed(DisplayView(-1)),
    "displayed with gamma": Displayed(DisplayView(-1, 2.2)),
    "pu21": Pu21(100.0),
    "pu21 on a display": OnDisplay(DisplayView(-1.5, 1.3), Pu21(100.0)),
    "itp": Itp(100.0),
    "itp on a display": OnDisplay(DisplayView(-2), Itp(100.0)),
    "displayed by a table": displayed_by(baked(filmic)),
    "itp on a display by a table": OnDisplay(baked(filmic), Itp(100.0)),
}
SQUARED_LOSSES = [name for name in LOSS_NAMES if not name.startswith("flip")]


def test_pu21_check_values():
    """Computed with the authors' encoder, variant banding_glare."""
    nits = np.array([0.005, 0.1, 1, 10, 100, 300, 1000, 4000, 10000])
    expected = [0.0, 5.7171, 36.5439, 123.6475, 256.3839, 331.139, 420.0969, 527.4939, 595.3939]
    np.testing.assert_allclose(pu21(nits), expected, atol=1e-3)  # the published values have three or four decimals
    np.testing.assert_array_equal(pu21(np.array([0.0, 1e9])), pu21(np.array([0.005, 1e4])))


def test_itp_check_values():
    grey = np.full((1, 1, 3), 100.0)
    assert de_itp_map(grey, grey * 1.01)[0, 0] == pytest.approx(0.72, abs=0.005)
    # BT.2100: PQ of 10000 cd/m^2 is 1, so white at the peak has I = 1 and no chroma (matrix rows sum to 1 to 1e-4)
    np.testing.assert_allclose(Itp(1.0).apply(np.full((1, 3), 1e4)) / 720, [[1, 0, 0]], atol=2e-4)
    # BT.2408: 100 cd/m^2 is 50.8 % of PQ
    assert Itp(1.0).apply(np.full((1, 3), 100.0))[0, 0] / 720 == pytest.approx(0.508, abs=5e-4)


def test_itp_of_a_colour():
    """ICtCp of this BT.2020 colour is the example of colour-science's RGB_to_ICtCp; BT.2124 halves Ct."""
    cone = np.array([[0.45620519, 0.03081071, 0.04091952]]) @ itp._BT2020_TO_LMS.T / 1e4
    expected = np.array([0.07351364, 0.00475253, 0.09351596])
    np.testing.assert_allclose(itp._pq(cone)[0] @ itp._PQ_TO_JND.T / 720, expected * [1, 0.5, 1], atol=1e-8)


def test_itp_sees_hue_and_is_symmetric():
    red, blue = np.array([[[0.6, 0.2, 0.1]]]), np.array([[[0.1, 0.2, 0.6]]])
    assert de_itp_map(red, blue, 100)[0, 0] == pytest.approx(de_itp_map(blue, red, 100)[0, 0])
    assert de_itp_map(red, blue, 100)[0, 0] > 50


@pytest.mark.parametrize("name", RESPONSES)
def test_both_derivatives(name):
    """Central differences in float64: PQ's power of 79 and the factor 720 leave 1e-16 * 79 * 720 / 1e-5 of rounding."""
    response = RESPONSES[name]
    tangent = RNG.standard_normal(RADIANCE.shape) * RADIANCE
    step = 1e-5
    expected = (response.apply(RADIANCE + step * tangent) - response.apply(RADIANCE - step * tangent)) / (2 * step)
    pushed = response.push(RADIANCE, tangent)
    np.testing.assert_allclose(pushed, expected, rtol=1e-6, atol=5e-6)
    weight = RNG.standard_normal(RADIANCE.shape)
    assert (weight * pushed).sum() == pytest.approx((response.pullback(RADIANCE, weight) * tangent).sum(), rel=1e-9)


@pytest.mark.parametrize("name", RESPONSES)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_black_negative_and_huge_pixels_stay_finite(name, dtype):
    pixels = np.broadcast_to(np.array([0, -1, 1e-30, 1e-6, 1e8], dtype)[:, None, None], (5, 6, 3))
    response, ones = RESPONSES[name], np.ones(pixels.shape, dtype)
    for values in (response.apply(pixels), response.pullback(pixels, ones), response.push(pixels, ones)):
        assert np.isfinite(values).all()
        assert values.dtype == dtype or name == "relative"  # its weights have the reference's type


def loss_and_image(name):
    reference = (0.02 * 10 ** RNG.uniform(0, 2, (7, 9, 3))).astype(np.float32)
    return make_loss(name, Image(reference, Encoding.LINEAR)), reference * RNG.uniform(
        0.7, 1.4, reference.shape
    ).astype("f")


@pytest.mark.parametrize("name", SQUARED_LOSSES)
def test_residuals_square_to_the_loss_and_its_gradient(name):
    loss, image = loss_and_image(name)
    assert isinstance(loss, SquaredLoss)
    residual = loss.residual(image)
    value, gradient = loss.value_and_gradient(image)
    assert residual.shape == (image.size,)
    assert value == pytest.approx(np.square(residual, dtype=np.float64).sum(), rel=1e-5)
    tangents = RNG.standard_normal((4, *image.shape)).astype(np.float32)
    jacobian = loss.residual_jacobian(image, tangents)
    assert jacobian.shape == (image.size, 4)
    expected = [(gradient * t).sum() for t in tangents]
    np.testing.assert_allclose(2 * jacobian.T @ residual, expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max())


def test_scale_to_nits_puts_the_median_at_100():
    reference = np.zeros((10, 10, 3), np.float32)
    reference[:4] = 0.5
    assert nits_per_unit(reference) == pytest.approx(200, rel=1e-6)
    mask = np.zeros((10, 10), bool)
    mask[3:6] = True  # a third lit: the median is black, and the scale stays defined
    assert nits_per_unit(reference, mask) == 100


def test_hdr_losses_refuse_display_values_and_name_what_works():
    reference = Image(np.full((4, 4, 3), 0.5, np.float32), Encoding.SRGB)
    with pytest.raises(BadInputError, match=r"Loss relative-hdr needs a scene-linear reference .* use mse-ldr"):
        make_loss("relative-hdr", reference)
