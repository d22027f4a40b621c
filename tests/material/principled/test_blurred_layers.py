# SPDX-License-Identifier: Apache-2.0
"""Layers with a least width, as a path that has met a rough surface sees them."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mfo_backend.material.principled.blender_principled import BLENDER_5_0
from mfo_backend.material.principled.layers import layer_stack
from mfo_backend.material.principled.needed_lobes import ALL_LOBES

ALPHAS = ("ax", "ay", "coat_alpha", "glass_alpha")


def values(layers, names):
    return {name: np.array(getattr(layers, name)).ravel() for name in names if getattr(layers, name) is not None}


@pytest.mark.parametrize("least", [0.0, 0.09, 0.5])
def test_no_lobe_is_narrower_and_wider_ones_stay(least):
    parameters = {"roughness": 0.3, "anisotropic": 0.6, "coat_weight": 1.0, "coat_roughness": 0.1,
                  "transmission_weight": 0.5}  # fmt: skip
    wi = dr.normalize(mi.Vector3f(0.3, 0.1, 0.8))
    layers = layer_stack({name: mi.Float(value) for name, value in parameters.items()}, wi, ALL_LOBES, BLENDER_5_0)
    before, after = values(layers, ALPHAS), values(layers.blurred(least), ALPHAS)
    assert set(before) == set(ALPHAS)
    for name in ALPHAS:
        np.testing.assert_array_equal(after[name], np.maximum(before[name], np.float32(least)))
    assert layers.blurred(least).base is layers.base
