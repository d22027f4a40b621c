# SPDX-License-Identifier: Apache-2.0
"""Oracle: Mitsuba's own path tracing of the same scene with many samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mfo_backend.render.machine.memory import MemoryLeft
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.errors import BadInputError
from tests.render.scenes import AREA, FLOOR, POINT, SKY, SUN_AND_SPOT, write_scene

NAMES = ["base_color", "roughness", "metallic", "specular", "clearcoat", "clearcoat_gloss"]
VALUES = {"base_color": (0.7, 0.3, 0.1), "roughness": 0.4, "metallic": 0.3, "specular": 0.6, "clearcoat": 0.5,
          "clearcoat_gloss": 0.2}  # fmt: skip


def recorded_scene(folder, lights, **options):
    renderer = load_renderer(
        write_scene(folder, lights, **options), "target", model="mitsuba_principled", parameters=NAMES
    )
    from mfo_backend.render.paths.recorded_scene import RecordedScene  # needs the variant that the renderer sets

    return renderer, RecordedScene(renderer, int(renderer.target_mask().sum()))


@pytest.mark.parametrize(
    ("lights", "depth", "rfilter", "grid", "tolerance"),
    [
        # exact lights: what is left is the noise of the path-traced picture and of the footprint's 64 samples
        (POINT, 2, "box", 8, 0.01),
        (POINT, 2, "gaussian", 12, 0.02),
        (SUN_AND_SPOT, 2, "box", 8, 0.01),
        # sampled lights: two samples a ray, tiles of 16 pixels
        (SKY, 2, "box", 12, 0.02),
        (AREA + POINT, 2, "box", 12, 0.02),
        (AREA + SKY + FLOOR, 5, "box", 12, 0.02),
    ],
    ids=["point", "point-gaussian", "sun-spot", "sky", "two-areas-point", "floor-indirect"],
)
def test_equals_the_path_traced_picture(tmp_path, lights, depth, rfilter, grid, tolerance):
    renderer, scene = recorded_scene(tmp_path, lights, depth=depth, rfilter=rfilter)
    x = renderer.table.pack(VALUES)
    paths = scene.record(x, grid=grid, seed=3, near=False)
    groups = paths.tile_groups()
    got = scene.evaluator(paths, groups)(x)[:, :, 0]
    expected = groups.average(renderer.image(x, seed=7, spp=1024))
    error = np.sqrt(np.mean((got - expected) ** 2) / np.mean(expected**2))
    assert error < tolerance
    np.testing.assert_allclose(
        got.sum(axis=0), expected.sum(axis=0), rtol=0.5 * tolerance
    )  # noise averages out, bias would not


def test_tiles_are_means_of_their_pixels(tmp_path):
    renderer, scene = recorded_scene(tmp_path, AREA)
    x = renderer.table.pack(VALUES)
    paths = scene.record(x, grid=4, seed=3, near=False)
    tiles = paths.tile_groups()
    pixels = scene.evaluator(paths, paths.pixel_groups())(x)
    # sums of float32 in another order
    np.testing.assert_allclose(tiles.mean_of_pixels(pixels), scene.evaluator(paths, tiles)(x), rtol=1e-4, atol=1e-5)


def test_direct_light_alone_is_the_same_with_and_without_the_kernels_of_other_light(tmp_path):
    renderer, _ = recorded_scene(tmp_path, AREA + FLOOR, depth=5)
    from mfo_backend.render.paths.record_paths import record_paths  # needs the variant
    from mfo_backend.render.paths.record_settings import RecordSettings

    settings = RecordSettings(grid=3, seed=4, depth=5, direct_samples=1)
    some, without = (record_paths(renderer.scene, renderer.shape, s) for s in (settings, replace(settings, depth=2)))
    assert some.lanes == without.lanes
    np.testing.assert_allclose(np.array(some.weight), np.array(without.weight), rtol=1e-5)
    everything = record_paths(renderer.scene, renderer.shape, replace(settings, direct_samples=0))
    assert np.array(everything.weight).sum() > 1.02 * np.array(some.weight).sum()


@pytest.mark.parametrize("alike", [True, False])
def test_samples_of_the_light_are_alike_or_have_directions_of_their_own(tmp_path, alike):
    renderer, _ = recorded_scene(tmp_path, SKY)
    from mfo_backend.render.paths.record_paths import record_paths  # needs the variant
    from mfo_backend.render.paths.record_settings import RecordSettings

    settings = RecordSettings(grid=2, seed=4, samples=2, alike=alike)
    paths = record_paths(renderer.scene, renderer.shape, settings)
    one, other = (np.array(paths.wo)[:, first[0] : first[-1]] for first in paths.first)
    assert (one.shape == other.shape and np.array_equal(one, other)) == alike


def test_all_samples_of_the_light_are_one_launch(tmp_path):
    renderer, scene = recorded_scene(tmp_path, SKY + FLOOR, depth=4)
    import drjit as dr

    def large_kernels(samples: int) -> list[int]:
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            scene.record(renderer.start, grid=2, seed=1, near=True, samples=samples)
            return sorted(
                k["operation_count"] for k in dr.kernel_history([dr.KernelType.JIT]) if k["operation_count"] > 300
            )

    scene.record(renderer.start, grid=2, seed=1, near=True)  # finds what the scene needs
    once = large_kernels(1)
    assert len(once) >= 3  # lights, proposal, what its rays meet
    assert large_kernels(2) == once


def test_the_proposal_near_a_material_is_as_unbiased(tmp_path):
    renderer, scene = recorded_scene(tmp_path, AREA + SKY)
    x = renderer.table.pack({**VALUES, "roughness": 0.12})
    means = []
    for near in (False, True):
        paths = scene.record(x, grid=16, seed=5, near=near)
        means.append(scene.evaluator(paths, paths.tile_groups())(x)[:, :, 0].mean(axis=0))
    np.testing.assert_allclose(means[0], means[1], rtol=0.01)  # 256 rays a pixel


def test_delta_lights_take_one_lane_for_each_ray_and_36_bytes(tmp_path):
    renderer, scene = recorded_scene(tmp_path, POINT)
    from mfo_backend.render.camera.highlight_cells import Highlights

    paths = scene.record(renderer.start, grid=2, seed=0, near=False, highlights=Highlights(most=0))
    covered = int(renderer.target_mask().sum())
    assert not scene.needs.sampled
    assert paths.lanes <= 4 * covered
    assert paths.bytes == 36 * paths.lanes
    assert 0.0 < paths.coverage.min() < 1.0
    assert paths.coverage.max() == pytest.approx(1.0, abs=1e-6)


def test_a_large_picture_is_recorded_by_tiles(tmp_path, monkeypatch):
    renderer, scene = recorded_scene(tmp_path, SKY)
    monkeypatch.setattr("mfo_backend.render.paths.recorded_scene.MOST_LANES", 4000)
    paths = scene.record(renderer.start, grid=4, seed=0, near=False)
    assert paths.lanes <= 4000
    assert len(np.unique(paths.tile)) >= 2


def test_many_rays_beside_a_small_target_are_left_out(tmp_path, monkeypatch):
    renderer, scene = recorded_scene(tmp_path, POINT)
    from mfo_backend.render.camera.highlight_cells import Highlights

    uniform = Highlights(most=0)
    everything = scene.record(renderer.start, grid=4, seed=0, near=False, highlights=uniform)
    monkeypatch.setattr("mfo_backend.render.paths.recorded_scene.MOST_RAYS", 16 * int(scene._near_target.sum()))
    from mfo_backend.render.paths import record_paths  # needs the variant

    taken = []
    original = record_paths.PrimaryRays
    monkeypatch.setattr(record_paths, "PrimaryRays", lambda *a, **b: taken.append(original(*a, **b)) or taken[-1])
    near = scene.record(renderer.start, grid=4, seed=0, near=False, highlights=uniform)
    assert len(np.unique(np.array(taken[0].position(np.arange(len(taken[0])))))) == scene._near_target.sum()
    assert scene._near_target.sum() < scene._near_target.size
    for name in ("wi", "wo", "weight"):
        np.testing.assert_array_equal(np.array(getattr(everything, name)), np.array(getattr(near, name)))
    np.testing.assert_array_equal(everything.pixel, near.pixel)
    np.testing.assert_array_equal(everything.constant, near.constant)
    monkeypatch.setattr("mfo_backend.render.paths.recorded_scene.MOST_RAYS", 1000)
    assert 0 < scene.record(renderer.start, grid=4, seed=0, near=False, highlights=uniform).lanes <= 1000


def test_a_recording_beyond_the_memory_is_refused_before_it_begins(tmp_path, monkeypatch):
    renderer, scene = recorded_scene(tmp_path, POINT)
    left = [MemoryLeft(50_000, "on this machine")]
    monkeypatch.setattr("mfo_backend.render.machine.memory.memory_left", lambda: left)
    with pytest.raises(
        BadInputError, match=r"needs about \d+ MB of memory and 0 MB are left on this machine: use a sm"
    ):
        scene.record(renderer.start, grid=3, seed=0, near=False)
    left[0] = MemoryLeft(10**9, "on this machine")
    scene.record(renderer.start, grid=3, seed=0, near=False)
    left[0] = MemoryLeft(0, "on this machine")  # the next one takes what the first has given back
    assert scene.record(renderer.start, grid=3, seed=1, near=False).lanes > 0
    with pytest.raises(BadInputError, match="use a smaller picture"):
        scene.record(renderer.start, grid=4, seed=1, near=False)


def test_the_same_seed_gives_the_same_recording(tmp_path):
    renderer, scene = recorded_scene(tmp_path, SKY)
    first, second = (scene.record(renderer.start, grid=3, seed=11, near=False) for _ in range(2))
    for name in ("wi", "wo", "weight"):
        np.testing.assert_array_equal(np.array(getattr(first, name)), np.array(getattr(second, name)))


def test_light_over_other_surfaces_is_left_out_where_there_is_none(tmp_path):
    _, alone = recorded_scene(tmp_path, POINT, depth=6)
    assert alone.needs.depth == 2
    assert "left out" in alone.needs.notes[0]
    _, with_floor = recorded_scene(tmp_path, POINT + FLOOR, depth=6)
    assert with_floor.needs.depth == 6
    assert with_floor.needs.notes == ()


def test_a_target_out_of_sight_is_refused(tmp_path):
    hidden = '<transform name="to_world"><translate y="-30"/></transform>'
    renderer = load_renderer(
        write_scene(tmp_path, POINT, shape=hidden), "target", model="mitsuba_principled", parameters=NAMES
    )
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    with pytest.raises(BadInputError, match="No pixel sees the target"):
        RecordedScene(renderer, 1).record(renderer.start, grid=2, seed=0, near=False)


def test_the_back_of_a_two_sided_material_is_lit(tmp_path):
    # a sphere with its normals turned inside is the same picture
    images = []
    for shape in ("", '<boolean name="flip_normals" value="true"/>'):
        renderer = load_renderer(
            write_scene(tmp_path, POINT, shape=shape), "target", model="mitsuba_principled", parameters=NAMES
        )
        from mfo_backend.render.paths.recorded_scene import RecordedScene

        scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
        paths = scene.record(renderer.start, grid=2, seed=3, near=False)
        images.append(scene.evaluator(paths, paths.tile_groups())(renderer.start)[:, :, 0])
    assert images[0].max() > 0.1
    np.testing.assert_allclose(images[1], images[0], rtol=1e-4, atol=1e-6)  # float32 of another frame


def test_a_texture_is_refused(tmp_path):
    texture = """<texture type="checkerboard" name="clearcoat"/>"""
    renderer = load_renderer(
        write_scene(tmp_path, POINT, material=texture), "target", model="mitsuba_principled", parameters=["roughness"]
    )
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    with pytest.raises(BadInputError, match="'clearcoat' is a texture"):
        RecordedScene(renderer, 1)


@pytest.mark.parametrize("rfilter", ["box", "gaussian"])
def test_rays_far_from_the_target_are_left_out_and_change_nothing(tmp_path, rfilter):
    renderer, scene = recorded_scene(tmp_path, AREA + FLOOR, depth=4, rfilter=rfilter, size=48)
    x = renderer.table.pack(VALUES)
    few = scene.record(x, grid=4, seed=3, near=False)
    near = scene._near_target
    assert 0.3 < near.mean() < 0.8
    scene._near_target = np.ones_like(near)
    every = scene.record(x, grid=4, seed=3, near=False)
    assert few.lanes == every.lanes
    for name in ("wi", "wo", "weight"):
        np.testing.assert_array_equal(np.array(getattr(few, name)), np.array(getattr(every, name)))
    np.testing.assert_array_equal(few.pixel, every.pixel)
    np.testing.assert_array_equal(few.constant, every.constant)


def test_negative_parts_of_a_pixel_filter_are_in_every_technique(tmp_path):
    renderer, scene = recorded_scene(tmp_path, SKY, rfilter="catmullrom")
    paths = scene.record(renderer.table.pack(VALUES), grid=20, seed=3, near=True)
    # the filter is negative in the first and the last of 20 cells along each axis: 2 x 0.1 x 0.9 of all
    assert (np.array(paths.weight).sum(axis=0) < 0).mean() == pytest.approx(0.18, abs=0.01)


def test_a_mask_is_widened_as_by_scipy():
    from scipy.ndimage import binary_dilation

    from mfo_backend.render.camera.widened_mask import widened

    mask = np.random.default_rng(3).random((17, 23)) < 0.03
    for reach in (1, 3):
        np.testing.assert_array_equal(widened(mask, reach), binary_dilation(mask, np.ones((3, 3), bool), reach))


OPEN_BOX = """ply
format ascii 1.0
element vertex 8
property float x
property float y
property float z
property float nx
property float ny
property float nz
element face 10
property list uchar int vertex_indices
end_header
"""


def test_normals_stay_as_mitsubas_integrators_have_them(tmp_path):
    """Faces of an open box share their corners' normals, which Cycles would bend and Mitsuba does not."""
    corners = [(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    quads = [(0, 1, 3, 2), (5, 4, 6, 7), (4, 5, 1, 0), (2, 3, 7, 6), (4, 0, 2, 6)]
    rows = [f"{x} {y} {z} {x} {y} {z}" for x, y, z in corners]
    rows += [f"3 {a} {b} {c}\n3 {a} {c} {d}" for a, b, c, d in quads]
    (tmp_path / "box.ply").write_text(OPEN_BOX + "\n".join(rows) + "\n")
    text = write_scene(tmp_path, SKY, depth=3).read_text().replace("0, -4, 1", "1, 1.5, 5")
    text = text.replace('<shape type="sphere" id="target">', '<shape type="ply" id="target"><string name="filename" '
                        'value="box.ply"/>')  # fmt: skip
    (tmp_path / "scene.xml").write_text(text)
    renderer = load_renderer(tmp_path / "scene.xml", "target", model="mitsuba_principled", parameters=NAMES)
    from mfo_backend.render.paths.recorded_scene import RecordedScene  # needs the variant that the renderer sets

    x = renderer.table.pack({**VALUES, "base_color": (0.9, 0.9, 0.9), "metallic": 1.0})
    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    paths = scene.record(x, grid=16, seed=3, near=True)
    groups = paths.tile_groups()
    got = scene.evaluator(paths, groups)(x)[:, :, 0].sum(axis=0)
    np.testing.assert_allclose(got, groups.average(renderer.image(x, seed=7, spp=1024)).sum(axis=0), rtol=0.005)
