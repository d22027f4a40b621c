# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mfo_backend.render.pictures.renderer import load_renderer
from tests.render.scenes import AREA, FLOOR, LAMPS, POINT, SKY, SUN_AND_SPOT, write_scene


def load(folder: Path, lights: str, *, depth: int = 2, **more: Any) -> Any:
    path = write_scene(folder, lights + FLOOR, depth=depth, **more)
    return load_renderer(path, "target", model="mitsuba_principled", parameters="all")


@pytest.mark.parametrize("whole", [False, True])
@pytest.mark.parametrize("rfilter", ["box", "gaussian"])
@pytest.mark.parametrize("lights", [POINT, SUN_AND_SPOT])
def test_direct_light_of_lamps_is_that_of_prb_to_the_bit(
    tmp_path: Path, lights: str, rfilter: str, whole: bool
) -> None:
    renderer = load(tmp_path, lights, rfilter=rfilter)
    assert renderer._of_pictures is not renderer._integrator
    vector = 0.5 * (renderer.table.lower + renderer.table.upper)
    pixels = np.flatnonzero(renderer.target_mask())

    def render() -> Any:
        if whole:
            return renderer.image(vector, seed=7, spp=4)
        return renderer.pixels_later(vector, pixels, seed=7, spp=4)()

    picture = render()
    renderer._of_pictures, renderer._of_pixels = renderer._integrator, None
    expected = render()
    assert expected.max() > 0.1
    np.testing.assert_array_equal(picture, expected)


@pytest.mark.parametrize(
    ("lights", "depth"),
    [(POINT, 3), (POINT, -1), (SKY, 2), (AREA, 2), (POINT + SKY, 2), (LAMPS["sphere"], 2), (LAMPS["sharp spot"], 2)],
)
def test_where_a_bounce_can_meet_light_it_is_traced(tmp_path: Path, lights: str, depth: int) -> None:
    renderer = load(tmp_path, lights, depth=depth)
    assert renderer._of_pictures is renderer._scene.integrator()
