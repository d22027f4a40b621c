# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.judge.region import MaskedLoss, blocks_around, fill_outside
from mfo_backend.metrics.losses.loss import make_loss
from mfo_backend.types.image import Encoding, Image


def test_pixels_outside_the_mask_have_no_say() -> None:
    rng = np.random.default_rng(0)
    reference, background, image = rng.random((3, 16, 16, 3)).astype(np.float32)
    mask = np.zeros((16, 16), bool)
    mask[4:9, 5:11] = True
    shown = fill_outside(Image(reference, Encoding.LINEAR), background, mask, lambda pixels: pixels)
    loss = MaskedLoss(make_loss("flip-hdr", shown, mask=mask), background, mask)
    value, gradient = loss.value_and_gradient(image)
    other = np.where(mask[..., None], image, rng.random((16, 16, 3)).astype(np.float32))
    assert loss.value(other) == loss.value(image) == value
    assert np.all(gradient[~mask] == 0.0)
    assert np.any(gradient[mask] != 0.0)
    assert loss.value(reference) == 0.0


def test_a_display_reference_gets_a_display_background() -> None:
    reference = Image(np.full((4, 4, 3), 0.5, np.float32), Encoding.SRGB)
    mask = np.eye(4, dtype=bool)
    shown = fill_outside(reference, np.full((4, 4, 3), 4.0, np.float32), mask, lambda pixels: np.sqrt(pixels) / 8)
    assert shown.encoding is Encoding.SRGB
    np.testing.assert_array_equal(shown.pixels[mask], 0.5)
    np.testing.assert_array_equal(shown.pixels[~mask], 0.25)


@pytest.mark.parametrize(
    ("side", "margin", "rows", "columns"),
    [(1, 0, (5, 8), (9, 10)), (4, 0, (4, 8), (8, 12)), (4, 1, (4, 12), (8, 12)), (3, 7, (0, 15), (0, 18))],
)
def test_blocks_around_a_mask_lie_as_in_the_picture(side, margin, rows, columns) -> None:
    mask = np.zeros((16, 16), bool)
    mask[5:8, 9] = True
    assert blocks_around(mask, side, margin) == (slice(*rows), slice(*columns))
