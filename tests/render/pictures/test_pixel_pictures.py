# SPDX-License-Identifier: Apache-2.0
"""Pictures of some pixels against pictures of all by Mitsuba's film, an independent implementation of the filter."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.render.pictures.test_ordered_picture import CROP, load

PIXELS = np.flatnonzero(np.random.default_rng(0).random(24 * 17) < 0.6)[::-1]  # in no order that matters


def some(renderer: Any, pixels: np.ndarray, *, seed: int, spp: int) -> np.ndarray:
    return renderer.pixels_later(renderer.start, pixels, seed=seed, spp=spp)()


@pytest.mark.parametrize("rfilter", ["box", "gaussian", "tent", "mitchell", "lanczos"])
def test_the_mean_of_every_pixel_is_the_films(tmp_path: Path, rfilter: str) -> None:
    renderer = load(tmp_path, rfilter)
    films = [renderer.image(renderer.start, seed=k, spp=512).reshape(-1, 3)[PIXELS] for k in range(16)]
    pictures = [some(renderer, PIXELS, seed=100 + k, spp=16) for k in range(64)]
    assert pictures[0].shape == (len(PIXELS), 3)
    # the film divides by the sum of its weights, a bias that 512 samples do not show
    (mean, variance), (expected, own) = (
        (np.mean(many, axis=0), np.var(many, axis=0, ddof=1) / len(many)) for many in (pictures, films)
    )
    # rounding, and what a tail of the filter meets once in 10^4 samples, which no variance of 1024 knows
    least = np.square(1e-3 * expected.mean())
    away = (mean - expected) / np.sqrt(variance + own + least)
    row, column = np.divmod(PIXELS, 24)
    # beyond its border the film has no samples, a camera sees on
    away = away[(row > 1) & (row < 15) & (column > 1) & (column < 22)]
    # Student's distribution of about 16 degrees of freedom has a deviation of 1.07; some 150 pixels, grey ones of
    # which the channels share their noise
    assert np.sqrt(np.mean(np.square(away))) < 1.25
    assert abs(float(away.mean())) < 4.0 / np.sqrt(len(away))


def test_pixels_of_a_cropped_film(tmp_path: Path) -> None:
    renderer = load(tmp_path, "gaussian", film=CROP)
    exact = renderer.image(renderer.start, seed=1, spp=4096)
    found = some(renderer, np.arange(9 * 12), seed=2, spp=256).reshape(9, 12, 3)
    # 256 samples of a sphere before a sky: a per cent of noise a pixel, more at the silhouette
    np.testing.assert_allclose(found, exact, atol=0.05 * exact.max())


@pytest.mark.parametrize("spp", [2, 4, 8, 16])
def test_samples_are_even_in_each_pixel(tmp_path: Path, spp: int) -> None:
    """Their noise is less than that of independent ones, which the film's are for a box filter."""
    renderer = load(tmp_path, "box")
    exact = renderer.image(renderer.start, seed=99, spp=4096).reshape(-1, 3)
    pixels = np.arange(len(exact))
    even = np.mean([np.square(some(renderer, pixels, seed=k, spp=spp) - exact) for k in range(64)])
    images = [renderer.image(renderer.start, seed=k, spp=spp).reshape(-1, 3) for k in range(64)]
    assert even < 0.9 * np.mean([np.square(image - exact) for image in images])


@pytest.mark.parametrize("rfilter", ["box", "gaussian"])
def test_neighbours_share_no_noise(tmp_path: Path, rfilter: str) -> None:
    renderer = load(tmp_path, rfilter)
    shape = (17, 24, 3)
    pictures = np.array([some(renderer, np.arange(17 * 24), seed=k, spp=4) for k in range(200)]).reshape(-1, *shape)
    noise = pictures - pictures.mean(axis=0)
    pairs = np.mean(noise[:, :, 1:] * noise[:, :, :-1])
    # 200 pictures of 391 pairs: a standard error of 0.0036
    assert abs(pairs) < 0.015 * np.mean(np.square(noise))


def test_a_long_list_is_rendered_in_pieces_also_when_other_values_are_shown_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mfo_backend.render.pictures import pixel_pictures

    monkeypatch.setattr(pixel_pictures, "MOST_PATHS", 400)
    renderer = load(tmp_path, "gaussian")
    pieces = list(pixel_pictures.pieces_of(PIXELS, 7, 4))
    assert [len(piece.pixels) for piece in pieces[:-1]] == [100] * (len(PIXELS) // 100)
    np.testing.assert_array_equal(np.concatenate([piece.pixels for piece in pieces]), PIXELS)
    assert len({piece.seed for piece in pieces}) == len(pieces)
    image = some(renderer, PIXELS, seed=7, spp=4)
    later = renderer.pixels_later(renderer.start, PIXELS, seed=7, spp=4)
    renderer.show(0.5 * (renderer.table.lower + renderer.table.upper))
    np.testing.assert_array_equal(later(), image)
    assert renderer.passes == pytest.approx(2 * len(PIXELS) / (24 * 17))
    alone = [some(renderer, piece.pixels, seed=piece.seed, spp=4) for piece in pieces]
    np.testing.assert_array_equal(image, np.concatenate(alone))


def test_other_pixels_and_seeds_need_no_other_kernel(tmp_path: Path) -> None:
    import drjit as dr

    renderer = load(tmp_path, "gaussian")
    some(renderer, PIXELS, seed=1, spp=4)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        some(renderer, PIXELS[:77], seed=5, spp=4)
        launched = [entry for entry in dr.kernel_history() if "hash" in entry]
    assert launched
    assert all(entry["cache_hit"] for entry in launched)


def test_a_number_of_samples_that_does_not_fill_a_pixel_evenly_is_refused(tmp_path: Path) -> None:
    renderer = load(tmp_path, "box")
    with pytest.raises(ValueError, match="5 even samples"):
        renderer.pixels_later(renderer.start, PIXELS, seed=1, spp=5)
