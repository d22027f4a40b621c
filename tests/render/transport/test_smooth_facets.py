# SPDX-License-Identifier: Apache-2.0
"""Normals bent to the side that is seen: by what they are to do, a mirrored view just above the triangle.

Directions that leave on their own side of a triangle: by signs.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mfo_backend.render.machine.variant import load_variant

VARIANT, COUNT = load_variant(), 2000
# all that the rules ask a scene for
OF_CYCLES: Any = SimpleNamespace(integrator=lambda: SimpleNamespace(transparent_bounces=8, own_normals=False))
TELLING: Any = SimpleNamespace(integrator=lambda: SimpleNamespace(transparent_bounces=8, own_normals=True))


@pytest.fixture(autouse=True)
def _variant() -> None:
    if mi.variant() != VARIANT:
        mi.set_variant(VARIANT)


def unit(z_from: float, seed: int) -> np.ndarray:
    """Directions (3, COUNT) whose z is at least `z_from`."""
    draw = np.random.default_rng(seed)
    z, turn = draw.uniform(z_from, 1.0, COUNT), draw.uniform(0.0, 2.0 * np.pi, COUNT)
    return np.stack([np.sqrt(1.0 - z**2) * np.cos(turn), np.sqrt(1.0 - z**2) * np.sin(turn), z])


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["front", "back"])
def test_the_mirrored_view_is_above_the_triangle(side: float) -> None:
    from mfo_backend.render.transport.smooth_facets import seen_side

    view, normal = side * unit(0.02, 1), unit(0.3, 2)
    si = dr.zeros(mi.SurfaceInteraction3f, COUNT)
    si.n = mi.Normal3f(0.0, 0.0, 1.0)
    si.sh_frame = mi.Frame3f(mi.Vector3f(*normal))
    before = np.array(si.sh_frame.s)
    si.wi = si.to_local(mi.Vector3f(*view))
    found = seen_side(OF_CYCLES, si)
    s, t, n = (np.array(axis) for axis in (found.sh_frame.s, found.sh_frame.t, found.sh_frame.n))
    least = np.minimum(0.9 * np.abs(view[2]), 0.01)
    facing = side * normal
    bent = side * (2.0 * (facing * view).sum(axis=0) * facing - view)[2] < least
    assert 0.1 < bent.mean() < 0.9
    np.testing.assert_array_equal(n[:, ~bent], normal.astype(np.float32)[:, ~bent])
    mirrored = 2.0 * (n * view).sum(axis=0) * n - view
    np.testing.assert_allclose(side * mirrored[2, bent], least[bent], atol=2e-4)
    # a right-handed frame in which the view is the one there was, whose s is the old one without the normal's part
    np.testing.assert_allclose(np.cross(n, s, axis=0), t, atol=1e-5)
    np.testing.assert_allclose([(n * s).sum(axis=0), (s * s).sum(axis=0) - 1.0], 0.0, atol=1e-5)
    along = before - n * (n * before).sum(axis=0)
    np.testing.assert_allclose(s, along / np.linalg.norm(along, axis=0), atol=1e-3)
    np.testing.assert_allclose(np.array(found.to_world(found.wi)), view, atol=1e-5)


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["front", "back"])
def test_a_point_knows_the_meshs_normal_where_materials_tell_two(side: float) -> None:
    from mfo_backend.material.plugins.own_normal import own_normal
    from mfo_backend.render.transport.smooth_facets import seen_side

    def met() -> mi.SurfaceInteraction3f:
        si = dr.zeros(mi.SurfaceInteraction3f, COUNT)
        si.n = mi.Normal3f(0.0, 0.0, 1.0)
        si.sh_frame = mi.Frame3f(mi.Vector3f(*unit(0.3, 2)))
        si.dn_du, si.dn_dv = mi.Vector3f(1.0, 0.0, 0.0), mi.Vector3f(0.0, 1.0, 0.0)  # as of a curved surface
        si.wi = si.to_local(mi.Vector3f(*(side * unit(0.02, 1))))
        return si

    none = mi.Vector3f(0.0, 0.0, 0.0)
    np.testing.assert_allclose(np.array(own_normal(seen_side(TELLING, met()), none)), side * unit(0.3, 2), atol=1e-6)
    assert not np.array(own_normal(seen_side(OF_CYCLES, met()), none)).any()
    assert not np.array(own_normal(met(), none)).any()


@pytest.mark.parametrize("flipped", [False, True], ids=["seen from outside", "its back is seen"])
@pytest.mark.parametrize(
    ("degrees", "through", "leaves"),
    [(20.0, False, True), (70.0, False, False), (20.0, True, False), (70.0, True, True), (-85.0, False, True)],
)
def test_a_direction_leaves_on_the_side_of_the_facet(degrees, through, leaves, flipped):
    """The shading normal is turned by 30 degrees from the facet's, so a lobe about it reaches 30 degrees below that."""
    from mfo_backend.render.transport.smooth_facets import leaves_on

    si = dr.zeros(mi.SurfaceInteraction3f)
    bend, angle = np.radians(30.0), np.radians(degrees)
    si.n = mi.Normal3f(0.0, 0.0, -1.0 if flipped else 1.0)
    si.sh_frame = mi.Frame3f(mi.Vector3f(float(np.sin(bend)), 0.0, float(np.cos(bend))))
    si.wi = si.to_local(mi.Vector3f(0.0, 0.0, 1.0))
    about_shading = mi.Vector3f(float(np.sin(angle + bend)), 0.0, float(np.cos(angle + bend)))  # in the world
    assert np.array(leaves_on(OF_CYCLES, si, si.to_local(about_shading), through)).item() == leaves
