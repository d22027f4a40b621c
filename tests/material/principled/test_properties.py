# SPDX-License-Identifier: Apache-2.0
"""What holds for every material of the box: light is finite and never negative, densities and samples agree.

Single materials are drawn by hypothesis, which shrinks a failure to a simple one; then all corners are tried, with
equal channels in colours.
"""

from __future__ import annotations

import math
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from hypothesis import given

from mfo_backend.material.arrays.own_memory import own_memory
from mfo_backend.material.mitsuba_parameters import MITSUBA_PRINCIPLED, eta_to_specular, specular_to_eta
from mfo_backend.material.mitsuba_principled import MitsubaPrincipled
from mfo_backend.material.principled.blender_principled import BLENDER_5_0, blender_principled, evaluate
from mfo_backend.material.principled.layers import layer_stack
from mfo_backend.material.principled.lobe_sampling import lobe_choice, pdf, sample
from mfo_backend.material.principled.needed_lobes import ALL_LOBES
from mfo_backend.material.principled.principled_parameters import (
    BLENDER_PRINCIPLED,
    PARAMETER_OF_SOCKET,
    SOCKET_OF_PARAMETER,
    parameter_to_socket,
)

from ..boxes import box, component

LANES = 512  # directions for each material
CHUNK = 1 << 18  # corners in one launch


def hemisphere(count: int, seed: int, both: bool) -> mi.Vector3f:
    """Directions over one or both sides, every fourth one grazing."""
    rng = np.random.default_rng(seed)
    z = rng.random(count)
    z[::4] *= 1e-3
    if both:
        z *= rng.choice([-1.0, 1.0], count)
    phi, sine = rng.random(count) * 2 * np.pi, np.sqrt(1 - z * z)
    return mi.Vector3f(np.stack([sine * np.cos(phi), sine * np.sin(phi), z]).astype(np.float32))


def as_arrays(values: dict[str, Any]) -> dict[str, Any]:
    """Numbers as data of the kernel, so that the next material compiles nothing."""
    arrays = {k: mi.Color3f(*v) if isinstance(v, tuple) else mi.Float(v) for k, v in values.items()}
    dr.make_opaque(arrays)
    return arrays


def finite(what: str, array: Any) -> np.ndarray:
    numbers = np.array(array)
    assert np.isfinite(numbers).all(), f"{what} is not finite"
    return numbers


PERIODIC = [parameter for parameter in BLENDER_PRINCIPLED if math.isfinite(parameter.period)]


@pytest.mark.parametrize("parameter", PERIODIC, ids=lambda parameter: parameter.name)
@given(values=box(BLENDER_PRINCIPLED))
def test_a_value_a_period_away_is_the_same_material(parameter: Any, values: dict[str, Any]) -> None:
    view, light = hemisphere(LANES, 1, both=False), hemisphere(LANES, 2, both=True)
    here = {**values, parameter.name: values[parameter.name] * parameter.period}
    found = []
    for moved in (here, {**here, parameter.name: here[parameter.name] + parameter.period}):
        layers = layer_stack(as_arrays(moved), view, ALL_LOBES, BLENDER_5_0)
        found.append(np.array(evaluate(layers, layers.to_frame(light))))
    np.testing.assert_allclose(found[0], found[1], rtol=0.02, atol=1e-4 * np.abs(found[0]).max())


@given(values=box(BLENDER_PRINCIPLED))
def test_blender_s_values_densities_and_samples(values: dict[str, Any]) -> None:
    view, light = hemisphere(LANES, 1, both=False), hemisphere(LANES, 2, both=True)
    layers = layer_stack(as_arrays(values), view, ALL_LOBES, BLENDER_5_0)
    choice = lobe_choice(layers, with_transparency=True)
    total = sum(finite("probability", p) for p in choice.probability.values())
    np.testing.assert_allclose(total, 1.0, atol=1e-5)
    assert finite("value", evaluate(layers, layers.to_frame(light))).min() >= 0
    assert finite("density", pdf(layers, choice, layers.to_frame(light), reachable_only=True)).min() >= 0
    rng = np.random.default_rng(3)
    u = [own_memory(rng.random(LANES), mi.Float) for _ in range(3)]
    drawn, lobe, valid = sample(layers, choice, u[0], mi.Point2f(u[1], u[2]))
    drawn = dr.select(valid, drawn, mi.Vector3f(0, 0, 1))
    np.testing.assert_allclose(np.linalg.norm(finite("sample", drawn), axis=0), 1.0, atol=2e-2)
    density = finite("density of a sample", pdf(layers, choice, drawn, reachable_only=True))
    assert (density >= 0).all()
    # what is drawn from the diffuse lobe above the surface has the density of that lobe at least
    diffuse = np.array(valid & (lobe == 5) & (drawn.z > 0.01))
    share = np.broadcast_to(np.array(choice["diffuse"]), LANES)
    cosine = np.array(drawn.z)
    assert (density[diffuse] >= (share * cosine / np.pi)[diffuse] * (1 - 1e-4)).all()


