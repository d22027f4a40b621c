# SPDX-License-Identifier: Apache-2.0
"""Whole fits under each of Blender's lights that Mitsuba has no equal of: the truth is found again."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.recover_material import recover_material
from mfo_backend.fit.settings import FitSettings
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.status import Status
from tests.render.scenes import LAMPS, write_scene

TRUTH = {"base_color": (0.7, 0.25, 0.1), "roughness": 0.35, "metallic": 0.3}
BESIDE = '<emitter type="constant"><rgb name="radiance" value="0.1, 0.1, 0.12"/></emitter>'


def fit(folder, name, preset, **options):
    materials = {"target_bsdf": {"name": "Ball", "distribution": "MULTI_GGX", "sockets": {}}}
    path = write_scene(folder, LAMPS[name] + BESIDE, size=24)
    renderer = load_renderer(path, "target", model="blender_principled", parameters=list(TRUTH), materials=materials)
    reference = renderer.image(renderer.table.pack(TRUTH), seed=5, spp=4096)
    settings = FitSettings(preset=preset, verify_spp=32, **options)
    outcome = recover_material(
        renderer, Image(reference, Encoding.LINEAR), settings, listener=lambda _: None, should_stop=lambda: False
    )
    return renderer, outcome.result


@pytest.mark.parametrize("name", LAMPS)
def test_the_truth_is_found_under_a_lamp(tmp_path, name):
    renderer, result = fit(tmp_path, name, "fast")
    assert result.status is Status.CONVERGED
    # a small picture of a ball under one light trades metallic for base colour: 0.03 of it is within its noise
    np.testing.assert_allclose(renderer.table.pack(result.recovered), renderer.table.pack(TRUTH), atol=0.05)
    assert result.errors["hdr_flip"][1] < 0.25 * result.errors["hdr_flip"][0]


@pytest.mark.parametrize("name", ["soft point", "spread"])
def test_adam_goes_downhill_under_a_lamp(tmp_path, name):
    """On pull-backs of the integrator, which are the same for all lamps."""
    _, result = fit(tmp_path, name, "paper", max_iterations=25)
    assert result.errors["mse"][1] < 0.5 * result.errors["mse"][0]
