# SPDX-License-Identifier: Apache-2.0
"""What shadow rays meet between a point and a lamp: sheets that keep a share of the light, of whatever material."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mfo_backend.render.machine.variant import load_variant

VARIANT = load_variant()
LAMP = {"type": "point", "position": [0.0, 0.0, 10.0], "intensity": 1.0}


@pytest.fixture(autouse=True)
def _variant() -> None:
    if mi.variant() != VARIANT:
        mi.set_variant(VARIANT)


def passed(*keeps: float | None) -> np.ndarray:
    """What is left of a lamp's light behind sheets above each other with such an attribute (None: without one)."""
    from mfo_backend.render.transport.shadow_rays import SHADOW_TRANSMISSION, ShadowRays, sample_light

    sheets = {
        f"sheet_{k}": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate([0, 0, 1 + k]).scale(5),
            "bsdf": {"type": "diffuse"},
        }
        | ({} if keep is None else {SHADOW_TRANSMISSION: {"type": "uniform", "value": keep}})
        for k, keep in enumerate(keeps)
    }
    scene = mi.load_dict({"type": "scene", "lamp": LAMP, "floor": {"type": "rectangle"}, **sheets}, optimize=False)
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(0.1, 0.2, 0.5), mi.Vector3f(0.0, 0.0, -1.0)))
    _, light, *_ = sample_light(scene, ShadowRays(scene), si, mi.Point2f(0.5, 0.5), mi.Bool(True))
    free = scene.sample_emitter_direction(si, mi.Point2f(0.5, 0.5), False)[1]
    dr.eval(light, free)
    return np.array(light).ravel() / np.array(free).ravel()


@pytest.mark.parametrize(("bsdf", "lets"), [("diffuse", False), ("null", True)])
def test_only_what_light_passes_is_followed_surface_by_surface(bsdf, lets) -> None:
    from mfo_backend.render.transport import cycles_path
    from mfo_backend.render.transport.shadow_rays import ShadowRays

    cycles_path.register()
    sheet = {"type": "rectangle", "bsdf": {"type": bsdf}}
    scene = {"type": "scene", "integrator": {"type": "cycles_path"}, "lamp": LAMP, "sheet": sheet}
    shadows = ShadowRays(mi.load_dict(scene))
    assert shadows.lets_through is lets


@pytest.mark.parametrize(
    ("keeps", "left"),
    [
        ((), 1.0),
        ((None,), 0.0),
        ((1.0,), 1.0),
        ((0.4,), 0.4),
        ((0.5, 0.4), 0.2),
        ((0.0, 1.0), 0.0),
        ((1.0, None), 0.0),  # also one that was made after those that keep light
        ((None, 1.0), 0.0),
    ],
    ids=str,
)
def test_light_keeps_the_product_of_the_sheets(keeps, left) -> None:
    np.testing.assert_allclose(passed(*keeps), left, atol=1e-6)
