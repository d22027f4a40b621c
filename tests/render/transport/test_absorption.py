# SPDX-License-Identifier: Apache-2.0
"""Light inside of an absorbing ball that bends nothing: its picture is an exponential, and so are its derivatives."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.render.pictures.renderer import load_renderer
from tests.render.scenes import SKY, write_scene

NAMES = ["roughness", "absorption_density", "absorption_color"]
VALUES = {"roughness": 0.2, "absorption_density": 0.8, "absorption_color": (0.2, 0.6, 0.9)}
# of index 1 but for what keeps a fit's bounds: nothing is reflected or bent
CLEAR = {"Base Color": [1.0, 1.0, 1.0], "Transmission Weight": 1.0, "IOR": 1.0001, "Absorption Density": 1.0}


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    folder = tmp_path_factory.mktemp("scene")
    sockets = {name: {"value": value, "linked": name == "IOR"} for name, value in CLEAR.items()}
    materials = {"target_bsdf": {"name": "Tea", "distribution": "GGX", "sockets": sockets}}
    path = write_scene(folder, SKY, size=16, depth=8)
    return load_renderer(path, "target", model="blender_principled", parameters=NAMES, materials=materials)


def chords(renderer) -> np.ndarray:
    """Mean transmittance by the true lengths within a ball of radius 1 that the camera's middle ray goes through."""
    values = {name: np.array(value) for name, value in VALUES.items()}
    return np.exp(-2.0 * values["absorption_density"] * (1.0 - values["absorption_color"]))


def test_the_middle_of_the_picture_has_lost_what_its_way_takes(ball):
    x = ball.table.pack(VALUES)
    shown = ball.image(x, seed=1, spp=256)[7:9, 7:9].mean(axis=(0, 1))
    np.testing.assert_allclose(shown / [0.6, 0.8, 1.0], chords(ball), rtol=0.02)  # pixels beside the middle: 1 %


def test_derivatives_of_paths_are_those_of_the_picture_by_both_integrators(ball):
    from mfo_backend.render.traced.traced_paths import TracedPaths

    paths, pixels, x = TracedPaths(ball), np.arange(256), ball.table.pack(VALUES)
    columns = paths.images(x[None], pixels, seed=1, samples=256, jacobian=True)[0].sum(axis=0)
    _, pullback = ball.image_and_pullback(x, seed=2, spp=256)
    replayed = pullback(np.ones((16, 16, 3), np.float32))
    start = ball.table.slice_of("absorption_density").start
    for k in range(start, ball.table.length):
        h = np.zeros_like(x)
        h[k] = 0.01
        low, high = paths.images(np.array([x - h, x + h]), pixels, seed=1, samples=256, jacobian=False)[..., 0]
        expected = (high - low).sum(axis=0) / 0.02
        np.testing.assert_allclose(columns[:, 1 + k], expected, rtol=1e-3, atol=1e-2)
        np.testing.assert_allclose(replayed[k], expected.sum(), rtol=0.01)
