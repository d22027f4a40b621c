# SPDX-License-Identifier: Apache-2.0
"""No NaN, no infinity and no negative light in any corner: of the box that a fit searches, and of what Blender allows.

Every lane draws each component from its lower bound, its upper bound and the middle; directions from normal, grazing,
equal, opposite and mirrored ones, where half vectors and refractions degenerate.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray

from mfo_backend.material.mitsuba_principled import MitsubaPrincipled
from mfo_backend.material.principled.blender_principled import BLENDER_5_0, blender_principled, evaluate
from mfo_backend.material.principled.layers import layer_stack
from mfo_backend.material.principled.lobe_sampling import lobe_choice, pdf, sample
from mfo_backend.material.principled.needed_lobes import ALL_LOBES
from mfo_backend.material.principled.principled_parameters import BLENDER_PRINCIPLED
from mfo_backend.types.parameter import ParameterTable

LANES = 1 << 16
# what the sockets of Blender 5.0 take beyond the box of a fit
BLENDER_LIMITS = {
    "base_color": (0.0, 1.0), "roughness": (0.0, 1.0), "ior": (1.0, 1000.0), "specular_ior_level": (0.0, 1.0),
    "coat_roughness": (0.0, 1.0), "coat_ior": (1.0, 4.0), "coat_tint": (0.0, 1.0), "sheen_roughness": (0.0, 1.0),
    "thin_film_thickness": (0.0, 1e5), "thin_film_ior": (1.0, 1000.0),
}  # fmt: skip
COSINES = (1.0, 0.999999, 0.5, 1e-2, 1e-4, 1e-7)


def directions(rng: np.random.Generator) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """View and light, float32 (3, LANES)."""

    def drawn() -> NDArray[np.float32]:
        z = rng.choice(COSINES, LANES) * rng.choice([1, -1], LANES, p=[0.8, 0.2])
        phi, sine = rng.choice([0, np.pi / 2, np.pi, 1.0, 4.0], LANES), np.sqrt(1 - z * z)
        return np.stack([sine * np.cos(phi), sine * np.sin(phi), z]).astype(np.float32)

    view, light = drawn(), drawn()
    kind = rng.integers(0, 8, LANES)
    for number, factors in ((0, (-1, -1, 1)), (1, (1, 1, 1)), (2, (-1, -1, -1))):
        light[:, kind == number] = view[:, kind == number] * np.array(factors, np.float32)[:, None]
    return view, light


def corners(
    rng: np.random.Generator, table: ParameterTable, limits: dict[str, tuple[float, float]], skip: tuple[str, ...] = ()
) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for item in table:
        low, high = limits.get(item.name, (item.lower, item.upper))
        drawn = rng.choice([low, high, 0.5 * (low + high)], (item.size, LANES), p=[0.4, 0.4, 0.2]).astype(np.float32)
        parts = [mi.Float(component) for component in drawn]
        values[item.name] = parts[0] if item.size == 1 else mi.Color3f(*parts)
    return {name: value for name, value in values.items() if name not in skip}


def assert_finite(what: str, array: Any) -> NDArray[np.float32]:
    numbers = np.array(array).reshape(-1, LANES)
    bad = ~np.isfinite(numbers).all(axis=0)
    assert not bad.any(), f"{what} is not finite in {bad.sum()} of {LANES} lanes, the first is {np.flatnonzero(bad)[0]}"
    return numbers


@pytest.mark.parametrize("model", ["blender_principled", "mitsuba_principled"])
def test_values_and_derivatives_in_the_box_of_a_fit(model: str) -> None:
    rng = np.random.default_rng(1)
    view, light = (mi.Vector3f(d) for d in directions(rng))
    if model == "blender_principled":
        parameters = corners(rng, BLENDER_PRINCIPLED, {})
        dr.enable_grad(parameters)
        value = blender_principled(parameters, view, light)
    else:
        table = MitsubaPrincipled().table
        parameters = corners(rng, table, {}, skip=("spec_trans", "eta"))
        dr.enable_grad(parameters)
        value = MitsubaPrincipled().evaluate(parameters, view, light)
    assert assert_finite("value", value).min() >= 0
    dr.backward(value.x + value.y + value.z)
    gradients = {name: dr.grad(parameter) for name, parameter in parameters.items()}
    dr.eval(gradients)  # one kernel for all of them
    for name, gradient in gradients.items():
        assert_finite(f"derivative by {name}", gradient)


def test_value_density_and_sample_of_all_that_blender_allows() -> None:
    rng = np.random.default_rng(2)
    view, light = (mi.Vector3f(d) for d in directions(rng))
    layers = layer_stack(corners(rng, BLENDER_PRINCIPLED, BLENDER_LIMITS), view, ALL_LOBES, BLENDER_5_0)
    choice = lobe_choice(layers, with_transparency=True)
    local = layers.to_frame(light)
    assert assert_finite("value", evaluate(layers, local)).min() >= 0
    assert assert_finite("density", pdf(layers, choice, local, reachable_only=True)).min() >= 0
    # the ends of the unit interval as PCG32 gives them
    numbers = [mi.Float(rng.choice([0, 0.25, 0.5, 0.99999994], LANES).astype(np.float32)) for _ in range(3)]
    drawn, _, valid = sample(layers, choice, numbers[0], mi.Point2f(numbers[1], numbers[2]))
    drawn, valid = assert_finite("direction", dr.select(valid, drawn, mi.Vector3f(0, 0, 1))), np.array(valid)
    # a refraction at an IOR next to 1 or 1000 is the difference of nearly equal vectors
    assert np.abs(np.linalg.norm(drawn[:, valid], axis=0) - 1).max() < 2e-2
