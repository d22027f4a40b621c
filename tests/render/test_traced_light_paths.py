# SPDX-License-Identifier: Apache-2.0
"""Filter Glossy and clamping on traced paths through glass. Oracle: the integrator `cycles_path` on the same scene."""

from __future__ import annotations

import re

import numpy as np
import pytest

from mfo_backend.render.renderer import load_renderer
from mfo_backend.types.light_paths import LightPaths
from tests.render.scenes import FLOOR, SKY, write_scene

MATERIALS = {
    "target_bsdf": {
        "name": "Glass",
        "sockets": {"Transmission Weight": {"value": 1.0}, "Roughness": {"value": 0.15}},
    },
    "floor_bsdf": {"name": "Floor", "sockets": {"Metallic": {"value": 1.0}, "Roughness": {"value": 0.15}}},
}
LAMP = """<shape type="sphere"><point name="center" x="1" y="-1" z="2.5"/><float name="radius" value="0.5"/>
<emitter type="area"><rgb name="radiance" value="15, 14, 12"/></emitter></shape>"""


def pictures(folder, light_paths):
    """The pixels on the target by traced paths, and by the integrator."""
    shining = re.sub(r'<bsdf type="diffuse">.*?</bsdf>', '<ref id="floor_bsdf"/>', FLOOR)
    scene = '<bsdf type="principled" id="floor_bsdf"/>' + shining + SKY + LAMP
    path = write_scene(folder, scene, size=16, depth=6)
    path.write_text(re.sub(r'<bsdf type="twosided" id="target_bsdf">(.*?)</bsdf></bsdf>',
                           r'<bsdf type="principled" id="target_bsdf"/>', path.read_text(), flags=re.S))  # fmt: skip
    renderer = load_renderer(
        path,
        "target",
        model="blender_principled",
        parameters=["roughness"],
        materials=MATERIALS,
        light_paths=light_paths,
    )
    from mfo_backend.render.traced_paths import TracedPaths

    pixels = np.flatnonzero(renderer.target_mask().ravel())
    traced = TracedPaths(renderer).images(renderer.start, pixels, seed=1, samples=1024, jacobian=False)[0, :, :, 0]
    drawn = [renderer.image(renderer.start, seed=seed, spp=256).reshape(-1, 3)[pixels] for seed in range(4)]
    return traced, np.mean(drawn, axis=0)


def test_they_hold_the_light_of_the_integrator(tmp_path):
    found = {}
    for name, light_paths in (
        ("off", LightPaths()),
        ("filter", LightPaths(filter_glossy=20.0)),
        ("clamp", LightPaths(clamp_indirect=0.5)),
    ):
        traced, drawn = pictures(tmp_path, light_paths)
        assert traced.mean() == pytest.approx(drawn.mean(), rel=0.015)  # noise of both
        found[name] = traced, drawn
    # equal random numbers in both pictures leave less noise in the effect than in either
    for name in ("filter", "clamp"):
        traced, drawn = (found[name][k].mean() - found["off"][k].mean() for k in (0, 1))
        assert traced == pytest.approx(drawn, rel=0.2)
        assert abs(drawn) > 0.01 * found["off"][1].mean()
