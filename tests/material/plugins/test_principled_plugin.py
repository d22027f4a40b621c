# SPDX-License-Identifier: Apache-2.0
"""The Mitsuba plugin: values, parameters, textures, alpha, and derivatives of a picture."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mfo_backend.material.principled.blender_principled import BLENDER_5_0, blender_principled
from mfo_backend.material.principled.layers import layer_stack
from mfo_backend.material.principled.needed_lobes import ALL_LOBES
from mfo_backend.material.principled.principled_parameters import BLENDER_PRINCIPLED
from mfo_backend.types.errors import BadInputError

from ..directions import unit

pytestmark = pytest.mark.usefixtures("plugin")
COLOUR = {"type": "rgb", "value": [0.8, 0.3, 0.1]}


def interaction(view: tuple[float, float, float]) -> mi.SurfaceInteraction3f:
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi, si.uv = mi.Vector3f(*view), mi.Point2f(0.25, 0.25)
    return si


def picture_of(bsdf: dict[str, Any], integrator: str = "prb", depth: int = 3, world: float = 0.5) -> mi.Scene:
    camera = mi.ScalarTransform4f().look_at([0, -4, 1], [0, 0, 0], [0, 0, 1])
    film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": integrator, "max_depth": depth},
            "sensor": {"type": "perspective", "to_world": camera, "fov": 40, "film": film},
            "world": {"type": "constant", "radiance": world},
            "lamp": {"type": "point", "position": [2, -3, 3], "intensity": 30.0},
            "target_bsdf": bsdf,
            "target": {"type": "sphere", "material": {"type": "ref", "id": "target_bsdf"}},
        }
    )


def test_value_and_density_are_those_of_the_function() -> None:
    bsdf = mi.load_dict({"type": "blender_principled", "base_color": COLOUR, "roughness": 0.3, "coat_weight": 0.5})
    si, light = interaction(unit(30, 0)), mi.Vector3f(*unit(40, 150))
    context = mi.BSDFContext()
    parameters = {"base_color": (0.8, 0.3, 0.1), "roughness": 0.3, "coat_weight": 0.5}
    expected = np.array(blender_principled(parameters, si.wi, light)).ravel()
    value, density = bsdf.eval_pdf(context, si, light)
    # A glass lobe of weight zero and the like leave rounding of single precision
    np.testing.assert_allclose(np.array(value).ravel(), expected, rtol=1e-5)
    np.testing.assert_allclose(np.array(bsdf.eval(context, si, light)).ravel(), expected, rtol=1e-5)
    assert density[0] == pytest.approx(bsdf.pdf(context, si, light)[0], rel=1e-5)


def test_traverse_shows_every_parameter_by_name() -> None:
    keys = {key for key in dict(mi.traverse(picture_of({"type": "blender_principled"}))) if "target_bsdf" in key}
    assert keys == {f"target_bsdf.{name}" for name in BLENDER_PRINCIPLED.names}


def test_unknown_names_are_refused() -> None:
    with pytest.raises(Exception, match="clearcoat"):
        mi.load_dict({"type": "blender_principled", "clearcoat": 1.0})
    with pytest.raises((BadInputError, RuntimeError), match="rougness"):
        mi.load_dict({"type": "blender_principled", "free": "rougness"})


def test_changing_a_weight_brings_its_lobe_back() -> None:
    bsdf = mi.load_dict({"type": "blender_principled", "base_color": COLOUR})
    si, light = interaction(unit(30, 0)), mi.Vector3f(*unit(40, 180))
    params = mi.traverse(bsdf)
    params["coat_weight"] = mi.Float(1.0)
    params["coat_roughness"] = mi.Float(0.3)
    params.update()
    value = np.array(bsdf.eval(mi.BSDFContext(), si, light)).ravel()
    np.testing.assert_allclose(value, (0.358997, 0.246803, 0.201926), rtol=1e-5)


def test_changed_values_are_no_literals_of_a_kernel() -> None:
    """Each value of a fit would be a kernel of its own."""
    bsdf = mi.load_dict({"type": "blender_principled", "base_color": COLOUR})
    params = mi.traverse(bsdf)
    for name, value in (("roughness", mi.Float(0.3)), ("coat_weight", mi.Float(1.0)), ("base_color", mi.Color3f(0.4))):
        params[name] = value
    params.update()
    assert [getattr(bsdf, name).state for name in ("roughness", "coat_weight")] == [dr.VarState.Evaluated] * 2
    assert bsdf.base_color.x.state == dr.VarState.Evaluated


def test_textures_are_read_at_the_point() -> None:
    data = np.full((4, 4, 1), 0.2, np.float32)
    data[:2, :2] = 0.7
    texture = {"type": "bitmap", "data": mi.TensorXf(data), "raw": True, "filter_type": "nearest"}
    bsdf = mi.load_dict({"type": "blender_principled", "base_color": COLOUR, "roughness": texture})
    light = mi.Vector3f(*unit(40, 150))
    for place, roughness in ((0.1, 0.7), (0.9, 0.2)):
        si = interaction(unit(30, 0))
        si.uv = mi.Point2f(place, place)
        expected = blender_principled({"base_color": (0.8, 0.3, 0.1), "roughness": roughness}, si.wi, light)
        value = bsdf.eval(mi.BSDFContext(), si, light)
        np.testing.assert_allclose(np.array(value).ravel(), np.array(expected).ravel(), rtol=1e-5)
    assert "roughness.data" in mi.traverse(bsdf)


@pytest.mark.parametrize("integrator", ["path", "prb"])
def test_alpha_mixes_with_what_is_behind(integrator: str) -> None:
    # One bounce of a sphere in a white world: black surface, so a pixel shows the two walls it passes, alpha^2
    bsdf = {"type": "blender_principled", "base_color": {"type": "rgb", "value": 0.0}, "specular_ior_level": 0.0}
    scene = picture_of({**bsdf, "alpha": 0.6}, integrator, depth=5)
    centre = np.array(mi.render(scene, spp=256))[7:9, 7:9].mean()
    # Binomial noise of 1024 paths: 0.5 sqrt(.16 .84 / 1024)
    assert centre == pytest.approx(0.5 * 0.4**2, abs=0.02)


@pytest.mark.parametrize("alpha", [1.0, 0.3, -0.4, 1.4])
def test_shadow_rays_pass_by_what_alpha_leaves(alpha: float) -> None:
    """Links give alphas beyond 0 and 1; Cycles has the nearest of them (`svm_node_closure_bsdf`)."""
    bsdf = mi.load_dict({"type": "blender_principled", "base_color": COLOUR, "alpha": alpha})
    passed = np.array(bsdf.eval_null_transmission(interaction(unit(30, 0)))).ravel()
    np.testing.assert_allclose(passed, 1.0 - np.clip(alpha, 0.0, 1.0), atol=1e-6)


def test_emission_is_dimmed_by_what_lies_above() -> None:
    base = {"emission_color": (1.0, 0.5, 0.2), "emission_strength": 2.0}

    def emitted(values: dict) -> np.ndarray:
        return np.array(layer_stack(values, mi.Vector3f(*unit(30, 0)), ALL_LOBES, BLENDER_5_0).emission).ravel()

    plain = emitted(base)
    np.testing.assert_allclose(plain, (2.0, 1.0, 0.4), rtol=1e-6)
    half = emitted({**base, "alpha": 0.5})
    np.testing.assert_allclose(half, plain / 2, rtol=1e-6)
    covered = emitted({**base, "coat_weight": 1.0})
    # 1 minus the albedo of a smooth layer of index 1.5, 4 to 5 %
    assert np.all((covered / plain > 0.94) & (covered / plain < 0.97))


@pytest.mark.parametrize("name", ["roughness", "metallic", "coat_weight", "base_color"])
def test_picture_derivative_is_the_finite_difference(name: str) -> None:
    start = {"roughness": 0.45, "metallic": 0.3, "coat_weight": 0.4, "base_color": COLOUR}
    scene = picture_of({"type": "blender_principled", **start, "free": name}, depth=2, world=0.0)
    params, key = mi.traverse(scene), f"target_bsdf.{name}"
    value = type(params[key])(params[key])

    def mean(change: float) -> float:
        params[key] = value + change
        params.update()
        return float(np.array(mi.render(scene, spp=64, seed=2)).astype(np.float64).mean())

    step = 0.001  # no node of a table lies within it: slopes change by 4 % from one cell to the next
    difference = (mean(step) - mean(-step)) / (2 * step)
    params[key] = type(value)(value)
    dr.enable_grad(params[key])
    params.update()
    image = mi.render(scene, params, spp=64, seed=1, seed_grad=2)
    dr.backward(dr.mean(image, axis=None))
    found = float(np.sum(np.array(dr.grad(params[key]))))
    # The same points in both, light from one direction: what is left is the step's own error
    assert found == pytest.approx(difference, rel=5e-3)


@pytest.mark.parametrize("layer", ["coat_weight", "sheen_weight"])
def test_light_samples_of_a_glow_are_dimmed_by_layers_from_blender_5_2_on(layer: str) -> None:
    """A floor beside a glowing box with a sheen was 13 % too bright in 5.2.2, whose pictures this was measured with."""
    shares = {}
    for version in ("5.0", "5.2"):
        bsdf = mi.load_dict(
            {"type": "blender_principled", "blender_version": version, layer: 1.0, "emission_strength": 1.0}
        )
        si = interaction(unit(70, 0))
        shares[version] = [float(bsdf.emitted(si, True, sampled=sampled)[0][0]) for sampled in (False, True)]
    assert shares["5.0"][1] == pytest.approx(1.0)
    assert shares["5.0"][0] < 0.9
    assert shares["5.2"] == pytest.approx([shares["5.0"][0]] * 2)
