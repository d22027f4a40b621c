# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba texture of what a mix emits: the sum of its leaves."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest


def radiance(**properties: Any) -> np.ndarray:
    from mfo_backend.material.plugins.leaf_radiance import register

    register()
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.uv = mi.Point2f(0.25, 0.25)
    return np.array(mi.load_dict({"type": "leaf_radiance"} | properties).eval(si, mi.Bool(True))).ravel()


def colour(*value: float) -> dict[str, Any]:
    return {"type": "rgb", "value": list(value)}


@pytest.mark.parametrize("scale", [1.0, 0.25])
def test_the_leaves_are_summed_by_colour_strength_and_weight(scale: float) -> None:
    first = {"color_0": colour(1.0, 0.5, 0.0), "strength_0": 4.0, "weight_0": 0.5}
    second = {"color_1": colour(0.2, 0.2, 0.6), "strength_1": 2.0, "weight_1": 0.25}
    found = radiance(**first, **second, scale=scale)
    np.testing.assert_allclose(found, scale * np.array([2.1, 1.1, 0.3]), rtol=1e-5)


def test_no_light_is_negative() -> None:
    np.testing.assert_array_equal(radiance(color_0=colour(1.0, 1.0, 1.0), strength_0=-2.0, weight_0=1.0), 0.0)
