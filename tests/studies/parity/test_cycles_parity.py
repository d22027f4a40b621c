# SPDX-License-Identifier: Apache-2.0
"""The comparison with noise taken out, on pictures whose difference is known, and one exported scene against Cycles."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from studies.parity.cycles_parity import TABLE, compare, measure
from studies.parity.parity_scene import LIGHTS, MATERIALS

LIMIT = 0.5  # percent of the mean, the difference that is allowed between the renderers


def halves(picture: np.ndarray, noise: float, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    first, second = (picture * rng.gamma(1 / noise**2, noise**2, picture.shape) for _ in range(2))
    return first, second


@pytest.mark.parametrize("bias", [0.0, 0.01])
def test_noise_is_taken_out(bias: float) -> None:
    truth = np.random.default_rng(0).uniform(0.2, 1.0, (24, 24, 1, 3)).repeat(16, axis=2).reshape(24, 384, 3)
    truth = truth.repeat(16, axis=0)
    sign = np.where(np.arange(384) % 8 < 4, 1.0, -1.0)[None, :, None]  # ours is brighter here, darker there
    found = compare(halves(truth * (1 + bias * sign), 0.1, 1), halves(truth, 0.1, 2))
    # the noise of a block's mean and of the two renderers' difference is 0.1 / 4 * sqrt(2) / sqrt(2)
    assert found.noise == pytest.approx(0.025 * np.sqrt(2 / np.pi), rel=0.06)  # truth varies, 0.6 on average
    assert abs(found.level) < 4 * found.level_sd
    assert found.at_least <= bias + 1e-3
    # 9216 blocks: a third of one percent of noise^2 remains in the mean of the products
    assert bias <= found.at_most < bias + 0.005


def test_level_is_the_difference_of_the_means() -> None:
    truth = np.full((64, 64, 3), 0.5)
    found = compare(halves(truth * 1.02, 0.01, 3), halves(truth, 0.01, 4))
    assert found.level == pytest.approx(0.02, abs=4 * found.level_sd)
    assert found.level_sd < 5e-4
    # with noise of a sixth of the difference no sign is turned; 768 blocks with 0.0035 each
    assert found.at_least == pytest.approx(0.02, abs=5e-4)


@pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="the bpy module is not installed")
def test_exported_scene_is_that_of_cycles(tmp_path: Path) -> None:
    found, notes = measure("coated plastic", "area", tmp_path / "scene", size=32, samples=256, spp=256)
    assert notes == []
    assert abs(found.level) < max(LIMIT / 100, 3 * found.level_sd)
    # 64 blocks with a noise of 1.5 percent in the mean
    assert found.at_least < 0.01


def test_every_scene_of_the_table_is_within_the_limit() -> None:
    rows = [line.split("|")[1:-1] for line in TABLE.read_text("utf-8").splitlines() if line.count("|") == 7]
    cells = {(row[0].strip(), row[1].strip()): row[2:] for row in rows[2:]}
    assert set(cells) == {(material, light) for material in MATERIALS for light in LIGHTS}
    for level, mean, *_ in cells.values():
        number, deviation = (float(part) for part in level.split("±"))
        assert abs(number) < max(LIMIT, 2 * deviation)
        assert float(mean) < LIMIT
