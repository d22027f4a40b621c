# SPDX-License-Identifier: Apache-2.0
"""Views by table: against the function the table was made of, its derivatives, its inverse and what is clipped."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.metrics.display.baked_view import BakedView
from mfo_backend.metrics.display.colour import srgb_from_linear
from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.losses.flip_loss import FlipLoss
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.metrics.losses.loss_names import LDR_LOSSES
from mfo_backend.types.errors import BadInputError
from mfo_backend.types.image import Encoding, Image

from .view_tables import baked, filmic

STANDARD, FILMIC = baked(DisplayView().display), baked(filmic)
COLOURS = np.exp2(np.random.default_rng(3).uniform(-10, 4, (2000, 3)))


def test_nodes_are_exact_and_the_axes_are_not_swapped():
    nodes = np.exp2(np.array([[-12.75, -6.0, 0.75], [0.75, -12.75, 4.5], [-3.0, 1.5, -0.75]]))
    # float32 stores the table to 6e-8, and its neighbours weigh no more than the rounding of the logarithm
    np.testing.assert_allclose(FILMIC.display(nodes), filmic(nodes), atol=1e-6)


@pytest.mark.parametrize(
    ("view", "function", "largest"),
    # second derivative times step^2 / 8: srgb'' <= (ln 2 / 2.4)^2; the other curve bends as much in each of two axes
    [(STANDARD, lambda x: srgb_from_linear(np.clip(x, 0, 1)), 0.0016), (FILMIC, filmic, 0.004)],
)
def test_interpolation_error(view, function, largest):
    error = np.abs(view.display(COLOURS) - function(COLOURS))
    assert error.max() < largest
    assert error.mean() < largest / 4


@pytest.mark.parametrize("name", LDR_LOSSES)
def test_gradient_of_a_loss_through_the_table(name):
    """Against central differences in float64, to the last loss; a step of 1e-6 crosses no kink of these pixels."""
    rng = np.random.default_rng(5)
    linear = np.exp2(rng.uniform(-5, 2, (6, 7, 3)))
    reference = Image(FILMIC.display(linear).astype(np.float32), Encoding.SRGB)
    flip = name == "flip-ldr"  # computes with the precision of its reference
    loss = FlipLoss(name, FILMIC.light(linear), FILMIC) if flip else make_loss(name, reference, display=FILMIC)
    image = linear * rng.uniform(0.7, 1.4, linear.shape)
    tangent = rng.standard_normal(image.shape) * image
    expected = (loss.value(image + 1e-6 * tangent) - loss.value(image - 1e-6 * tangent)) / 2e-6
    value, gradient = loss.value_and_gradient(image)
    assert value == pytest.approx(loss.value(image), rel=1e-9)
    # 1e-16 * value / 1e-6 of rounding, and FLIP's own kinks
    assert (gradient * tangent).sum() == pytest.approx(expected, rel=1e-5, abs=1e-7)


def test_clipped_pixels_are_one_sided():
    """Where reference and image are at the top nothing pulls; an image below it is drawn up."""
    white = Image(np.ones((4, 5, 3), np.float32), Encoding.SRGB)
    loss = make_loss("mse-ldr", white, display=STANDARD)
    value, gradient = loss.value_and_gradient(np.full((4, 5, 3), 7.0, np.float32))
    assert value < 1e-12  # the table's white is the one of float32
    assert not gradient.any()
    value, gradient = loss.value_and_gradient(np.full((4, 5, 3), 0.7, np.float32))
    assert value > 0.01
    assert (gradient < 0).all()


def test_white_is_where_greys_clip():
    np.testing.assert_allclose(STANDARD.white, 1.0, rtol=1e-12)
    assert STANDARD.top == pytest.approx(1 - 0.5 / 255)


def test_inverse_gives_the_display_values_back():
    display = FILMIC.display(COLOURS)
    linear = FILMIC.linear(display)
    assert np.abs(FILMIC.display(linear) - display).max() < 1.1e-5  # it stops at a distance of 1e-5
    assert np.median(np.abs(linear / COLOURS - 1)) < 1e-4


def test_inverse_of_8_bits_is_as_near_as_their_rounding():
    display = (np.rint(FILMIC.display(COLOURS) * 255) / 255).astype(np.float32)
    linear = FILMIC.linear(display)
    assert linear.dtype == np.float32
    # rounding may leave what a mixing view can show, by half a level in each of three channels
    assert np.abs(FILMIC.display(linear) - display).max() < 3**0.5 * 0.5 / 255


@pytest.mark.parametrize("value", [np.nan, -0.1, 1.1])
def test_bad_tables_are_refused(value):
    table = np.full((3, 3, 3, 3), value, np.float32)
    with pytest.raises(BadInputError, match=r"values outside of 0 to 1: export the job again"):
        BakedView(table, -3.0, 3.0)
    with pytest.raises(BadInputError, match=r"has shape \(3, 3, 3\)"):
        BakedView(table[0], -3.0, 3.0)
    with pytest.raises(BadInputError, match=r"spans 3\.0 to -3\.0 stops"):
        BakedView(np.zeros((3, 3, 3, 3), np.float32), 3.0, -3.0)
