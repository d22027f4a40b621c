# SPDX-License-Identifier: Apache-2.0
"""Packed lanes are the same in another place. Oracle: the lanes as they were recorded, to the last bit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mfo_backend.render.pictures.renderer import load_renderer
from tests.render.scenes import SKY, write_scene


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    path = write_scene(tmp_path_factory.mktemp("scene"), SKY, size=20)
    renderer = load_renderer(path, "target", model="mitsuba_principled", parameters=["base_color", "roughness"])
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    return scene, scene.record(renderer.start, grid=3, seed=1, near=False, samples=2)


@pytest.mark.parametrize("kind", ["pixels", "tiles", "some tiles", "one tile"])
def test_every_run_reads_what_it_read_before(recording, kind):
    import mitsuba as mi

    from mfo_backend.render.paths.packed_lanes import Lanes, packed

    _, paths = recording
    groups = paths.pixel_groups() if kind == "pixels" else paths.tile_groups()
    if kind.endswith(("some tiles", "one tile")):
        groups = groups.take(np.arange(1, len(groups), 3 if kind == "some tiles" else len(groups)))
    number = mi.Float(np.arange(paths.lanes, dtype=np.float32))  # a texture's value of each lane
    before = Lanes.as_recorded(paths, groups)
    before = replace(before, arrays=(*before.arrays, number))
    after = packed(before)
    runs = [np.arange(int(a), int(b)) for a, b in zip(before.start.numpy(), before.stop.numpy(), strict=True)]
    places = [
        np.arange(int(a), int(b), int(after.step[0]))
        for a, b in zip(after.start.numpy(), after.stop.numpy(), strict=True)
    ]
    assert list(map(len, runs)) == list(map(len, places))
    runs, places = np.concatenate(runs), np.concatenate(places)
    assert len(np.unique(places)) == len(runs)
    for old, new in zip(before.arrays, after.arrays, strict=True):
        np.testing.assert_array_equal(np.array(new)[..., places], np.array(old)[..., runs])


def test_neighbours_read_side_by_side_and_the_sums_are_the_same_bits(recording):
    from mfo_backend.render.paths.packed_lanes import BLOCK, Lanes, packed

    scene, paths = recording
    groups, x = paths.tile_groups(), scene.renderer.start
    before = Lanes.as_recorded(paths, groups)
    after = packed(before)
    assert np.all(np.diff(after.start.numpy().astype(int)[:BLOCK]) == 1)
    np.testing.assert_array_equal(scene.jacobian(x, before, groups), scene.jacobian(x, after, groups))


def test_lanes_are_packed_when_they_are_read_again(recording):
    from mfo_backend.render.paths.packed_lanes import LaneReader, Lanes

    _, paths = recording
    lanes = Lanes.as_recorded(paths, paths.tile_groups())
    reader = LaneReader(lanes)
    assert reader() is lanes
    packed = reader()
    assert packed is not lanes
    assert reader() is packed
