# SPDX-License-Identifier: Apache-2.0
"""Derivatives of the Principled function by every parameter, against central differences in double precision."""

from __future__ import annotations

import itertools
from functools import cache
from typing import Any

import drjit as dr
import numpy as np
import pytest
from numpy.typing import NDArray

from mfo_backend.material.arrays.own_memory import own_memory
from mfo_backend.material.principled.blender_principled import blender_principled
from mfo_backend.material.principled.principled_parameters import BLENDER_PRINCIPLED

CASES = 4000
# Emission is no part of the BSDF
NAMES = [name for name in BLENDER_PRINCIPLED.names if not name.startswith("emission")]
MIX = np.array([1.0, 0.7, -0.4])  # the scalar that is differentiated: a fixed combination of the channels
Array = NDArray[np.float64]
Values = dict[str, Array]


def directions(rng: np.random.Generator, lowest: float) -> Array:
    """(3, CASES), cosines log-uniform from `lowest`, so that grazing ones are common."""
    mu, phi = np.exp(rng.uniform(np.log(lowest), 0, CASES)), rng.uniform(0, 2 * np.pi, CASES)
    sine = np.sqrt(1 - mu**2)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), mu])


def scene(seed: int) -> tuple[Array, Array, Values]:
    """View, light and a value of every parameter, each (components, CASES); a quarter crosses the surface."""
    rng = np.random.default_rng(seed)
    view, light = directions(rng, 0.003), directions(rng, 0.003)
    light[2, : CASES // 4] *= -1
    view[2, CASES // 8 : CASES // 4] *= -1
    light[2, CASES // 8 : CASES // 4] *= -1
    return view, light, {p.name: rng.uniform(p.lower, p.upper, (p.size, CASES)) for p in BLENDER_PRINCIPLED}


def arrays(values: Values, number: type, vector: type) -> dict[str, Any]:
    # where NumPy happens to put an array makes another kernel otherwise, each of which compiles for seconds
    own = {k: [own_memory(c, number) for c in v] for k, v in values.items()}
    return {k: v[0] if len(v) == 1 else vector(*v) for k, v in own.items()}


def value(view: Array, light: Array, values: Values) -> Array:
    """The mixed channels, (CASES,)."""
    number, vector = dr.llvm.ad.Float64, dr.llvm.ad.Array3f64
    view_array, light_array = (vector(*(own_memory(c, number) for c in d)) for d in (view, light))
    result = blender_principled(arrays(values, number, vector), view_array, light_array)
    return MIX @ np.array(result)


def derivatives(view: Array, light: Array, values: Values, double: bool = True) -> Values:
    """By every component of every parameter, each (components, CASES), in one reverse pass."""
    types = (dr.llvm.ad.Float64, dr.llvm.ad.Array3f64) if double else (dr.llvm.ad.Float, dr.llvm.ad.Array3f)
    number, vector = types
    parameters = arrays(values, *types)
    dr.enable_grad(parameters)
    view_array, light_array = (vector(*(own_memory(c, number) for c in d)) for d in (view, light))
    result = blender_principled(parameters, view_array, light_array)
    dr.backward(float(MIX[0]) * result.x + float(MIX[1]) * result.y + float(MIX[2]) * result.z)
    gradients = {name: dr.grad(parameters[name]) for name in NAMES}
    dr.eval(gradients)
    return {name: np.reshape(np.array(g, float), values[name].shape) for name, g in gradients.items()}


@cache
def smooth_scene() -> tuple[Array, Array, Values, Values]:
    view, light, values = scene(3)
    return view, light, values, derivatives(view, light, values)


@pytest.mark.parametrize("name", NAMES)
def test_derivative_is_the_finite_difference(name: str) -> None:
    view, light, values, gradient = smooth_scene()
    item = BLENDER_PRINCIPLED[name]
    step = 2e-6 * (item.upper - item.lower)
    middle = value(view, light, values)
    for component in range(item.size):
        moved = []
        for sign in (-1, 1):
            changed = values[name].copy()
            changed[component] += sign * step
            moved.append(value(view, light, {**values, name: changed}))
        left, right = (middle - moved[0]) / step, (moved[1] - middle) / step
        difference, found = 0.5 * (left + right), gradient[name][component]
        # Left out are the kinks: table nodes, clamps, the largest of three channels, the onset of total reflection
        scale = np.abs(difference) + 1e-3 * np.abs(middle) + 1e-9
        smooth = np.abs(left - right) < 2e-3 * scale
        error = np.abs(found - difference) / scale
        assert np.mean(smooth) > 0.95
        assert np.max(error[smooth]) < 1e-3, np.sort(error[smooth])[-5:]


@pytest.mark.parametrize("double", [True, False], ids=["double", "single"])
def test_derivatives_are_finite_on_the_bounds(double: bool) -> None:
    # Every parameter at a bound, at Blender's default or a hair inside: roughness 0.05, views 0.2 degrees off the plane
    view, light, values = scene(4)
    rng = np.random.default_rng(5)
    for p in BLENDER_PRINCIPLED:
        choices = np.array([p.lower, p.upper, np.mean(p.default), p.lower + 1e-7, p.upper - 1e-7])
        values[p.name] = rng.choice(choices, size=values[p.name].shape)
    for name, gradient in derivatives(view, light, values, double).items():
        assert np.all(np.isfinite(gradient)), name


WEIGHTS = (
    "metallic",
    "transmission_weight",
    "coat_weight",
    "sheen_weight",
    "alpha",
    "diffuse_roughness",
    "anisotropic",
    "subsurface_weight",
)


@cache
def at_the_bounds() -> dict[str, Array]:
    """(4,) derivatives by each weight, the others at Blender's defaults: at 0, near 0, at 1 and near 1."""
    places = np.array([0.0, 1e-4, 1.0, 1 - 1e-4])
    count = len(WEIGHTS) * len(places)
    view, light = (np.repeat(np.array(d)[:, None], count, axis=1) for d in ((0.3, 0.2, 0.933), (-0.4, 0.3, 0.866)))
    values = {p.name: np.tile(np.reshape(np.asarray(p.default, float), (-1, 1)), count) for p in BLENDER_PRINCIPLED}
    for index, name in enumerate(WEIGHTS):
        lanes = slice(4 * index, 4 * index + 4)
        values[name][0, lanes] = places
        if name == "subsurface_weight":  # equal to the diffuse lobe where that is Lambert's
            values["diffuse_roughness"][0, lanes] = 0.5
    gradient = derivatives(view, light, values)
    return {name: gradient[name][0, 4 * index : 4 * index + 4] for index, name in enumerate(WEIGHTS)}


@pytest.mark.parametrize("name", WEIGHTS)
def test_a_weight_can_leave_its_bound(name: str) -> None:
    # A lobe that is masked out at weight zero would have no derivative there and could never come back
    found = at_the_bounds()[name]
    assert found[0] == pytest.approx(found[1], rel=2e-2)
    assert found[2] == pytest.approx(found[3], rel=2e-2)
    assert np.all(np.abs(found) > 1e-5)


@pytest.mark.parametrize("name", NAMES)
def test_derivative_on_a_bound_is_the_finite_difference_inwards(name: str) -> None:
    """Half of the cases on the lower bound (0, roughness 0.05), half on the upper; directions down to grazing."""
    view, light, values, _ = smooth_scene()
    if name == "specular_tint":  # at 0 a film on metal has an infinite slope: square roots in its complex index
        values = {**values, "thin_film_thickness": np.zeros((1, CASES))}
    item = BLENDER_PRINCIPLED[name]
    inwards = np.where(np.arange(CASES) % 2, -1.0, 1.0)
    bound = np.where(inwards > 0, item.lower, item.upper)
    step = 2e-6 * (item.upper - item.lower)
    for component in range(item.size):
        rows = []
        for k in range(3):
            changed = values[name].copy()
            changed[component] = bound + k * step * inwards
            rows.append(value(view, light, {**values, name: changed}))
            if k == 0:
                found = derivatives(view, light, {**values, name: changed})[name][component]
        first, second = ((b - a) * inwards / step for a, b in itertools.pairwise(rows))
        difference = 1.5 * first - 0.5 * second  # of second order at the bound itself
        scale = np.abs(difference) + 1e-3 * np.abs(rows[0]) + 1e-9
        smooth = np.abs(first - second) < 2e-3 * scale
        error = np.abs(found - difference) / scale
        assert np.mean(smooth) > 0.9
        assert np.max(error[smooth]) < 1e-3, np.sort(error[smooth])[-5:]
