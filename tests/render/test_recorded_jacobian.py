# SPDX-License-Identifier: Apache-2.0
"""Oracles: central differences, sums in NumPy, and Dr.Jit's own history of kernel launches."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from mfo_backend.render.renderer import load_renderer
from tests.render.scenes import POINT, SKY, write_scene

NAMES = ["base_color", "roughness", "metallic", "specular", "spec_tint", "anisotropic", "sheen", "sheen_tint",
"clearcoat",
         "clearcoat_gloss"]  # fmt: skip


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = write_scene(tmp_path_factory.mktemp("scene"), SKY + POINT, size=20)
    renderer = load_renderer(path, "target", model="mitsuba_principled", parameters=NAMES)
    from mfo_backend.render.recorded_scene import RecordedScene

    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    return scene, scene.record(renderer.start, grid=3, seed=1, near=False)


def middle(table) -> np.ndarray:
    return table.lower + (table.upper - table.lower) * np.linspace(0.3, 0.7, table.length)


def test_columns_equal_central_differences(recording):
    scene, paths = recording
    table, groups = scene.renderer.table, paths.tile_groups()
    x, h = middle(table), 2e-3
    jacobian = scene.jacobian(x, paths, groups)[:, :, 1:]
    for k in range(table.length):
        step = np.zeros(table.length)
        step[k] = h
        difference = (
            scene.jacobian(x + step, paths, groups)[:, :, 0] - scene.jacobian(x - step, paths, groups)[:, :, 0]
        ) / (2 * h)
        # float32 images of order 1 over 4e-3, and the curvature of the column
        scale = max(np.abs(difference).max(), 0.05)
        np.testing.assert_allclose(jacobian[:, :, k], difference, atol=5e-3 * scale)


def test_tiles_are_means_of_pixels(recording):
    scene, paths = recording
    x = middle(scene.renderer.table)
    pixels, tiles = paths.pixel_groups(), paths.tile_groups()
    by_pixel, by_tile = scene.jacobian(x, paths, pixels), scene.jacobian(x, paths, tiles)
    expected = np.stack([by_pixel[a:b].mean(axis=0) for a, b in zip(tiles.first[:-1], tiles.first[1:], strict=True)])
    np.testing.assert_allclose(by_tile, expected, rtol=1e-4, atol=1e-5)  # another order of float32 sums
    image = np.random.default_rng(0).uniform(size=(20, 20, 3)).astype(np.float32)
    flat = image.reshape(-1, 3)[pixels.pixels]
    means = np.stack([flat[a:b].mean(axis=0) for a, b in zip(tiles.first[:-1], tiles.first[1:], strict=True)])
    np.testing.assert_allclose(tiles.average(image), means, rtol=1e-5)


@pytest.mark.parametrize("side", [2, 4])
def test_effective_samples_are_those_of_the_lanes(recording, side):
    from mfo_backend.render.recorded_paths import LaneGroups

    scene, paths = recording
    x, tiles = middle(scene.renderer.table), paths.tile_groups(side=side)
    each = np.arange(paths.lanes)
    lanes = LaneGroups(each, np.arange(paths.lanes + 1), each, np.arange(paths.lanes + 1))
    light = scene.jacobian(x, paths, lanes)[:, :, 0].mean(axis=1).astype(np.float64)
    first = paths.first[tiles.first]  # pixels of a tile follow each other
    expected = [light[a:b].sum() ** 2 / (light[a:b] ** 2).sum() for a, b in pairwise(first)]
    np.testing.assert_allclose(scene.effective_samples(x, paths, tiles), expected, rtol=1e-3)


def test_quarters_of_tiles_are_two_pixels_wide_and_hold_all(recording):
    _, paths = recording
    quarters = paths.tile_groups(side=2)
    for a, b in pairwise(quarters.first):
        row, column = np.divmod(quarters.pixels[a:b], 20)
        assert len(set(row // 2)) == len(set(column // 2)) == 1
    assert len(quarters.pixels) == len(paths.pixel)
    with pytest.raises(ValueError, match="side is 3"):
        paths.tile_groups(side=3)


def test_chosen_groups_equal_the_rows_of_all(recording):
    scene, paths = recording
    x, tiles = middle(scene.renderer.table), paths.tile_groups()
    chosen = np.array([0, 2, 3, 7])
    np.testing.assert_allclose(
        scene.jacobian(x, paths, tiles.take(chosen)), scene.jacobian(x, paths, tiles)[chosen], rtol=1e-4, atol=1e-5
    )


def test_an_evaluation_is_one_cached_kernel_and_always_the_same(recording):
    import drjit as dr

    scene, paths = recording
    x, groups = middle(scene.renderer.table), paths.pixel_groups()
    first = scene.jacobian(x, paths, groups)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        for k in range(3):
            scene.jacobian(x + 1e-3 * k, paths, groups)
        recordings = scene.jacobian._launch.n_recordings
        dr.kernel_history_clear()
        again = scene.jacobian(x, paths, groups)
        history = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
    assert len(history) == 1
    assert scene.jacobian._launch.n_recordings == recordings
    np.testing.assert_array_equal(again, first)


def test_another_fixed_value_needs_no_other_kernel(recording):
    import drjit as dr

    from mfo_backend.render.recorded_jacobian import RecordedJacobian

    scene, paths = recording
    table, groups = scene.renderer.table.select(["base_color", "roughness"]), paths.pixel_groups()
    fixed = scene.model.values({"metallic": 0.25, "specular": 0.5}, table.names)
    x = table.pack({"base_color": (0.5, 0.4, 0.3), "roughness": 0.3})
    before = RecordedJacobian(scene.model, table, fixed)(x, paths, groups)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        dr.kernel_history_clear()
        after = RecordedJacobian(scene.model, table, {**fixed, "metallic": 0.75})(x, paths, groups)
        misses = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT and not k["cache_hit"]]
    assert misses == []
    assert np.abs(after - before).max() > 0.05