@given(values=box(MITSUBA_PRINCIPLED.select([n for n in MITSUBA_PRINCIPLED.names if n not in ("spec_trans", "eta")])))
def test_mitsuba_s_values(values: dict[str, Any]) -> None:
    view, light = hemisphere(LANES, 1, both=False), hemisphere(LANES, 2, both=True)
    value = finite("value", MitsubaPrincipled().evaluate(as_arrays(values), view, light))
    assert value.min() >= 0
    assert (value[:, np.array(light.z) < 0] == 0).all()


def corner_values(table: Any, first: int, count: int) -> dict[str, Any]:
    """Corners `first` to `first + count`, bit k of the number choosing the end of parameter k."""
    number = np.arange(first, first + count)
    values: dict[str, Any] = {}
    for k, p in enumerate(table):
        numbers = own_memory(np.where(number >> k & 1, p.upper, p.lower), mi.Float)
        values[p.name] = mi.Color3f(numbers) if p.size == 3 else numbers
    return values


def test_all_corners_of_blender_s_box() -> None:
    # emission and what is inside belong to no BSDF, and others to other shaders, which look at few besides
    apart = ("emission_", "absorption_", "metal_", "toon_")
    table = BLENDER_PRINCIPLED.select([n for n in BLENDER_PRINCIPLED.names if not n.startswith(apart)])
    rest = {"emission_color": mi.Color3f(0.0), "emission_strength": mi.Float(0.0)}
    worst = math.inf
    for first in range(0, 2 ** len(table), CHUNK):
        view, light = hemisphere(CHUNK, first + 1, both=False), hemisphere(CHUNK, first + 2, both=True)
        parameters = corner_values(table, first, CHUNK) | rest
        worst = min(worst, finite("value", blender_principled(parameters, view, light)).min())
    assert worst >= 0


def test_all_corners_of_mitsuba_s_box() -> None:
    table = MITSUBA_PRINCIPLED.select([n for n in MITSUBA_PRINCIPLED.names if n not in ("spec_trans", "eta")])
    count, repeat = 2 ** len(table), 64
    values = corner_values(table, 0, count * repeat)  # bits beyond the table's change nothing
    view, light = hemisphere(count * repeat, 1, both=False), hemisphere(count * repeat, 2, both=True)
    assert finite("value", MitsubaPrincipled().evaluate(values, view, light)).min() >= 0


@given(specular=component(0.02, 1.0))
def test_specular_to_eta_and_back(specular: float) -> None:
    assert eta_to_specular(specular_to_eta(specular)) == pytest.approx(specular, rel=1e-9)


@pytest.mark.parametrize("table", [BLENDER_PRINCIPLED, MITSUBA_PRINCIPLED], ids=["blender", "mitsuba"])
def test_pack_and_unpack_are_inverse(table: Any) -> None:
    @given(values=box(table))
    def check(values: dict[str, Any]) -> None:
        vector = table.pack(values)
        assert table.unpack(vector) == values
        assert (table.clip(vector) == vector).all()

    check()


def test_socket_names_are_one_to_one() -> None:
    for name in BLENDER_PRINCIPLED.names:
        assert PARAMETER_OF_SOCKET[parameter_to_socket(name)] == name
    assert len(PARAMETER_OF_SOCKET) == len(SOCKET_OF_PARAMETER) == len(BLENDER_PRINCIPLED.names)
