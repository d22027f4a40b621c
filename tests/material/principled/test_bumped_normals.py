# SPDX-License-Identifier: Apache-2.0
"""Normals that nodes give: validity, what is lost, and the model where they are the mesh's own."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mfo_backend.material.arrays.dual import Dual
from mfo_backend.material.cycles_model import cycles_model
from mfo_backend.material.lobes.microfacet import smith_lambda
from mfo_backend.material.lobes.sheen import VelvetLobe
from mfo_backend.material.principled.blender_principled import BLENDER_5_0, blender_principled
from mfo_backend.material.principled.bumped_normals import BumpedNormals, about, valid_normal
from mfo_backend.material.principled.needed_lobes import ALL_LOBES

UP = (0.0, 0.0, 1.0)
COUNT = 4000


def directions(seed: int, least: float = 0.02) -> mi.Vector3f:
    """Unit vectors whose third component is at least `least`."""
    random = np.random.default_rng(seed)
    z, phi = random.uniform(least, 1.0, COUNT), random.uniform(0.0, 2.0 * np.pi, COUNT)
    r = np.sqrt(1.0 - z**2)
    return mi.Vector3f(*(mi.Float(a.astype(np.float32)) for a in (r * np.cos(phi), r * np.sin(phi), z)))


def test_a_valid_normal_mirrors_the_view_above_the_mesh() -> None:
    view, normal, geometric = directions(0), directions(1), mi.Vector3f(*UP)
    found = valid_normal(geometric, view, normal)
    mirrored = (2.0 * dr.dot(found, view) * found - view).z.numpy()
    before = (2.0 * dr.dot(normal, view) * normal - view).z.numpy()
    threshold = np.minimum(0.9 * view.z.numpy(), 0.01)
    assert (before < threshold).sum() > 500
    assert mirrored.min() > -1e-4
    assert (mirrored >= threshold - 1e-3).all()
    kept = before >= threshold
    np.testing.assert_array_equal(np.array(found)[:, kept], np.array(normal)[:, kept])
    # a turned one stays in the plane of both normals and is no further away than needed: exactly at the threshold
    np.testing.assert_allclose(mirrored[~kept], threshold[~kept], atol=2e-3)
    assert np.abs(dr.dot(dr.cross(found, normal), geometric).numpy()).max() < 1e-4
    np.testing.assert_allclose(dr.norm(found).numpy(), 1.0, atol=1e-4)


def test_a_valid_normal_has_a_slope_in_grazing_views() -> None:
    """One pixel without it, at a silhouette, took the certainty of a whole fit."""
    x, y, _ = directions(0).numpy()
    low = np.geomspace(1e-6, 3e-3, COUNT)
    view = dr.normalize(mi.Vector3f(*(mi.Float(a.astype(np.float32)) for a in (x, y, low))))
    found = valid_normal(Dual(mi.Vector3f(*UP)), Dual(view), Dual(directions(1), {0: directions(2)}))
    assert np.isfinite(found.slopes[0].numpy()).all()


def test_the_terminator_is_smiths_masking() -> None:
    """G1 of an isotropic GGX surface of alpha^2 = tan^2 / 8 at the light's angle to the smooth normal."""
    light, normal = directions(2), mi.Vector3f(0.6, 0.0, 0.8)
    normals = BumpedNormals(mi.Vector3f(*UP), normal, mi.Vector3f(*UP))
    alpha = np.sqrt(0.125 * (0.6 / 0.8) ** 2)
    wanted = 1.0 / (1.0 + smith_lambda(light, mi.Float(alpha), mi.Float(alpha)).numpy())
    np.testing.assert_allclose(normals.terminator(light).numpy(), wanted, rtol=2e-4)


def test_the_terminator_before_blender_4_5_fades_towards_the_meshs_plane() -> None:
    """All light on the side that bumps do not shade, none from below the mesh, g + g^2 - g^3 between."""
    light, normal = directions(2), mi.Vector3f(0.6, 0.0, 0.8)
    normals = BumpedNormals(mi.Vector3f(*UP), normal, mi.Vector3f(*UP), shade=False)
    x, _, z = light.numpy()
    g = z / ((0.6 * x + 0.8 * z) * 0.8)
    seen = 0.6 * x + 0.8 * z > 0.01
    wanted = np.where(g > 1.0, 1.0, np.where(g < 0.0, 0.0, g + g**2 - g**3))
    assert (g[seen] > 1.0).any()
    assert ((g[seen] > 0.0) & (g[seen] < 1.0)).any()
    np.testing.assert_allclose(normals.terminator(light).numpy()[seen], wanted[seen], atol=1e-5)


