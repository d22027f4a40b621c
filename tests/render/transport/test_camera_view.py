# SPDX-License-Identifier: Apache-2.0
"""Shapes that the camera does not see, against the same scene without them and against their place in it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest


@pytest.fixture(scope="module")
def mi() -> Any:
    import mitsuba

    mitsuba.set_variant("llvm_ad_rgb")
    return mitsuba


def scene_of(mi: Any, *, hidden: tuple[float, ...], seen: tuple[float, ...]) -> Any:
    """Squares of two by two across the z axis at these heights; the hidden ones are marked."""
    from mfo_backend.render.transport.camera_view import CAMERA_HIDDEN

    def square(z: float) -> dict[str, Any]:
        return {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0.0, 0.0, z])}

    mark = {CAMERA_HIDDEN: {"type": "uniform", "value": 1.0}}
    shapes = {f"hidden_{k}": square(z) | mark for k, z in enumerate(hidden)}
    return mi.load_dict({"type": "scene"} | shapes | {f"seen_{k}": square(z) for k, z in enumerate(seen)})


def test_camera_rays_pass_what_is_hidden_and_others_do_not(mi: Any) -> None:
    from mfo_backend.render.transport.camera_view import CameraView

    scene = scene_of(mi, hidden=(3.0, 2.5, 1.0), seen=(2.0, 0.0))
    view = CameraView(scene)
    assert view.hides
    # down the axis, beside the squares, and from below the first square that is seen
    origins = mi.Point3f([0.3, 5.0, -0.2], [0.1, 0.0, 0.4], [4.0, 4.0, 1.5])
    ray = mi.Ray3f(origins, mi.Vector3f(0.0, 0.0, -1.0))
    first = view.met(ray)
    np.testing.assert_allclose(np.array(first.t), [2.0, np.inf, 1.5], rtol=1e-5)
    points = np.array(first.compute_surface_interaction(ray, mi.RayFlags.All).p)
    np.testing.assert_allclose(points[:, [0, 2]], [[0.3, -0.2], [0.1, 0.4], [2.0, 0.0]], atol=1e-5)
    bounced = view.met(ray, straight=mi.Bool([False, True, True]))
    np.testing.assert_allclose(np.array(bounced.t), [1.0, np.inf, 1.5], rtol=1e-5)


def test_clipping_holds_behind_what_is_hidden(mi: Any) -> None:
    from mfo_backend.render.transport.camera_view import CameraView

    view = CameraView(scene_of(mi, hidden=(3.0,), seen=(0.0,)))
    ray = mi.Ray3f(mi.Point3f(0.0, 0.0, 4.0), mi.Vector3f(0.0, 0.0, -1.0))
    for far, met in ((3.9, False), (4.1, True)):
        ray.maxt = far
        assert bool(view.met(ray).is_valid()[0]) == met


def test_nothing_hidden_asks_nothing(mi: Any) -> None:
    from mfo_backend.render.transport.camera_view import CameraView

    view = CameraView(scene_of(mi, hidden=(), seen=(1.0,)))
    assert not view.hides
    assert float(view.met(mi.Ray3f(mi.Point3f(0.0, 0.0, 4.0), mi.Vector3f(0.0, 0.0, -1.0))).t[0]) == pytest.approx(3.0)
