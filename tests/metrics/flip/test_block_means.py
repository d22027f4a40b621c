# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.metrics.flip.block_means import MOST_COUNTED, block_means, block_side, block_sums, full_blocks, spread
from mfo_backend.types.image import Encoding, Image


@pytest.mark.parametrize(
    ("pixels", "side"),
    [(1, 1), (MOST_COUNTED, 1), (MOST_COUNTED + 1, 2), (4 * MOST_COUNTED, 2), (1920 * 1080, 4)],
)
def test_the_side_follows_from_what_counts(pixels: int, side: int) -> None:
    counted = np.zeros(1920 * 1080, bool)
    counted[:pixels] = True
    assert block_side(counted.reshape(1080, 1920)) == side


def test_light_is_averaged_and_what_fills_no_block_left_out() -> None:
    pixels = np.random.default_rng(0).random((7, 10, 3)).astype(np.float32)
    found = block_means(Image(pixels, Encoding.LINEAR), 3).pixels
    assert found.shape == (2, 3, 3)
    np.testing.assert_allclose(found[1, 2], pixels[3:6, 6:9].mean((0, 1)), rtol=1e-6)
    # a chessboard of black and white is half the light of white: 0.7354 of the display's range (IEC 61966-2-1)
    board = np.indices((4, 4)).sum(axis=0)[..., None] % 2 * np.ones(3)
    shown = block_means(Image(board.astype(np.float32), Encoding.SRGB), 2)
    assert shown.encoding is Encoding.SRGB
    np.testing.assert_allclose(shown.pixels, 0.73536, atol=1e-5)


def test_a_side_of_one_changes_nothing() -> None:
    image = Image(np.random.default_rng(0).random((5, 4, 3)).astype(np.float32), Encoding.SRGB)
    assert block_means(image, 1) is image


def test_blocks_of_which_half_is_in_the_mask_count() -> None:
    mask = np.zeros((4, 7), bool)
    mask[0, 0] = mask[0, 2:4] = mask[2:, 0:2] = True
    np.testing.assert_array_equal(full_blocks(mask, 2), [[False, True, False], [True, False, False]])
    thin = np.zeros((4, 4), bool)
    thin[1, 2] = True
    np.testing.assert_array_equal(full_blocks(thin, 2), [[False, True], [False, False]])


@pytest.mark.parametrize("kind", [bool, np.float32, np.float64])
@pytest.mark.parametrize("side", [1, 2, 3, 4])
def test_sums_are_those_of_each_block(kind: type, side: int) -> None:
    pixels = (np.random.default_rng(0).random((10, 13, 2)) * 2).astype(kind)
    found = block_sums(pixels, side)
    assert found.dtype == np.float64
    assert found.shape == (10 // side, 13 // side, 2)
    for row, column in np.ndindex(found.shape[:2]):
        block = pixels[row * side :][:side, column * side :][:, :side]
        np.testing.assert_allclose(found[row, column], block.astype(np.float64).sum((0, 1)), rtol=1e-12)


def test_spreading_is_the_adjoint_of_the_mean() -> None:
    draw = np.random.default_rng(0)
    pixels, blocks = draw.random((7, 10, 3)).astype(np.float32), draw.random((2, 3, 3)).astype(np.float32)
    mean = block_sums(pixels, 3) / 9
    assert np.vdot(mean, blocks) == pytest.approx(np.vdot(pixels, spread(blocks, 3, pixels.shape)), rel=1e-6)
