# SPDX-License-Identifier: Apache-2.0
"""Values found by projection: of the subpixel that shows the point, of a neighbour, or those outside."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

HEIGHT, WIDTH = 4, 6
# a camera that looks down the z axis: column is x, row is y, at any distance
CAMERA = "1,0,0,0, 0,1,0,0, 0,0,0,1"


@pytest.fixture
def texture(tmp_path: Path) -> Any:
    from mfo_backend.material.plugins.projective_texture import register  # needs the variant

    register()
    row, column = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    positions = np.stack([column + 0.5, row + 0.5, np.zeros_like(row)], axis=-1)
    positions[:, -3:] = np.nan  # the surface ends after three columns
    values = np.stack([column, row, 10.0 * row + column], axis=-1)
    np.save(tmp_path / "positions.npy", positions)
    np.save(tmp_path / "values.npy", values)
    return mi.load_dict({
        "type": "projective", "filename": str(tmp_path / "values.npy"), "camera": CAMERA,
        "positions": str(tmp_path / "positions.npy"), "outside": mi.ScalarColor3f(7.0, 8.0, 9.0),
    })  # fmt: skip


def at(texture: Any, *points: tuple[float, float, float]) -> np.ndarray:
    si = dr.zeros(mi.SurfaceInteraction3f, len(points))
    si.p = mi.Point3f(*(mi.Float(list(axis)) for axis in zip(*points, strict=True)))
    return np.array(texture.eval(si, mi.Bool(True))).T


def test_a_point_has_the_value_of_its_subpixel(texture: Any) -> None:
    found = at(texture, (0.1, 0.9, 0.0), (2.9, 3.2, 0.0), (1.5, 2.5, 0.3))
    np.testing.assert_array_equal(found, [[0, 0, 0], [2, 3, 32], [1, 2, 21]])


def test_of_two_sides_in_one_subpixel_the_nearer_counts(tmp_path: Path) -> None:
    """At a rim each lies within the other's reach: a far side had the near one's values."""
    from mfo_backend.material.plugins.projective_texture import register

    register()
    row, column = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    both = [np.stack([column + 0.5, row + 0.5, np.full_like(row, z)], axis=-1) for z in (0.0, 1.5)]
    np.save(tmp_path / "positions.npy", np.concatenate(both))
    values = np.repeat(np.array((1.0, 2.0), np.float32), HEIGHT)[:, None, None]
    np.save(tmp_path / "values.npy", np.broadcast_to(values, (2 * HEIGHT, WIDTH, 1)))
    texture = mi.load_dict({
        "type": "projective", "filename": str(tmp_path / "values.npy"), "camera": CAMERA, "depths": 2,
        "positions": str(tmp_path / "positions.npy"), "outside": 7.0,
    })  # fmt: skip
    found = at(texture, *((2.5, 1.5, z) for z in (-0.5, 0.0, 0.7, 0.8, 1.5, 2.0, 9.0)))
    np.testing.assert_array_equal(found[:, 0], [1, 1, 1, 2, 2, 2, 7])


def test_just_beside_the_surface_a_neighbour_counts(texture: Any) -> None:
    np.testing.assert_array_equal(at(texture, (3.2, 1.5, 0.0)), [[2, 1, 12]])


def test_behind_it_beside_it_and_outside_of_the_picture_nothing_is_seen(texture: Any) -> None:
    found = at(texture, (1.5, 1.5, 40.0), (5.9, 1.5, 0.0), (-9.5, 1.5, 0.0), (1.5, 13.5, 0.0))
    np.testing.assert_array_equal(found, [[7, 8, 9]] * 4)


def test_beside_the_picture_the_surface_goes_on(texture: Any) -> None:
    """As far as a pixel filter looks, where it is about as far from what the picture shows at its edge."""
    found = at(texture, (-0.5, 1.5, 0.0), (1.5, 7.5, 0.0), (-1.5, -0.5, 0.0), (-0.5, 1.5, 9.0))
    np.testing.assert_array_equal(found, [[0, 1, 10], [1, 3, 31], [0, 0, 0], [7, 8, 9]])


def test_other_values_have_their_own_for_what_is_not_seen(texture: Any) -> None:
    """What a fit shows next: beside the surface there is the mean of the new values, or what was there before."""
    values = np.full((HEIGHT, WIDTH, 3), 0.5, np.float32)
    texture.show(values)
    np.testing.assert_array_equal(at(texture, (0.5, 0.5, 0.0), (5.9, 1.5, 0.0)), [[0.5] * 3, [7, 8, 9]])
    np.testing.assert_array_equal(texture.outside, [7, 8, 9])
    texture.show(values, outside=np.array((0.25, 0.5, 0.75), np.float32))
    np.testing.assert_array_equal(at(texture, (0.5, 0.5, 0.0), (5.9, 1.5, 0.0)), [[0.5] * 3, [0.25, 0.5, 0.75]])
    texture.show(values, outside=np.array((0.125,), np.float32))  # of one number
    np.testing.assert_array_equal(at(texture, (5.9, 1.5, 0.0)), [[0.125] * 3])


PERSPECTIVE = "1,0,0,0, 0,1,0,0, 0,0,1,5"  # from z = -5


def seen_along(direction: tuple[float, float, float]) -> Any:
    """A hit of the plane z = 0 whose mesh looks to the camera, by a ray that came from there."""
    si = dr.zeros(mi.SurfaceInteraction3f, 1)
    si.p, si.n = mi.Point3f(1.5, 1.5, 0.0), mi.Normal3f(0.0, 0.0, -1.0)
    si.sh_frame = mi.Frame3f(mi.Vector3f(0.0, 0.0, -1.0))
    si.wi = si.to_local(dr.normalize(mi.Vector3f(*direction)))  # pyright: ignore[reportArgumentType]
    return si


@pytest.mark.parametrize("camera", [CAMERA, PERSPECTIVE])
def test_a_bump_is_mirrored_on_the_side_that_the_camera_does_not_see(tmp_path: Path, camera: str) -> None:
    from mfo_backend.material.plugins import principled_plugin, projective_texture

    projective_texture.register()
    principled_plugin.register()
    row, column = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    depth = 5.0 if camera == PERSPECTIVE else 1.0
    positions = np.stack([(column + 0.5) * depth, (row + 0.5) * depth, np.zeros_like(row)], axis=-1)
    np.save(tmp_path / "positions.npy", positions)
    np.save(tmp_path / "normals.npy", np.tile(np.array((0.6, 0.0, -0.8), np.float32), (HEIGHT, WIDTH, 1)))
    bsdf: Any = mi.load_dict({
        "type": "blender_principled",
        "normal": {"type": "projective", "filename": str(tmp_path / "normals.npy"), "camera": camera,
                   "positions": str(tmp_path / "positions.npy"), "outside": mi.ScalarColor3f(0.0)},
    })  # fmt: skip
    for z in (-1.0, 1.0):
        frame, _, normals = bsdf.bumped_frame(seen_along((0.2, 0.1, z)), mi.Bool(True))
        found = np.array(frame.to_world(normals["bumped_normal"])).ravel()
        np.testing.assert_allclose(found, (0.6, 0.0, 0.8 * z), atol=1e-6)
        mesh = bsdf.directions_at(seen_along((0.2, 0.1, z)), mi.Bool(True))["geometric_normal"]
        np.testing.assert_allclose(np.array(frame.to_world(mesh)).ravel(), (0.0, 0.0, z), atol=1e-6)
