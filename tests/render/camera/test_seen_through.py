# SPDX-License-Identifier: Apache-2.0
"""Rays that find a shape behind glass, in scenes where it is known which do."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from mfo_backend.render.machine.variant import load_variant

SIDE = 64


@pytest.fixture(autouse=True)
def _variant() -> None:
    load_variant()


def disk(name: str, radius: float, height: float, bsdf: Any) -> dict[str, Any]:
    matrix = mi.ScalarTransform4f().translate([0, 0, height]).scale([radius, radius, 1])
    return {name: {"type": "disk", "id": name, "to_world": matrix, "bsdf": bsdf}}


def found(*before: dict[str, Any]) -> np.ndarray:
    """Which of parallel rays from above, (y, x) over a square of 2 x 2, end on a disk of radius 0.5 at height zero."""
    from mfo_backend.render.camera.seen_through import seen_through

    scene: Any = {"type": "scene", "integrator": {"type": "path"}, "light": {"type": "constant"}}
    for shape in (disk("target", 0.5, 0.0, {"type": "twosided", "bsdf": {"type": "diffuse"}}), *before):
        scene |= shape
    scene = mi.load_dict(scene)
    along = (np.arange(SIDE) + 0.5) / SIDE * 2 - 1
    y, x = np.meshgrid(along, along, indexing="ij")
    ray = mi.Ray3f(mi.Point3f(x.ravel(), y.ravel(), np.full(SIDE**2, 5.0)), mi.Vector3f(0, 0, -1))
    target = next(shape for shape in scene.shapes() if shape.id() == "target")
    return np.array(seen_through(scene, mi.ShapePtr(target), ray)).reshape(SIDE, SIDE)


def circle(radius: float) -> np.ndarray:
    along = (np.arange(SIDE) + 0.5) / SIDE * 2 - 1
    return np.hypot(*np.meshgrid(along, along)) < radius


def test_pixels_of_what_is_seen_otherwise_but_for_what_is_before_it() -> None:
    """A catcher of radius 0.5, the middle of which is behind a plate, in a frame of 2 x 2 from straight above."""
    from mfo_backend.render.camera.seen_through import otherwise_pixels

    plain = {"type": "twosided", "bsdf": {"type": "diffuse"}}
    film = {"type": "hdrfilm", "width": SIDE, "height": SIDE, "rfilter": {"type": "box"}}
    above = mi.ScalarTransform4f().look_at(origin=[0, 0, 5], target=[0, 0, 0], up=[0, 1, 0])
    scene: Any = {"type": "scene", "sensor": {"type": "orthographic", "to_world": above, "film": film}}
    catcher, plate = disk("catcher", 0.5, 0.0, plain), disk("plate", 0.25, 1.0, plain)
    loaded = mi.load_dict(scene | catcher | plate)
    assert not otherwise_pixels(loaded, loaded.sensors()[0]).any()
    catcher["catcher"]["seen_otherwise"] = {"type": "uniform", "value": 1.0}
    loaded = mi.load_dict(scene | catcher | plate)
    found = otherwise_pixels(loaded, loaded.sensors()[0])
    ring = circle(0.5) & ~circle(0.25)
    assert found.shape == ring.shape
    edge = 2 / SIDE  # a pixel counts where a part of it does
    assert found[ring].all()
    assert not found[~circle(0.5 + edge) | circle(0.25 - edge)].any()


GLASS = {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0}


def test_nothing_before_it() -> None:
    np.testing.assert_array_equal(found(), circle(0.5))


@pytest.mark.parametrize("clear", [{"type": "thindielectric"}, {"type": "null"}])
def test_a_pane(clear: dict[str, Any]) -> None:
    """A path or two are drawn that are mirrored, 8 % of them; none beside the target finds it."""
    seen = found(disk("pane", 2.0, 1.0, clear))
    assert not seen[~circle(0.5)].any()
    assert seen[circle(0.5)].mean() > (0.88 if clear["type"] == "thindielectric" else 0.999)


def test_a_ball_of_glass_shows_more_than_lies_behind_it() -> None:
    """Half a radius behind a ball of index 1.5 its focus shows a disk of half its size all over it."""
    seen = found({"ball": {"type": "sphere", "center": [0, 0, 1.5], "radius": 0.9, "bsdf": GLASS}})
    lens = circle(0.6)
    assert seen[lens].mean() > 0.85
    assert not seen[~circle(0.9)].any()


def test_what_is_opaque_hides_it() -> None:
    assert not found(disk("lid", 2.0, 1.0, {"type": "twosided", "bsdf": {"type": "diffuse"}})).any()


def test_as_many_panes_as_a_ray_goes_through() -> None:
    from mfo_backend.render.camera.seen_through import MOST_SURFACES

    panes = [disk(f"pane_{k}", 2.0, 0.1 * (k + 1), {"type": "null"}) for k in range(MOST_SURFACES + 1)]
    assert found(*panes[:-1]).any()
    assert not found(*panes).any()


def test_the_numbers_are_of_rays_alone() -> None:
    """Two looks are the same."""
    pane = disk("pane", 2.0, 1.0, {"type": "thindielectric"})
    np.testing.assert_array_equal(found(pane), found(pane))
