# SPDX-License-Identifier: Apache-2.0
"""Oracles: central differences, sums in NumPy, and Dr.Jit's own history of kernel launches."""

from __future__ import annotations

import sys
from itertools import pairwise

import numpy as np
import pytest

from mfo_backend.render.pictures.renderer import load_renderer
from tests.render.scenes import POINT, SKY, write_scene

NAMES = ["base_color", "roughness", "metallic", "specular", "spec_tint", "anisotropic", "sheen", "sheen_tint",
"clearcoat",
         "clearcoat_gloss"]  # fmt: skip


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = write_scene(tmp_path_factory.mktemp("scene"), SKY + POINT, size=20)
    renderer = load_renderer(path, "target", model="mitsuba_principled", parameters=NAMES)
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    return scene, scene.record(renderer.start, grid=3, seed=1, near=False)


def lanes(paths, groups):
    from mfo_backend.render.paths.packed_lanes import Lanes

    return Lanes.as_recorded(paths, groups), groups


def middle(table) -> np.ndarray:
    return table.lower + (table.upper - table.lower) * np.linspace(0.3, 0.7, table.length)


def test_columns_equal_central_differences(recording):
    scene, paths = recording
    table, groups = scene.renderer.table, paths.tile_groups()
    x, h = middle(table), 2e-3
    jacobian = scene.jacobian(x, *lanes(paths, groups))[0, :, :, 1:]
    for k in range(table.length):
        step = np.zeros(table.length)
        step[k] = h
        difference = (
            scene.jacobian(x + step, *lanes(paths, groups))[0, :, :, 0]
            - scene.jacobian(x - step, *lanes(paths, groups))[0, :, :, 0]
        ) / (2 * h)
        # float32 images of order 1 over 4e-3, and the curvature of the column
        scale = max(np.abs(difference).max(), 0.05)
        np.testing.assert_allclose(jacobian[:, :, k], difference, atol=5e-3 * scale)


def test_tiles_are_means_of_pixels(recording):
    scene, paths = recording
    x = middle(scene.renderer.table)
    pixels, tiles = paths.pixel_groups(), paths.tile_groups()
    (by_pixel,), (by_tile,) = scene.jacobian(x, *lanes(paths, pixels)), scene.jacobian(x, *lanes(paths, tiles))
    expected = np.stack([by_pixel[a:b].mean(axis=0) for a, b in zip(tiles.first[:-1], tiles.first[1:], strict=True)])
    np.testing.assert_allclose(by_tile, expected, rtol=1e-4, atol=1e-5)  # another order of float32 sums
    image = np.random.default_rng(0).uniform(size=(20, 20, 3)).astype(np.float32)
    flat = image.reshape(-1, 3)[pixels.pixels]
    means = np.stack([flat[a:b].mean(axis=0) for a, b in zip(tiles.first[:-1], tiles.first[1:], strict=True)])
    np.testing.assert_allclose(tiles.average(image), means, rtol=1e-5)


def test_two_samples_share_their_camera_rays_and_tell_their_noise(recording):
    scene, single = recording
    x = middle(scene.renderer.table)
    means, noise = [], []
    for seed in range(12):
        paths = scene.record(scene.renderer.start, grid=3, seed=seed, near=False, samples=2)
        np.testing.assert_array_equal(paths.pixel, single.pixel)
        np.testing.assert_array_equal(paths.coverage, single.coverage)
        two = scene.evaluator(paths, paths.tile_groups()).samples(x)
        means.append(two.mean[:, :, 0])
        noise.append(np.square(two.half_difference[:, :, 0]))
    stated, found = np.mean(noise), np.var(means, axis=0, ddof=1).mean()
    # 12 pictures of 25 tiles, whose channels share their noise: each estimate has a deviation of about 12 %
    assert stated == pytest.approx(found, rel=0.35)
    alone = scene.evaluator(single, single.tile_groups()).samples(x)
    assert alone.half_difference is None
    # half the noise of one sample alone: the mean of all is nearer to it than three of its deviations
    assert np.abs(alone.mean[:, :, 0] - np.mean(means, axis=0)).mean() < 3.0 * np.sqrt(2.0 * stated)


def test_lights_of_no_extent_are_the_same_in_both_samples(tmp_path):
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    renderer = load_renderer(
        write_scene(tmp_path, POINT, size=20), "target", model="mitsuba_principled", parameters=NAMES
    )
    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    paths = scene.record(renderer.start, grid=3, seed=1, near=True, samples=2)
    assert paths.first.shape[0] == 1  # a second one would tell nothing


