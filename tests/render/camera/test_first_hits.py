# SPDX-License-Identifier: Apache-2.0
"""Targets with holes on recorded paths. Oracle: the path tracer, which draws at each surface whether to go on."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.scene.exr_file import read_exr, write_exr
from mfo_backend.types.errors import UnrecordableError
from mfo_backend.types.light_paths import LightPaths
from tests.render.scenes import AREA, FLOOR, POINT, SKY, write_scene

NAMES = ["base_color", "roughness"]
VALUES = {"base_color": (0.7, 0.3, 0.1), "roughness": 0.4}


@pytest.fixture
def holes(tmp_path):
    """Clear, half clear and opaque cells, as a texture."""
    path = tmp_path / "alpha.exr"
    cells = np.random.default_rng(2).choice([0.0, 0.4, 1.0], (6, 12, 1))
    write_exr(path, np.repeat(cells, 3, axis=2).astype(np.float32))
    return path


def load(folder, lights, alpha, *, names=NAMES, mixed=None, **limits):
    """A ball with this alpha, 0.6 or a texture; `mixed` with Transparent of that grey or colour it is its share."""
    share = {"value": 0.6, "linked": alpha is not None, "texture": alpha and str(alpha)}
    material = {"name": "Leaf", "distribution": "MULTI_GGX", "sockets": {}}
    if mixed is None:
        material["sockets"]["Alpha"] = share
    else:
        clear = {"value": 0.4, "linked": False}
        if alpha is not None:
            write_exr(folder / "clear.exr", 1.0 - read_exr(alpha).pixels)
            clear |= {"linked": True, "texture": str(folder / "clear.exr")}
        leaf = {"shader": "transparent", "sockets": {"Base Color": {"value": mixed, "linked": False}}}
        material |= {"weight": share, "leaves": [leaf | {"weight": clear}]}
    materials = {"target_bsdf": material}
    path = write_scene(folder, lights, size=16, depth=8)
    return load_renderer(
        path, "target", model="blender_principled", parameters=names, materials=materials,
        light_paths=LightPaths(**limits),
    )  # fmt: skip


def recorded(renderer):
    """The recording's picture, that of the path tracer, and which pixels the first has."""
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    x = renderer.table.pack(VALUES)
    paths = scene.record(x, grid=20, seed=3, near=True)
    groups = paths.pixel_groups()
    return scene.evaluator(paths, groups)(x)[:, :, 0], renderer.image(x, seed=7, spp=2048).reshape(-1, 3)[groups.pixels]


@pytest.mark.parametrize("lights", [POINT + SKY, AREA], ids=["point and sky", "lamps"])
@pytest.mark.parametrize("textured", [False, True])
@pytest.mark.parametrize("mixed", [None, [0.7, 0.7, 0.7]], ids=["alpha", "transparent"])
def test_what_shows_through_holes_is_as_path_traced(lights, textured, mixed, holes, tmp_path):
    """The far side of the ball, the floor and the sky behind it."""
    got, expected = recorded(load(tmp_path, lights + FLOOR, holes if textured else None, mixed=mixed))
    assert got.mean(axis=0) == pytest.approx(expected.mean(axis=0), rel=0.01)
    error = np.sqrt(np.mean((got - expected) ** 2) / np.mean(expected**2))
    assert error < 0.05  # half a pixel of 400 rays is left to chance


IN_FRONT = """<emitter type="blender_area"><transform name="to_world"><scale x="0.2" y="0.2"/><lookat
origin="0.3, -2, 0.6" target="0, -4, 1" up="0, 0, 1"/></transform><rgb name="radiance" value="3, 2, 1"/>
<boolean name="camera" value="true"/></emitter>"""


def test_a_lamp_before_a_hole_is_seen(holes, tmp_path):
    """A ray that goes on behind the hole has met it already."""
    got, expected = recorded(load(tmp_path, SKY + IN_FRONT + FLOOR, holes))
    dark, _ = recorded(load(tmp_path, SKY + FLOOR, holes))
    assert expected.mean() > 1.1 * dark.mean()
    assert got.mean(axis=0) == pytest.approx(expected.mean(axis=0), rel=0.01)


def test_nothing_is_seen_behind_more_holes_than_light_may_pass(tmp_path):
    got, expected = recorded(load(tmp_path, SKY + FLOOR, None, transparent_bounces=1))
    assert got.mean(axis=0) == pytest.approx(expected.mean(axis=0), rel=0.01)
    more, _ = recorded(load(tmp_path, SKY + FLOOR, None))
    assert more.mean() > 1.1 * got.mean()


def test_holes_that_change_are_not_recorded(tmp_path):
    renderer = load(tmp_path, SKY, None, names=[*NAMES, "alpha"])
    from mfo_backend.render.paths.recorded_scene import RecordedScene

    with pytest.raises(UnrecordableError, match="'alpha'"):
        RecordedScene(renderer, 1)
    with pytest.raises(UnrecordableError, match="lets light through"):
        RecordedScene(load(tmp_path, SKY, None, mixed=[0.9, 0.5, 0.5]), 1)
