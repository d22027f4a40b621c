# SPDX-License-Identifier: Apache-2.0
"""Whole paths through glass with derivatives. Oracles: the integrators of references, and finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.render.pictures.renderer import load_renderer
from mfo_backend.types.errors import UnrecordableError
from mfo_backend.types.light_paths import LightPaths
from tests.render.scenes import AREA, FLOOR, SKY, write_scene

NAMES = ["base_color", "transmission_weight", "roughness", "ior", "alpha"]
GLASS = {"base_color": (0.9, 0.6, 0.4), "transmission_weight": 0.8, "roughness": 0.4, "ior": 1.45, "alpha": 0.9}


AS_CYCLES = LightPaths(
    filter_glossy=1.0, clamp_indirect=0.7, diffuse_bounces=2, glossy_bounces=2, transmission_bounces=3
)


def traced(folder, light_paths=None, depth=8):
    materials = {"target_bsdf": {"name": "Glass", "distribution": "MULTI_GGX", "sockets": {}}}
    path = write_scene(folder, SKY + FLOOR, size=16, depth=depth)
    renderer = load_renderer(
        path, "target", model="blender_principled", parameters=NAMES, materials=materials, light_paths=light_paths
    )
    from mfo_backend.render.traced.traced_paths import TracedPaths

    return renderer, TracedPaths(renderer), np.flatnonzero(renderer.target_mask().ravel())


@pytest.fixture(scope="module")
def glass(tmp_path_factory):
    return traced(tmp_path_factory.mktemp("scene"))


@pytest.mark.parametrize("light_paths", [None, AS_CYCLES], ids=["path", "cycles_path"])
def test_the_picture_is_that_of_the_path_tracer(tmp_path, light_paths):
    renderer, paths, pixels = traced(tmp_path, light_paths)
    x = renderer.table.pack(GLASS)
    got = paths.images(x[None], pixels, seed=1, samples=1024, jacobian=False)[0, :, :, 0]
    expected = renderer.image(x, seed=7, spp=1024).reshape(-1, 3)[pixels]
    np.testing.assert_allclose(got.mean(axis=0), expected.mean(axis=0), rtol=0.01)  # 170 000 paths each
    assert np.sqrt(np.mean((got - expected) ** 2) / np.mean(expected**2)) < 0.08  # noise of 1024 paths a pixel


@pytest.mark.parametrize("alpha", [1.0, 0.6])
def test_what_is_clamped_is_that_of_the_path_tracer(tmp_path, alpha):
    """By so low a bound that it holds most of the light of two bounces and more; behind cut-outs it is still direct."""
    renderer, paths, pixels = traced(tmp_path, LightPaths(clamp_indirect=0.02))
    x = renderer.table.pack({**GLASS, "transmission_weight": 0.2, "base_color": (0.3, 0.2, 0.1), "alpha": alpha})
    got = paths.images(x[None], pixels, seed=1, samples=4096, jacobian=False)[0, :, :, 0]
    expected = renderer.image(x, seed=7, spp=8192).reshape(-1, 3)[pixels]
    np.testing.assert_allclose(got.mean(axis=0), expected.mean(axis=0), rtol=0.005)  # 0.011 off with no roulette


@pytest.mark.parametrize(("limit", "most"), [(-1, 32), (7, 7), (32, 32), (40, 32)])
def test_paths_end_where_the_scene_says_and_after_32_surfaces(tmp_path, limit, most):
    assert traced(tmp_path, depth=limit)[1]._depth == most


def test_derivatives_are_those_of_the_mean_picture(glass):
    renderer, paths, pixels = glass
    # in the middle of a cell of the albedo tables, whose slope jumps at the nodes; the step stays in the cell
    x = renderer.table.pack({**GLASS, "roughness": 6.5 / 15.0})
    columns = paths.images(x[None], pixels, seed=1, samples=2048, jacobian=True)[0].mean(axis=0)[:, 1:]
    for k in range(renderer.table.length):
        h = np.zeros_like(x)
        h[k] = 0.03
        down, up = paths.images(np.stack([x - h, x + h]), pixels, seed=2, samples=2048, jacobian=False)[..., 0]
        secant = (up - down).mean(axis=0) / 0.06
        # the index has heavy tails: the slope of the Fresnel term has no bound at total reflection
        noise = 0.03 if k == renderer.table.slice_of("ior").start else 0.015
        np.testing.assert_allclose(columns[:, k], secant, rtol=0.05, atol=noise)


def test_alpha_has_the_slope_of_the_light_that_passes(tmp_path):
    """A cut-out ball under lamps: what its far side shows has come through the near one."""
    materials = {"target_bsdf": {"name": "Leaf", "distribution": "MULTI_GGX", "sockets": {}}}
    path = write_scene(tmp_path, AREA + FLOOR, size=16, depth=8)
    renderer = load_renderer(
        path, "target", model="blender_principled", parameters=NAMES, materials=materials, light_paths=LightPaths()
    )
    from mfo_backend.render.traced.traced_paths import TracedPaths

    paths, pixels = TracedPaths(renderer), np.flatnonzero(renderer.target_mask().ravel())
    x = renderer.table.pack({**GLASS, "transmission_weight": 0.0, "alpha": 0.5})
    k = renderer.table.slice_of("alpha").start
    h = np.zeros_like(x)
    h[k] = 0.03
    column = paths.images(x[None], pixels, seed=1, samples=1024, jacobian=True)[0].mean(axis=0)[:, 1 + k]
    down, up = paths.images(np.stack([x - h, x + h]), pixels, seed=2, samples=1024, jacobian=False)[..., 0]
    np.testing.assert_allclose(column, (up - down).mean(axis=0) / 0.06, rtol=0.03, atol=0.003)


def test_a_targets_own_light_is_dimmed_in_picture_and_derivatives(tmp_path):
    """A cut-out, coated ball that glows, on a floor that it lights."""
    sockets = {
        "Emission Color": {"value": [0.5, 0.4, 0.2], "linked": False},
        "Emission Strength": {"value": 1.5, "linked": False},
        "Coat Tint": {"value": [0.9, 0.5, 0.3], "linked": False},
    }
    materials = {"target_bsdf": {"name": "Lamp", "distribution": "MULTI_GGX", "sockets": sockets}}
    glow = (
        '<emitter type="blender_glow"><rgb name="radiance" value="0"/><boolean name="layered" value="true"/></emitter>'
    )
    path = write_scene(tmp_path, SKY + FLOOR, shape=glow, size=16, depth=8)
    # of meshes, as exported targets are: from its own surface Mitsuba's sphere is sampled wrongly
    path.write_text(path.read_text("utf-8").replace('type="sphere" id="target"', 'type="cube" id="target"'), "utf-8")
    names = ["base_color", "coat_weight", "sheen_weight", "alpha", "emission_color"]
    renderer = load_renderer(
        path, "target", model="blender_principled", parameters=names, materials=materials, light_paths=LightPaths()
    )
    from mfo_backend.render.traced.traced_paths import TracedPaths

    paths, pixels = TracedPaths(renderer), np.arange(256)
    values = {"base_color": (0.6, 0.3, 0.2), "coat_weight": 0.8, "sheen_weight": 0.3, "alpha": 0.6}
    x = renderer.table.pack({**values, "emission_color": (0.4, 0.5, 0.6)})
    got = paths.images(x[None], pixels, seed=1, samples=1024, jacobian=False)[0, :, :, 0]
    expected = renderer.image(x, seed=7, spp=4096).reshape(-1, 3)
    on_target = renderer.target_mask().ravel()
    for part in (on_target, ~on_target):
        np.testing.assert_allclose(got[part].mean(axis=0), expected[part].mean(axis=0), rtol=0.01)
    columns = paths.images(x[None], pixels, seed=1, samples=1024, jacobian=True)[0].mean(axis=0)[:, 1:]
    for k in range(renderer.table.length):
        h = 0.03 * np.eye(len(x))[k]
        down, up = paths.images(np.stack([x - h, x + h]), pixels, seed=1, samples=1024, jacobian=False)[..., 0]
        np.testing.assert_allclose(columns[:, k], (up - down).mean(axis=0) / 0.06, rtol=0.03, atol=0.003)


def test_the_weight_of_clear_glass_has_derivatives_without_spikes(glass):
    renderer, paths, pixels = glass
    # hardly any diffuse lobe is left, and the derivative is mostly what it would add
    x = renderer.table.pack({**GLASS, "transmission_weight": 0.9999, "alpha": 1.0})
    k = renderer.table.slice_of("transmission_weight").start
    column = paths.images(x[None], pixels, seed=1, samples=64, jacobian=True)[0, :, :, 1 + k]
    # 4.4 here, and 11.9 where the lobe is chosen as rarely as it is weak
    assert np.abs(column).max() < 8.0 * np.abs(column).mean()


def test_a_path_keeps_its_random_numbers(glass):
    renderer, paths, pixels = glass
    x = renderer.table.pack(GLASS)
    pair = paths.images(np.stack([x, x]), pixels, seed=1, samples=4, jacobian=False)
    np.testing.assert_array_equal(pair[0], pair[1])
    with_columns = paths.images(x[None], pixels, seed=1, samples=4, jacobian=True)
    np.testing.assert_allclose(with_columns[0, :, :, 0], pair[0, :, :, 0], rtol=2e-3, atol=1e-4)
    other = paths.images(x[None], pixels, seed=2, samples=4, jacobian=False)
    assert not np.allclose(other[0], pair[0], rtol=0.01)


def test_large_pictures_are_traced_in_parts(glass, monkeypatch):
    renderer, paths, pixels = glass
    x = np.stack([renderer.table.pack({**GLASS, "roughness": r}) for r in (0.2, 0.4, 0.6)])
    whole = paths.images(x, pixels, seed=3, samples=4, jacobian=True)
    monkeypatch.setattr("mfo_backend.render.traced.traced_paths.LANES_OF_A_LAUNCH", 150)
    np.testing.assert_allclose(paths.images(x, pixels, seed=3, samples=4, jacobian=True), whole, rtol=1e-3, atol=1e-3)


def test_other_models_are_refused(tmp_path):
    path = write_scene(tmp_path, SKY, material='<float name="spec_trans" value="0.8"/>')
    renderer = load_renderer(path, "target", model="mitsuba_principled", parameters=["roughness"])
    from mfo_backend.render.traced.traced_paths import TracedPaths

    with pytest.raises(UnrecordableError, match="no traced version"):
        TracedPaths(renderer)
