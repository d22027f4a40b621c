# SPDX-License-Identifier: Apache-2.0
"""Oracle: Mitsuba's own C++ plugin, evaluated at the same random values and directions."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mfo_backend.render.machine.variant import load_variant

load_variant()

from mfo_backend.material.mitsuba_principled import MitsubaPrincipled  # noqa: E402  after the variant is set

TABLE = [p for p in MitsubaPrincipled.table if p.name not in ("eta", "spec_trans")]
NAMES = [p.name for p in TABLE]


def random_values(seed: int) -> dict[str, object]:
    rng = np.random.default_rng(seed)
    values = {p.name: rng.uniform(p.lower, p.upper, p.size) for p in TABLE}
    return {n: v.tolist() if len(v) == 3 else float(v[0]) for n, v in values.items()}


def directions(seed: int, n: int = 2048) -> tuple[mi.Vector3f, mi.Vector3f]:
    rng = np.random.default_rng(seed)
    w = rng.normal(size=(2, 3, n))
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    w[:, 2, : n // 2] = np.abs(w[:, 2, : n // 2])
    w[1, :, : n // 8] = w[0, :, : n // 8] * [[-1], [-1], [1]]  # near the mirror direction, where lobes are sharp
    w[1, :, : n // 8] += rng.normal(size=(3, n // 8)) * 0.01
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    return mi.Vector3f(w[0]), mi.Vector3f(w[1])


def plugin_value(values: dict, wi: mi.Vector3f, wo: mi.Vector3f) -> np.ndarray:
    colours = {k: {"type": "rgb", "value": v} for k, v in values.items() if isinstance(v, list)}
    bsdf = mi.load_dict({"type": "principled", **values, **colours})
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(wi))
    si.wi = wi
    return np.array(bsdf.eval(mi.BSDFContext(), si, wo))


@pytest.mark.parametrize("seed", range(12))
def test_equals_the_plugin_of_mitsuba(seed):
    values = random_values(seed)
    wi, wo = directions(100 + seed)
    expected = plugin_value(values, wi, wo)
    got = np.array(
        MitsubaPrincipled().evaluate(
            {k: mi.Float(v) if isinstance(v, float) else mi.Color3f(v) for k, v in values.items()}, wi, wo
        )
    )
    assert expected.max() > 0.1
    # 1e-5 of the value plus 1e-6: float32 with another order of operations
    np.testing.assert_allclose(got, expected, rtol=1e-5, atol=1e-6)


def test_an_index_of_refraction_replaces_the_specular_level():
    values = {k: mi.Color3f(v) if isinstance(v, list) else mi.Float(v) for k, v in random_values(4).items()}
    wi, wo = directions(6)
    by_level = MitsubaPrincipled().evaluate({**values, "specular": mi.Float(0.5)}, wi, wo)
    del values["specular"]
    by_eta = MitsubaPrincipled().evaluate({**values, "eta": mi.Float(1.5)}, wi, wo)
    np.testing.assert_allclose(np.array(by_eta), np.array(by_level), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(
    "absent", ["metallic", "anisotropic", "spec_tint", "clearcoat", "sheen", "sheen_tint", "flatness"]
)
def test_a_lobe_left_out_equals_a_lobe_of_weight_zero(absent):
    values = {k: mi.Color3f(v) if isinstance(v, list) else mi.Float(v) for k, v in random_values(3).items()}
    wi, wo = directions(5)
    model = MitsubaPrincipled()
    with_zero = np.array(model.evaluate({**values, absent: mi.Float(0.0)}, wi, wo))
    without = np.array(model.evaluate({**values, absent: 0.0}, wi, wo))
    np.testing.assert_allclose(without, with_zero, rtol=2e-6, atol=1e-7)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("at", ["lower", "upper", "inside"])
def test_derivatives_are_finite_on_the_whole_box_and_equal_differences_inside(name, at):
    model = MitsubaPrincipled()
    parameter = model.table[name]
    value = {"lower": parameter.lower, "upper": parameter.upper, "inside": 0.5 * (parameter.lower + parameter.upper)}[
        at
    ]
    wi, wo = directions(7, 512)
    others = {k: mi.Color3f(v) if isinstance(v, list) else mi.Float(v) for k, v in random_values(1).items()}

    def evaluate(x: mi.Float) -> mi.Color3f:
        return model.evaluate({**others, name: mi.Color3f(x) if parameter.size == 3 else x}, wi, wo)

    x = mi.Float(value)
    dr.enable_grad(x)
    result = evaluate(x)
    dr.forward(x)
    slope = np.array(dr.grad(result))
    assert np.isfinite(slope).all()
    if at == "inside":
        h = 2e-3
        difference = (np.array(evaluate(mi.Float(value + h))) - np.array(evaluate(mi.Float(value - h)))) / (2 * h)
        # float32 rounding (1e-7 of a value up to 100, over 4e-3) and the curvature of sharp lobes
        np.testing.assert_allclose(slope, difference, rtol=2e-2, atol=2e-3 * max(1.0, np.abs(slope).max()))
