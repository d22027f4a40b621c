# SPDX-License-Identifier: Apache-2.0
"""Fits of materials whose holes stay: a texture's, and an even alpha, which leaves no pixel without background."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.scene.exr_file import write_exr
from tests.fit.traced.glass import fit, load

TRUTH = {"base_color": (0.7, 0.4, 0.2), "roughness": 0.4, "metallic": 0.7}


@pytest.mark.parametrize("even", [False, True])
def test_values_of_a_material_with_holes_are_recovered(even, tmp_path):
    alpha = {"value": 0.6, "linked": not even}
    if not even:
        cells = np.random.default_rng(4).choice([0.0, 1.0], (4, 8, 1))
        write_exr(tmp_path / "alpha.exr", np.repeat(cells, 3, axis=2).astype(np.float32))
        alpha["texture"] = str(tmp_path / "alpha.exr")
    renderer = load(tmp_path, list(TRUTH), {"Alpha": alpha}, size=40)
    x = renderer.table.pack(TRUTH)
    result, _ = fit(renderer, renderer.image(x, seed=5, spp=64))
    assert [stage.name for stage in result.stages] == ["scan", "start", "refine"]
    np.testing.assert_allclose(renderer.table.pack(result.recovered), x, atol=0.1)  # at 64 samples a pixel
