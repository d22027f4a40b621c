# SPDX-License-Identifier: Apache-2.0
"""Light below surfaces. Oracles: what a furnace gives back, and pictures against recordings, which share the walk only.

Cycles is the oracle in tests/export/materials/test_subsurface.py."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mfo_backend.render.paths.recorded_scene import RecordedScene
from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.light_paths import LightPaths
from tests.render.scenes import POINT, SKY, write_scene

WHITE_SKY = """<emitter type="constant"><rgb name="radiance" value="1, 1, 1"/></emitter>"""
# of no object: a ball inside of the target
CORE = """<shape type="sphere" id="core"><float name="radius" value="0.9"/>
<bsdf type="diffuse"><rgb name="reflectance" value="0, 0, 0"/></bsdf></shape>"""


def below(**values: Any) -> dict[str, Any]:
    given = {"Subsurface Weight": 1.0, "Subsurface Scale": 0.5, "Specular IOR Level": 0.0, **values}
    sockets = {name: {"value": value} for name, value in given.items()}
    return {"target_bsdf": {"name": "Wax", "distribution": "MULTI_GGX", "sockets": sockets}}


def load(
    folder: Path, lights: str, materials: dict[str, Any], size: int = 16, parameters: Sequence[str] = ("base_color",)
) -> Any:
    return load_renderer(
        write_scene(folder, lights, size=size), "target", model="blender_principled", parameters=list(parameters),
        materials=materials, light_paths=LightPaths(),
    )  # fmt: skip


def recorded(renderer: Any, vector: Any, made_for: Any, *, near: bool) -> tuple[Any, Any]:
    """Radiance of pixels inside of the target by walks that were `made_for` a material, and their places."""
    scene = RecordedScene(renderer, int(renderer.target_mask().sum()))
    found = []
    for seed in range(8):
        paths = scene.record(made_for, grid=10, seed=seed, near=near)
        groups = paths.pixel_groups(paths.interior)
        found.append(np.asarray(scene.pictures(paths, groups)(vector))[:, :, 0])
    return np.mean(found, axis=0), groups.pixels


def test_nothing_is_lost_in_a_furnace(tmp_path: Path) -> None:
    """A white ball in white light is as bright as the sky but for walks that are too long and views that graze."""
    white = below(**{"Base Color": [1.0, 1.0, 1.0], "Roughness": 0.0, "Subsurface Radius": [1.0, 1.0, 1.0]})
    renderer = load(tmp_path, WHITE_SKY, white)
    mask = renderer.target_mask()
    picture = renderer.image(renderer.start, seed=0, spp=64)
    inner = picture[mask & (picture.min(axis=2) > 0.5)]
    assert 0.9 < inner.mean() < 1.0


@pytest.mark.parametrize("lights", [POINT, SKY], ids=["point", "sky"])
@pytest.mark.parametrize("g", [0.0, 0.6])
def test_a_recording_is_the_picture(tmp_path: Path, lights: str, g: float) -> None:
    wax = below(**{"Base Color": [0.8, 0.5, 0.2], "Subsurface Anisotropy": g, "Specular IOR Level": 0.5})
    renderer = load(tmp_path, lights, wax)
    found, pixels = recorded(renderer, renderer.start, renderer.start, near=True)
    picture = renderer.image(renderer.start, seed=0, spp=1024).reshape(-1, 3)[pixels]
    np.testing.assert_allclose(found.mean(axis=0), picture.mean(axis=0), rtol=0.02)


def test_walks_for_one_colour_tell_another(tmp_path: Path) -> None:
    renderer = load(tmp_path, POINT, below(**{"Base Color": [0.6, 0.4, 0.3]}))
    other = np.array([0.75, 0.3, 0.4])
    found, pixels = recorded(renderer, other, renderer.start, near=False)
    picture = renderer.image(other, seed=0, spp=256).reshape(-1, 3)[pixels]
    np.testing.assert_allclose(found.mean(axis=0), picture.mean(axis=0), rtol=0.03)


def test_walks_pass_what_is_of_another_object(tmp_path: Path) -> None:
    """A black ball just below the surface changes nothing; it would take most of the light."""
    wax = below(**{"Base Color": [0.8, 0.8, 0.8], "Subsurface Radius": [3.0, 3.0, 3.0]})
    (tmp_path / "with").mkdir()
    (tmp_path / "without").mkdir()
    scenes = [load(tmp_path / "with", POINT + CORE, wax), load(tmp_path / "without", POINT, wax)]
    means = [scene.image(scene.start, seed=0, spp=256)[scene.target_mask()].mean() for scene in scenes]
    assert means[0] == pytest.approx(means[1], rel=0.02)


def test_an_eye_sees_that_light_travels(tmp_path: Path) -> None:
    """The terminator of a ball is soft and red where red light goes far, and that of its Lambert stand-in is not."""
    wax = below(**{"Base Color": [0.7, 0.7, 0.7], "Subsurface Scale": 2.0})
    renderer = load(tmp_path, POINT, wax, size=32)
    picture = renderer.image(renderer.start, seed=0, spp=64)
    dark = renderer.target_mask() & (picture[..., 2] < 0.05 * picture[..., 2].max())
    assert picture[dark][:, 0].mean() > 3.0 * picture[dark][:, 2].mean()


@pytest.mark.parametrize("lights", [POINT, SKY], ids=["point", "sky"])
@pytest.mark.parametrize("free", ["metallic", "coat_weight"])
def test_a_metal_with_subsurface_has_no_walks(tmp_path: Path, lights: str, free: str) -> None:
    """No light goes below a metal, which may become wax or not; a recording of it is its picture, as any other."""
    renderer = load(tmp_path, lights, below(Metallic=1.0, Roughness=0.5), parameters=[free])
    found, pixels = recorded(renderer, renderer.start, renderer.start, near=True)
    picture = renderer.image(renderer.start, seed=0, spp=1024).reshape(-1, 3)[pixels]
    np.testing.assert_allclose(found.mean(axis=0), picture.mean(axis=0), rtol=0.02)
