# SPDX-License-Identifier: Apache-2.0
"""Whole light paths of a sheet. Oracles: the path tracer's pictures of it, and finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.render.sheet.sheet_renderer import SheetRenderer
from tests.fit.traced.glass import TRUTH, load
from tests.render.scenes import FLOOR, SKY

GAINS = (1.0, 2.5)


@pytest.fixture(scope="module")
def glass(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scenes")
    renderers = [
        load(folder / str(number), lights=SKY + FLOOR, origin=origin, size=size)
        for number, (origin, size) in enumerate((("0, -4, 1", 16), ("3.5, -2, 1", 12)))
    ]
    from mfo_backend.render.sheet.traced_sheet import TracedSheet

    renderer = SheetRenderer(renderers, GAINS)
    return renderer, TracedSheet(renderer)


def test_each_picture_is_that_of_the_path_tracer(glass):
    renderer, paths = glass
    x = renderer.table.pack(TRUTH)
    pixels = np.random.default_rng(0).permutation(np.flatnonzero(renderer.target_mask()))
    got = paths.images(x, pixels, seed=1, samples=1024, jacobian=False)[0, :, :, 0]
    expected = renderer.image(x, seed=7, spp=1024).reshape(-1, 3)[pixels]
    numbers = renderer.sheet.numbers(pixels)
    assert set(numbers) == {0, 1}
    for number in (0, 1):
        ours, theirs = got[numbers == number], expected[numbers == number]
        np.testing.assert_allclose(ours.mean(axis=0), theirs.mean(axis=0), rtol=0.015)
        assert np.sqrt(np.mean((ours - theirs) ** 2) / np.mean(theirs**2)) < 0.08  # noise of 1024 paths a pixel


def test_derivatives_are_those_of_the_mean_picture(glass):
    renderer, paths = glass
    x = renderer.table.pack({**TRUTH, "roughness": 6.5 / 15.0})  # in the middle of a cell of the albedo tables
    pixels = np.flatnonzero(renderer.target_mask())
    columns = paths.images(x, pixels, seed=1, samples=2048, jacobian=True)[0].mean(axis=0)[:, 1:]
    for name in ("base_color", "roughness", "transmission_weight"):
        for k in range(renderer.table.length)[renderer.table.slice_of(name)]:
            h = np.zeros_like(x)
            h[k] = 0.03
            down, up = paths.images(np.stack([x - h, x + h]), pixels, seed=2, samples=2048, jacobian=False)[..., 0]
            np.testing.assert_allclose(columns[:, k], (up - down).mean(axis=0) / 0.06, rtol=0.05, atol=0.03)


def test_nothing_is_between_the_pictures(glass):
    renderer, paths = glass
    x = renderer.table.pack(TRUTH)
    between = np.flatnonzero(renderer.sheet.numbers(np.arange(np.prod(renderer.sheet.shape))) < 0)
    assert len(between)
    assert not paths.images(x, between, seed=1, samples=1, jacobian=True).any()


def test_pictures_and_halves_have_random_numbers_of_their_own(tmp_path):
    renderers = [load(tmp_path / str(number), lights=SKY + FLOOR, size=12) for number in (0, 1)]
    from mfo_backend.render.sheet.traced_sheet import TracedSheet

    renderer = SheetRenderer(renderers)
    pixels = np.flatnonzero(renderer.target_mask())
    twice = np.concatenate([pixels, pixels])
    images = TracedSheet(renderer).images(renderer.table.pack(TRUTH), twice, seed=1, samples=2, jacobian=False)[0]
    first, second = np.split(images[:, 1, 0], 2)
    numbers = renderer.sheet.numbers(pixels)
    # the same scene twice: what two of these have in common would be random numbers
    noise = [half[numbers == number] for half in (first, second) for number in (0, 1)]
    center = np.mean(noise, axis=0)
    assert np.abs(np.corrcoef([each - center for each in noise]) - np.eye(4))[~np.eye(4, dtype=bool)].max() < 0.6
