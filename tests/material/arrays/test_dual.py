# SPDX-License-Identifier: Apache-2.0
"""Dual numbers. Oracle: Dr.Jit's own forward mode, of every function and of whole materials."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit
import mitsuba as mi
import numpy as np
import pytest

from mfo_backend.material.arrays import dual
from mfo_backend.material.arrays.dual import Dual, cast, kind_of
from mfo_backend.material.cycles_model import cycles_model
from mfo_backend.material.mitsuba_principled import MitsubaPrincipled
from mfo_backend.material.principled.blender_principled import blender_principled
from mfo_backend.material.principled.needed_lobes import needed_lobes
from mfo_backend.material.principled.principled_parameters import BLENDER_PRINCIPLED

COUNT = 2000
# float32, and sums in another order; Dr.Jit's own derivatives scatter as much about those in double precision
RTOL = 2e-4


def numbers(seed: int, low: float = -1.5, high: float = 1.5) -> Any:
    return mi.Float(np.random.default_rng(seed).uniform(low, high, COUNT).astype(np.float32))


def by_drjit(function: Callable[..., Any], arguments: list[Any]) -> list[np.ndarray]:
    """Value and derivatives by each argument in turn."""
    drjit.enable_grad(*arguments)
    value = function(*arguments)
    found = [drjit.detach(value)]
    for argument in arguments:
        drjit.set_grad(argument, 1.0)
        drjit.enqueue(drjit.ADMode.Forward, argument)
        drjit.traverse(drjit.ADMode.Forward, drjit.ADFlag.ClearInterior | drjit.ADFlag.ClearInput)
        found.append(drjit.grad(value))
        drjit.clear_grad(value)
    return together(found)


def together(arrays: list[Any]) -> list[np.ndarray]:
    """All arrays by one kernel."""
    drjit.eval(arrays)
    return [np.array(array) for array in arrays]


def by_duals(function: Callable[..., Any], arguments: list[Any]) -> list[np.ndarray]:
    result = function(*(Dual(drjit.detach(a), {k: mi.Float(1.0)}) for k, a in enumerate(arguments)))
    nothing = drjit.zeros(type(result.value), COUNT)
    return together([a + nothing for a in (result.value, *(result.slopes.get(k, 0.0) for k in range(len(arguments))))])


def vector(a: Any, b: Any) -> Any:
    return cast(mi.Vector3f, a, b, 0.5 * a)


@pytest.mark.parametrize(
    "function",
    [
        lambda dr, a, b: a + 2.0 * b - a * b,
        lambda dr, a, b: 3.0 - a,
        lambda dr, a, b: a / (2.0 + dr.square(b)),
        lambda dr, a, b: a / 3.0 - 2.0 / (2.0 + dr.square(b)),
        lambda dr, a, b: (a * b) ** 3,
        lambda dr, a, b: dr.sqrt(2.0 + a) * dr.rsqrt(2.0 + b),
        lambda dr, a, b: dr.safe_sqrt(a) + dr.rcp(2.0 + b),
        lambda dr, a, b: dr.exp(a) * dr.log(2.0 + b),
        lambda dr, a, b: dr.cos(a) * dr.sincos(b)[0] + dr.sincos(a)[1],
        lambda dr, a, b: dr.abs(a) * -b,
        lambda dr, a, b: dr.safe_acos(0.5 * a) * b,
        lambda dr, a, b: dr.select(a < b, dr.square(a), 1.0) + dr.select(a >= 0.2, 0.0, b),
        lambda dr, a, b: dr.maximum(a, b) + dr.maximum(0.3, a) + dr.minimum(a, b) * dr.minimum(b, 0.1),
        lambda dr, a, b: dr.clip(a, -0.5, 0.5) * b,
        lambda dr, a, b: dr.lerp(a, b, 0.3) + dr.lerp(2.0 * a, b, a * b),
        lambda dr, a, b: dr.mulsign(a, b),
        lambda dr, a, b: dr.dot(vector(a, b), vector(b, 1.0 + a)),
        lambda dr, a, b: dr.normalize(vector(a, b)) * a,
        lambda dr, a, b: dr.luminance(cast(mi.Color3f, a, b, 1.0)) * cast(mi.Color3f, a),
        lambda dr, a, b: vector(a, b).z * vector(a, b)[0] + vector(a, b).y * vector(a, b).x,
        lambda dr, a, b: kind_of(a)(0.5) * b + kind_of(vector(a, b))(a, 1.0, b).x,
    ],
)
def test_functions_and_operators_have_drjits_values_and_slopes(function):
    arguments = [numbers(1), numbers(2)]
    wanted = by_drjit(lambda a, b: function(dual, a, b), arguments)
    for found, expected in zip(by_duals(lambda a, b: function(dual, a, b), arguments), wanted, strict=True):
        np.testing.assert_allclose(found, expected + np.zeros_like(found), rtol=RTOL, atol=2e-5)


def test_between_equal_numbers_slopes_are_drjits_too():
    arguments = [mi.Float(np.zeros(COUNT, np.float32)), mi.Float(np.zeros(COUNT, np.float32))]
    for function in (dual.maximum, dual.minimum):
        for found, expected in zip(by_duals(function, arguments), by_drjit(function, arguments), strict=True):
            np.testing.assert_array_equal(found, expected + np.zeros_like(found))


def test_what_a_mask_leaves_out_needs_no_guard():
    x = Dual(mi.Float([0.0, 4.0]), {0: mi.Float(1.0)})
    root = dual.select(x > 1.0, dual.sqrt(x), 0.0)  # the root's slope at 0 is infinite
    np.testing.assert_array_equal(np.array(root.slopes[0]), [0.0, 0.25])


def test_comparisons_are_masks_and_nothing_else_takes_dual_numbers():
    x = Dual(mi.Float([0.0, 2.0]), {0: mi.Float(1.0)})
    for mask in (x > 1.0, x >= 2.0, x == 2.0, x != 0.0):
        assert np.array(mask).tolist() == [False, True]
    for mask in (x < 1.0, x <= 0.0):
        assert np.array(mask).tolist() == [True, False]
    assert dual.varies(x)
    assert not dual.varies(Dual(x.value))
    assert dual.detach(x) is x.value
    with pytest.raises(Exception, match="Dual"):
        dual.tan(x)


def operations(by: Callable[..., Any], function: Callable[..., Any], arguments: list[Any]) -> int:
    """Of the kernel that value and slopes take."""
    with drjit.scoped_set_flag(drjit.JitFlag.KernelHistory):
        drjit.kernel_history_clear()
        by(function, arguments)
        return max(k["operation_count"] for k in drjit.kernel_history() if k["type"] == drjit.KernelType.JIT)


def directions(seed: int) -> Any:
    rng = np.random.default_rng(seed)
    z, angle = rng.uniform(0.02, 1.0, COUNT), rng.uniform(0, 2 * np.pi, COUNT)
    r = np.sqrt(1 - z**2)
    return mi.Vector3f(*(mi.Float(a.astype(np.float32)) for a in (r * np.cos(angle), r * np.sin(angle), z)))


def material(table: Any, evaluate: Callable[..., Any], left_out: tuple[str, ...], seed: int) -> tuple[int, int]:
    """Compare all slopes of a material with free values that vary from lane to lane; returns the operations it takes by
    duals and by Dr.Jit."""
    rng = np.random.default_rng(seed)
    free = [p for p in table if p.name not in left_out]
    values = [
        mi.Float((p.lower + (p.upper - p.lower) * rng.uniform(0.05, 0.95, COUNT)).astype(np.float32))
        for p in free for _ in range(p.size)
    ]  # fmt: skip
    wi, wo = directions(seed + 1), directions(seed + 2)

    def shown(*arguments: Any) -> Any:
        entries = iter(arguments)
        parts = {p.name: [next(entries) for _ in range(p.size)] for p in free}
        parameters = {name: c[0] if len(c) == 1 else cast(mi.Color3f, *c) for name, c in parts.items()}
        both = (Dual(wi), Dual(wo)) if isinstance(arguments[0], Dual) else (wi, wo)
        return evaluate(parameters, *both)

    for found, expected in zip(by_duals(shown, values), by_drjit(shown, values), strict=True):
        scale = np.abs(expected).max(axis=-1, keepdims=True) + 1e-6
        close = np.isclose(found, expected + np.zeros_like(found), rtol=2e-3, atol=2e-6 * scale)
        # of thousands of lanes a few lie at kinks, where one rounding decides on the side
        assert close.mean() > 0.998
    return operations(by_duals, shown, values), operations(by_drjit, shown, values)


ABSENT = ("metallic", "specular", "roughness", "anisotropic", "sheen", "sheen_tint", "clearcoat", "clearcoat_gloss")


@pytest.mark.parametrize("absent", [(), *((name,) for name in ABSENT), ABSENT], ids=str)
def test_mitsubas_principled_has_drjits_slopes(absent):
    model = MitsubaPrincipled()

    def evaluate(parameters, wi, wo):
        return model.evaluate(dict.fromkeys(absent, 0.0) | parameters, wi, wo)

    ours, drjits = material(model.table, evaluate, ("spec_trans", "eta", *absent), seed=5)
    print(f"{ours} operations, {drjits} by Dr.Jit's own forward mode")
    assert ours < (0.75 if len(absent) < len(ABSENT) else 1.0) * drjits  # of three slopes there is little to save


@pytest.mark.parametrize("model", [cycles_model((5, 0)), cycles_model((4, 2))], ids=["5.0", "4.2"])
def test_blenders_principled_has_drjits_slopes(model):
    left_out = ("transmission_weight", "alpha", "emission_color", "emission_strength")
    names = [p.name for p in BLENDER_PRINCIPLED if p.name not in left_out]
    lobes = needed_lobes({}, names)

    def evaluate(parameters, wi, wo):
        return blender_principled(parameters, wi, wo, lobes, model)

    ours, drjits = material(BLENDER_PRINCIPLED, evaluate, left_out, seed=8)
    print(f"{ours} operations, {drjits} by Dr.Jit's own forward mode")
    assert ours < 0.75 * drjits
