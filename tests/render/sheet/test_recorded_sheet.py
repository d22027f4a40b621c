# SPDX-License-Identifier: Apache-2.0
"""A sheet's recording is its pictures' recordings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mfo_backend.render.paths.recorded_scene import RecordedScene
from mfo_backend.render.sheet.recorded_sheet import RecordedSheet
from mfo_backend.render.sheet.sheet_renderer import SheetRenderer
from tests.fit.pictures.two_scenes import VALUES, views
from tests.render.paths.test_returned_light import START, room
from tests.render.scenes import AREA, POINT

GAINS = (1.0, 2.5)


@pytest.mark.parametrize("lights", [[POINT, POINT], [AREA, POINT]], ids=["exact", "one of them sampled"])
def test_each_picture_is_on_the_sheet_as_it_is_alone(tmp_path, lights):
    renderers = views(tmp_path, lights, [16, 24])
    sheet = RecordedSheet(SheetRenderer(renderers, GAINS))
    x = renderers[0].table.pack(VALUES)
    whole = sheet.record(x, grid=2, seed=3, near=False, samples=2)
    rows = sheet.evaluator(whole, whole.pixel_groups()).samples(x)
    assert whole.pixel_groups().samples == (2 if sheet.needs.sampled else 1)
    numbers = sheet.renderer.sheet.numbers(whole.pixel)
    assert set(numbers) == {0, 1}
    for number, renderer in enumerate(renderers):
        alone = RecordedScene(renderer, int(renderer.target_mask().sum()))
        seed = 3 + number * 0x9E3779B1
        paths = alone.record(x, grid=2, seed=seed % 2**32, near=False, samples=2, needs=sheet.needs)
        own = alone.evaluator(paths, paths.pixel_groups()).samples(x)
        np.testing.assert_array_equal(
            sheet.renderer.sheet.on_sheet(paths.pixel, number), whole.pixel[numbers == number]
        )
        gain = GAINS[number]
        np.testing.assert_allclose(rows.mean[numbers == number], gain * own.mean, rtol=2e-5, atol=1e-6 * gain)
        if own.half_difference is not None:
            np.testing.assert_allclose(
                rows.half_difference[numbers == number], gain * own.half_difference, rtol=1e-3, atol=1e-5 * gain
            )


def test_light_that_returns_changes_in_all_pictures_of_a_sheet(tmp_path):
    (tmp_path / "other").mkdir()
    renderers = [room(folder)[0] for folder in (tmp_path, tmp_path / "other")]
    sheet = RecordedSheet(SheetRenderer(renderers, GAINS))
    start, x = (renderers[0].table.pack({**START, "base_color": (red, 0.7, 0.5)}) for red in (0.8, 0.6))
    whole = sheet.record(start, grid=6, seed=3, near=True, samples=2)
    held = replace(whole, returned=None)
    found, known = (sheet.pictures(paths, paths.pixel_groups())(x)[:, :, 0] for paths in (whole, held))
    numbers = sheet.renderer.sheet.numbers(whole.pixel)
    for number, (renderer, gain) in enumerate(zip(renderers, GAINS, strict=True)):
        expected = gain * renderer.image(x, seed=7, spp=1024).mean(axis=(0, 1))
        np.testing.assert_allclose(found[numbers == number].mean(axis=0), expected, rtol=0.12)
        assert known[numbers == number].mean(axis=0)[0] > 1.4 * expected[0]
    assert sheet.returned_change(whole, x) > 0.2 > sheet.returned_change(whole, start)


def test_pixels_and_pull_backs_of_a_sheet_are_its_pictures(tmp_path):
    renderers = views(tmp_path, [POINT, POINT], [12, 16])
    sheet = SheetRenderer(renderers, GAINS)
    x = renderers[0].table.pack(VALUES)
    mask = sheet.target_mask()
    pixels = np.random.default_rng(0).permutation(np.flatnonzero(mask))
    found = sheet.pixels_later(x, pixels, seed=1, spp=4)()
    whole, pullback = sheet.image_and_pullback(x, seed=1, spp=64)
    assert abs(found.mean() / whole.reshape(-1, 3)[pixels].mean() - 1.0) < 0.05
    gradient = np.random.default_rng(1).random(whole.shape).astype(np.float32)
    parts = []
    for number, renderer in enumerate(renderers):
        own = np.ascontiguousarray(sheet.sheet.cut(gradient, number)) * np.float32(GAINS[number])
        seed = (1 + number * 0x85EBCA6B) % 2**32
        parts.append(renderer.image_and_pullback(x, seed=seed, spp=64)[1](own))
    np.testing.assert_allclose(pullback(gradient), sum(parts), rtol=1e-4)