def test_about_keeps_lengths_and_angles() -> None:
    normal, a, b = directions(3), directions(4), directions(5)
    np.testing.assert_allclose(about(normal, normal).z.numpy(), 1.0, atol=1e-5)
    np.testing.assert_allclose(dr.dot(about(normal, a), about(normal, b)).numpy(), dr.dot(a, b).numpy(), atol=2e-5)


def test_the_meshs_own_normal_changes_nothing() -> None:
    values = {
        "base_color": mi.Color3f(0.4, 0.3, 0.2), "metallic": mi.Float(0.3), "roughness": mi.Float(0.4),
        "coat_weight": mi.Float(0.5), "sheen_weight": mi.Float(0.4), "diffuse_roughness": mi.Float(0.3),
        "anisotropic": mi.Float(0.5), "anisotropic_rotation": mi.Float(0.1),
    }  # fmt: skip
    own = dict.fromkeys(("smooth_normal", "bumped_normal", "coat_normal"), mi.Vector3f(*UP))
    view, light = directions(6), directions(7)
    plain = np.array(blender_principled(values, view, light, ALL_LOBES, BLENDER_5_0))
    bumped = np.array(blender_principled(values | own, view, light, ALL_LOBES, BLENDER_5_0))
    np.testing.assert_allclose(bumped, plain, rtol=2e-4, atol=1e-6)


def test_each_lobe_looks_at_its_own_normal() -> None:
    """A coat over black, and a Lambert surface, seen about a tilted normal, are those of a tilted surface."""
    tilted = mi.Vector3f(0.28, 0.0, 0.96)
    view, light = directions(8, 0.5), directions(9, 0.5)
    turned_view, turned_light = about(tilted, view), about(tilted, light)
    own = mi.Vector3f(*UP)
    black = {"base_color": mi.Color3f(0.0), "specular_ior_level": mi.Float(0.0), "coat_weight": mi.Float(1.0)}
    coat = {"smooth_normal": own, "bumped_normal": own, "coat_normal": tilted}
    found = np.array(blender_principled(black | coat, view, light, ALL_LOBES, BLENDER_5_0))
    wanted = np.array(blender_principled(black, turned_view, turned_light, ALL_LOBES, BLENDER_5_0))
    np.testing.assert_allclose(found, wanted, rtol=2e-3, atol=1e-5)
    matt = {"base_color": mi.Color3f(0.5), "specular_ior_level": mi.Float(0.0)}
    bump = {"smooth_normal": tilted, "bumped_normal": tilted, "coat_normal": own}
    found = np.array(blender_principled(matt | bump, view, light, ALL_LOBES, BLENDER_5_0))
    wanted = np.array(blender_principled(matt, turned_view, turned_light, ALL_LOBES, BLENDER_5_0))
    np.testing.assert_allclose(found, wanted, rtol=2e-3, atol=1e-5)


@pytest.mark.parametrize("shader", ["toon", "toon_glossy", "velvet", "sheen"])
def test_bumps_shade_diffuse_lobes_alone(shader: str) -> None:
    """As Cycles sorts its closures: velvet and the glossy cone of a Toon BSDF are glossy ones."""
    distribution = "ASHIKHMIN" if shader == "velvet" else "MULTI_GGX"
    model = cycles_model((5, 0), distribution, shader if shader.startswith("toon") else "principled")
    values = {"sheen_weight": 1.0, "base_color": 0.0, "specular_ior_level": 0.0, "toon_size": 0.8, "toon_smooth": 0.1}
    tilted, up = mi.Vector3f(0.6, 0.0, 0.8), mi.Vector3f(*UP)
    view, light = directions(7, least=0.9), directions(8, least=0.5)
    bent = {"bumped_normal": up, "coat_normal": up}
    plain, shaded = (
        blender_principled({**values, **bent, "smooth_normal": smooth}, view, light, model=model)[0].numpy()
        for smooth in (up, tilted)
    )
    seen = (plain > 1e-4) & (dr.dot(light, tilted).numpy() > 0.0)
    share = BumpedNormals(tilted, up, up).terminator(light).numpy() if shader in ("toon", "sheen") else 1.0
    assert seen.sum() > 500
    np.testing.assert_allclose(shaded[seen], (plain * share)[seen], rtol=1e-4)


def test_velvet_is_black_where_the_view_is_below_its_normal() -> None:
    """A negative cosine gave numbers without end."""
    lobe = VelvetLobe(mi.Vector3f(0.9, 0.0, -0.43), mi.Float(0.7))
    assert not lobe.value(directions(9)).numpy().any()