def test_quarters_of_tiles_are_two_pixels_wide_and_hold_all(recording):
    _, paths = recording
    quarters = paths.tile_groups(side=2)
    for a, b in pairwise(quarters.first):
        row, column = np.divmod(quarters.pixels[a:b], 20)
        assert len(set(row // 2)) == len(set(column // 2)) == 1
    assert len(quarters.pixels) == len(paths.pixel)
    with pytest.raises(ValueError, match="side is 3"):
        paths.tile_groups(side=3)


def test_the_image_alone_is_that_of_the_derivatives(recording):
    scene, paths = recording
    x = middle(scene.renderer.table)
    for groups in (paths.pixel_groups(), paths.tile_groups()):
        expected = scene.evaluator(paths, groups)(x)[:, :, 0]
        # another kernel contracts other products and sums
        np.testing.assert_allclose(scene.pictures(paths, groups)(x)[:, :, 0], expected, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("size", [[1, 1, 1], [1, 40, 2, 1, 7], [300]])
def test_parts_of_groups_are_added_to_sums(recording, size, monkeypatch):
    """Groups of so many parts each; the oracle adds them in float64."""
    from mfo_backend.render.paths.recorded_paths import LaneGroups  # needs the variant

    size = np.array(size)
    groups = LaneGroups(np.arange(len(size)), np.arange(len(size) + 1), np.arange(len(size)), np.zeros((1, 1), int))
    monkeypatch.setitem(groups.__dict__, "_parts_per_group", size)
    values = np.random.default_rng(0).random((size.sum(), 3, 2)).astype(np.float32)
    ends = np.cumsum(size)
    expected = [values[end - count : end].sum(axis=0, dtype=np.float64) for count, end in zip(size, ends, strict=True)]
    np.testing.assert_allclose(groups.add_parts(values), [expected], rtol=1e-6)


def test_chosen_groups_equal_the_rows_of_all(recording):
    scene, paths = recording
    x, tiles = middle(scene.renderer.table), paths.tile_groups()
    chosen = np.array([0, 2, 3, 7])
    np.testing.assert_allclose(
        scene.jacobian(x, *lanes(paths, tiles.take(chosen))),
        scene.jacobian(x, *lanes(paths, tiles))[:, chosen],
        rtol=1e-4,
        atol=1e-5,
    )


def test_an_evaluation_is_one_cached_kernel_and_always_the_same(recording):
    import drjit as dr

    scene, paths = recording
    x, groups = middle(scene.renderer.table), paths.pixel_groups()
    first = scene.jacobian(x, *lanes(paths, groups))
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        for k in range(3):
            scene.jacobian(x + 1e-3 * k, *lanes(paths, groups))
        recordings = scene.jacobian._launch.n_recordings
        dr.kernel_history_clear()
        again = scene.jacobian(x, *lanes(paths, groups))
        history = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT]
    assert len(history) == 1
    assert scene.jacobian._launch.n_recordings == recordings
    np.testing.assert_array_equal(again, first)


def test_another_fixed_value_needs_no_other_kernel(recording):
    import drjit as dr

    from mfo_backend.render.paths.recorded_jacobian import RecordedJacobian

    scene, paths = recording
    table, groups = scene.renderer.table.select(["base_color", "roughness"]), paths.pixel_groups()
    fixed = scene.model.values({"metallic": 0.25, "specular": 0.5}, table.names)
    x = table.pack({"base_color": (0.5, 0.4, 0.3), "roughness": 0.3})
    before = RecordedJacobian(scene.model, table, fixed)(x, *lanes(paths, groups))
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
        dr.kernel_history_clear()
        after = RecordedJacobian(scene.model, table, {**fixed, "metallic": 0.75})(x, *lanes(paths, groups))
        misses = [k for k in dr.kernel_history() if k["type"] == dr.KernelType.JIT and not k["cache_hit"]]
    assert misses == []
    assert np.abs(after - before).max() > 0.05


@pytest.mark.parametrize("more", [{"sheen_weight": 0.5}, {"thin_film_thickness": 350.0, "thin_film_ior": 1.4}],
                         ids=["sheen", "film"])  # fmt: skip
def test_tables_are_loaded_before_the_launch_is_recorded(recording, monkeypatch, more):
    from mfo_backend.material.arrays import grid_table
    from mfo_backend.material.lobes import colour_interference
    from mfo_backend.material.recorded_models import BlenderPrincipledModel
    from mfo_backend.render.paths.recorded_jacobian import RecordedJacobian

    for table in grid_table._TABLES:  # as in a process that has not evaluated this material yet
        monkeypatch.setattr(table, "_buffers", {})
        monkeypatch.setattr(table, "_slices", {})
    colour_interference._packed.cache_clear()
    (_, paths), model = recording, BlenderPrincipledModel()
    table = model.table.select(["base_color", "roughness", *more])
    for derivatives in (True, False):  # the second launch finds the tables of the first
        jacobian = RecordedJacobian(model, table, model.values({}, table.names), derivatives=derivatives)
        loaded = len(model.buffers())
        assert np.isfinite(jacobian(middle(table), *lanes(paths, paths.tile_groups()))).all()
        assert len(model.buffers()) == loaded > 0


def test_a_launch_runs_no_python_that_dr_jit_starts_under_its_lock(recording):
    # Dr.Jit 1.5.0 holds its lock while it looks into the arguments, into dataclasses by Python's own function: another
    # thread may go on there and wait for the lock
    scene, paths = recording
    x, arguments = middle(scene.renderer.table), lanes(paths, paths.pixel_groups())
    scene.jacobian(x, *arguments)
    called = []
    sys.setprofile(lambda frame, event, _: called.append(frame.f_code.co_name) if event == "call" else None)
    try:
        scene.jacobian(x, *arguments)
    finally:
        sys.setprofile(None)
    assert "fields" not in called
    assert "own_memory" in called  # it does see what is called
