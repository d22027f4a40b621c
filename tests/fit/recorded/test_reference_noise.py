# SPDX-License-Identifier: Apache-2.0
"""Oracle: pictures with noise of a known deviation."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

SIZE = 64


@pytest.fixture(scope="module")
def module():
    from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm

    if needs_llvm():
        configure_llvm()
    from mfo_backend.render.machine.variant import load_variant

    load_variant()
    from mfo_backend.fit.recorded import reference_noise as tile_noise
    from mfo_backend.render.camera.primary_rays import tile_order

    return SimpleNamespace(tile_noise=tile_noise.tile_noise, tile_order=tile_order)


def recording(module, side=4):
    """All pixels of a picture as a recording, and its tiles as groups."""
    pixel, _ = module.tile_order(SIZE, SIZE)
    row, column = np.divmod(pixel, SIZE)
    first = np.append(np.flatnonzero(np.diff(row // side * SIZE + column // side, prepend=-1)), len(pixel))
    groups = SimpleNamespace(pixels=pixel, first=first, __len__=lambda: len(first) - 1)
    return SimpleNamespace(pixel=pixel), groups


def smooth_picture() -> np.ndarray:
    y, x = np.mgrid[0:SIZE, 0:SIZE] / SIZE
    return 0.3 + 0.5 * x[..., None] * np.array([1.0, 0.8, 0.6]) + 0.4 * np.exp(-30 * ((x - 0.5) ** 2 + y**2)[..., None])


@pytest.mark.parametrize("side", [2, 4])
@pytest.mark.parametrize("relative", [0.02, 0.4])
def test_finds_the_deviation_of_tiles_below_a_misfit(module, relative, side):
    paths, groups = recording(module, side)
    assert len(groups.first) - 1 == (SIZE // side) ** 2
    true = smooth_picture()
    rng = np.random.default_rng(3)
    # three times as noisy in the right half, and a model that is 5 % off everywhere
    noise = relative * true * np.where(np.arange(SIZE) < SIZE // 2, 1.0, 3.0)[None, :, None]
    reference = (true + noise * rng.normal(size=true.shape)).astype(np.float32)
    model = (1.05 * true).reshape(-1, 3)[paths.pixel].astype(np.float32)
    found = module.tile_noise(reference, model, paths, groups, np.ones(SIZE * SIZE, bool), side)
    mean = np.sqrt(np.add.reduceat(np.square(noise).reshape(-1, 3)[paths.pixel], groups.first[:-1])) / side**2
    column = paths.pixel[groups.first[:-1]] % SIZE
    for half in (column < SIZE // 2 - 12, column > SIZE // 2 + 12):
        # 24 neighbours x 24 pairs leave 6 % a tile; radiance varies within the neighbourhood
        assert np.median(found.deviation[half] / mean[half]) == pytest.approx(1.0, abs=0.1)
        assert np.quantile(found.deviation[half] / mean[half], [0.05, 0.95]) == pytest.approx([1.0, 1.0], abs=0.3)
    assert found.level == pytest.approx(relative * np.sqrt(5.0), rel=0.15)  # root mean square of 1 and 3


def test_a_tiles_weight_does_not_know_its_own_noise(module):
    paths, groups = recording(module)
    true = smooth_picture().astype(np.float32)
    model = true.reshape(-1, 3)[paths.pixel]
    keep = np.ones(SIZE * SIZE, bool)
    reference = true * (1 + 0.1 * np.random.default_rng(0).normal(size=true.shape)).astype(np.float32)
    before = module.tile_noise(reference, model, paths, groups, keep).deviation
    firefly = reference.copy()
    firefly[21, 21] = 100.0
    after = module.tile_noise(firefly, model, paths, groups, keep).deviation
    own = np.flatnonzero(paths.pixel[groups.first[:-1]] == 20 * SIZE + 20)
    np.testing.assert_allclose(after[own], before[own], rtol=0.02)  # 0.02: it counts in the picture's median
    assert (after / before).max() > 20.0


def test_a_picture_without_noise_has_none(module):
    paths, groups = recording(module)
    true = smooth_picture().astype(np.float32)
    found = module.tile_noise(true, true.reshape(-1, 3)[paths.pixel], paths, groups, np.ones(SIZE * SIZE, bool))
    assert found.level == 0.0
    assert not found.deviation.any()
