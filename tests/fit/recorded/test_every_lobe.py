# SPDX-License-Identifier: Apache-2.0
"""A fit of each lobe of Blender's model runs to its end, by all the kernels that it makes, and finds the picture."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.recover_material import recover_material
from mfo_backend.fit.settings import FitSettings
from mfo_backend.material.principled.principled_parameters import parameter_to_socket
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.status import Status
from tests.material.materials import MATERIALS
from tests.render.scenes import POINT, SKY, write_scene

OPAQUE = {name: values for name, values in MATERIALS.items() if "transmission_weight" not in values}


# the sky is nearly the same from all sides, and the target fills nine tiles: materials are hardly told apart
@pytest.mark.parametrize(("lights", "most"), [(POINT, 0.05), (SKY, 0.15)], ids=["lamp", "sky"])
@pytest.mark.parametrize("name", OPAQUE)
def test_a_fit_of_each_lobe_ends_at_its_picture(tmp_path, name, lights, most):
    sockets = {parameter_to_socket(key): value for key, value in OPAQUE[name].items()}
    start = sockets | {"Base Color": (0.5, 0.5, 0.5), "Roughness": 0.6}
    materials = {"target_bsdf": {"sockets": {key: {"value": value} for key, value in start.items()}}}
    renderer = load_renderer(
        write_scene(tmp_path, lights, size=24), "target", model="blender_principled", parameters="all",
        materials=materials,
    )  # fmt: skip
    truth = renderer.table.pack(renderer.table.unpack(renderer.start) | OPAQUE[name])
    reference, mask = renderer.image(truth, seed=5, spp=512), renderer.target_mask()
    outcome = recover_material(
        renderer, Image(reference, Encoding.LINEAR), FitSettings(preset="fast"),
        listener=lambda event: None, should_stop=lambda: False,
    )  # fmt: skip
    assert outcome.result.status is Status.CONVERGED
    found = renderer.image(renderer.table.pack(outcome.result.recovered), seed=5, spp=512)
    error = np.sqrt(np.mean((found - reference)[mask] ** 2) / np.mean(reference[mask] ** 2))
    assert error < most
