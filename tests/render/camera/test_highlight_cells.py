# SPDX-License-Identifier: Apache-2.0
"""Oracle: the same picture from a uniform grid so fine that a highlight spans many of its cells."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.render.pictures.renderer import load_renderer
from tests.render.scenes import POINT, SKY, SUN_AND_SPOT, write_scene

MIRROR = {"roughness": 0.05, "metallic": 0.9, "specular": 0.5, "base_color": (0.8, 0.5, 0.2), "anisotropic": 0.001}


def recorded(folder, lights, rfilter="box", roughness=0.05, anisotropic=0.001):
    path = write_scene(folder, lights, size=24, rfilter=rfilter)
    renderer = load_renderer(path, "target", model="mitsuba_principled", parameters=list(MIRROR))
    from mfo_backend.render.camera.highlight_cells import Highlights
    from mfo_backend.render.paths.record_paths import record_paths
    from mfo_backend.render.paths.record_settings import RecordSettings
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    x = renderer.table.pack({**MIRROR, "roughness": roughness, "anisotropic": anisotropic})

    def picture(grid, share=None, **bounds):
        highlights = None if share is None else Highlights(share=share, **bounds)
        settings = RecordSettings(grid=grid, two_sided=True, highlights=highlights)
        paths = record_paths(renderer.scene, renderer.shape, settings)
        groups = paths.pixel_groups()
        image = np.zeros((24 * 24, 3), np.float32)
        image[groups.pixels] = scene.evaluator(paths, groups)(x)[:, :, 0]
        return image, paths

    return renderer, picture


def error(a, b):
    return float(np.sqrt(np.mean((a - b) ** 2) / np.mean(b**2)))


# the inverse distribution of a Gaussian stretches the outer cells of a uniform grid, so that it needs a wider lobe
@pytest.mark.parametrize(("rfilter", "roughness"), [("box", 0.05), ("gaussian", 0.12)])
@pytest.mark.parametrize("lights", [POINT, SUN_AND_SPOT], ids=["point", "two-lights"])
def test_a_highlight_narrower_than_a_pixel_is_integrated(tmp_path, lights, rfilter, roughness):
    _, picture = recorded(tmp_path, lights, rfilter, roughness)
    coarse, _ = picture(8)
    # a pixel is 40 highlights of roughness 0.05 wide: 400 cells along its axes resolve them
    near = (coarse.max(-1) > 2.0 * np.median(coarse[coarse.max(-1) > 0].max(-1))).reshape(24, 24)
    for axis in (0, 1):
        near = near | np.roll(near, 1, axis) | np.roll(near, -1, axis)
    expected, uniform = picture(np.where(near, 300, 8))
    found, paths = picture(4, share=0.35)
    assert error(found, expected) < 0.004
    assert error(found, expected) < 0.1 * error(coarse, expected)
    assert paths.lanes < 0.1 * uniform.lanes


def test_an_anisotropic_highlight_is_narrow_along_one_axis(tmp_path):
    _, picture = recorded(tmp_path, POINT, roughness=0.14, anisotropic=0.9)
    expected, _ = picture(60, share=0.1, narrow=0.19)
    found, paths = picture(2, share=0.35, narrow=0.19)
    round_one, fewer = picture(2, share=0.35)
    across, _ = picture(2, share=0.35, narrow=0.19, turn=0.25)  # the wrong axis is no help
    assert error(found, expected) < 0.4 * error(round_one, expected)
    assert error(across, expected) > 0.8 * error(round_one, expected)
    assert paths.lanes < 2.0 * fewer.lanes  # cells as small along both axes would be up to 28 times as many


def test_weights_still_add_up_and_the_dark_takes_no_more_rays(tmp_path):
    _, picture = recorded(tmp_path, POINT)
    _, plain = picture(4)
    _, paths = picture(4, share=0.5)
    np.testing.assert_allclose(paths.coverage[paths.interior], 1.0, atol=1e-5)
    np.testing.assert_array_equal(paths.pixel, plain.pixel)
    lanes, before = (np.bincount(p.pixel, np.diff(p.first[0]), 24 * 24) for p in (paths, plain))
    assert ((lanes > before).sum()) < 0.1 * (before > 0).sum()


def test_the_number_of_split_cells_is_bounded(tmp_path):
    _, picture = recorded(tmp_path, POINT)
    lanes = {most: picture(4, share=0.2, most=most)[1].lanes for most in (0, 100, 60_000)}
    # every split cell takes twelve rays more
    assert lanes[0] < lanes[100] <= lanes[0] + 12 * 100 < lanes[60_000]


def test_scenes_without_such_lights_keep_their_grid(tmp_path):
    _, picture = recorded(tmp_path, SKY)
    _, plain = picture(3)
    _, paths = picture(3, share=0.5)
    assert paths.lanes == plain.lanes
