# SPDX-License-Identifier: Apache-2.0
"""Sampling against density and value: chi-square, mean weights, white furnace."""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mfo_backend.material.principled.blender_principled import BLENDER_5_0, evaluate
from mfo_backend.material.principled.layers import Layers, layer_stack
from mfo_backend.material.principled.lobe_sampling import LobeChoice, lobe_choice, pdf, sample
from mfo_backend.material.principled.needed_lobes import needed_lobes

from ..directions import unit
from ..materials import MATERIALS

VIEWS = [unit(20, 30), unit(70, 100), unit(150, 30)]
COUNT = 1 << 17


def stack(parameters: dict[str, Any], view: tuple[float, float, float]) -> tuple[Layers, LobeChoice]:
    layers = layer_stack(parameters, mi.Vector3f(*view), needed_lobes(parameters), BLENDER_5_0)
    return layers, lobe_choice(layers, with_transparency=False)


def grid(rows: int = 300, columns: int = 600) -> tuple[mi.Vector3f, np.ndarray]:
    """Midpoints of a grid over the sphere and their solid angles."""
    theta, phi = (np.arange(rows) + 0.5) * np.pi / rows, (np.arange(columns) + 0.5) * 2 * np.pi / columns
    t, p = (g.ravel() for g in np.meshgrid(theta, phi, indexing="ij"))
    directions = np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)])
    return mi.Vector3f(directions.astype(np.float32)), np.sin(t) * (np.pi / rows) * (2 * np.pi / columns)


def draw(layers: Layers, choice: LobeChoice) -> tuple[mi.Vector3f, mi.Bool]:
    rng: Any = mi.PCG32(COUNT, initstate=7)  # pyright: ignore
    numbers = [mi.Float(rng.next_float32()) for _ in range(3)]
    direction, _, valid = sample(layers, choice, numbers[0], mi.Point2f(numbers[1], numbers[2]))
    return direction, valid


@pytest.mark.parametrize("view", VIEWS, ids=["steep", "flat", "behind"])
@pytest.mark.parametrize("name", MATERIALS)
def test_samples_follow_the_density(name: str, view: tuple[float, float, float]) -> None:
    from mitsuba.chi2 import ChiSquareTest, SphericalDomain

    layers, choice = stack(MATERIALS[name], view)

    def draw_one(numbers: mi.Point3f) -> tuple[mi.Vector3f, mi.Float]:
        direction, _, valid = sample(layers, choice, numbers.x, mi.Point2f(numbers.y, numbers.z))
        return direction, dr.select(valid, mi.Float(1), 0)

    test = ChiSquareTest(
        domain=SphericalDomain(),
        sample_func=draw_one,
        pdf_func=lambda direction: pdf(layers, choice, direction, reachable_only=True),
        sample_dim=3,
        sample_count=300_000,
        res=41,
        ires=16,  # with 8 the narrow coat at a flat view is integrated 1 % wrong
    )
    # One of 30 tests failing by chance one run in a hundred; the numbers are fixed
    assert test.run(0.01, test_count=30, quiet=True), test.messages


@pytest.mark.parametrize("view", VIEWS, ids=["steep", "flat", "behind"])
@pytest.mark.parametrize("name", MATERIALS)
def test_mean_weight_is_the_integral_of_the_value(name: str, view: tuple[float, float, float]) -> None:
    layers, choice = stack(MATERIALS[name], view)
    directions, solid_angle = grid()
    reachable = np.array(pdf(layers, choice, directions, reachable_only=True)) > 0
    integral = (np.array(evaluate(layers, directions)) * solid_angle * reachable).sum(axis=1)
    drawn, valid = draw(layers, choice)
    density = pdf(layers, choice, drawn)
    weights = np.array(dr.select(valid & (density > 0), evaluate(layers, drawn) / density, 0))
    error = weights.std(axis=1) / np.sqrt(COUNT)
    # Four standard errors, and 2e-4 for the grid
    assert np.all(np.abs(weights.mean(axis=1) - integral) < 4 * error + 2e-4), (weights.mean(axis=1), integral)
    # Bounded weights: no lobe is left to the tail of another's density
    assert weights.max() < 4


# Directional albedo of Cycles 5.0.1 (one surface, world of radiance 1, 262144 samples): base (0.9, 0.8, 0.7), glass,
# roughness 0.5, views 20 and 70 degrees off the normal; standard error 1e-4
FURNACE_GLASS = {20: (0.95046, 0.89777, 0.84174), 70: (0.95128, 0.89949, 0.84474)}


@pytest.mark.parametrize("angle", FURNACE_GLASS)
def test_furnace_of_glass_is_that_of_cycles(angle: int) -> None:
    layers, choice = stack({"base_color": (0.9, 0.8, 0.7), "transmission_weight": 1.0}, unit(angle, 0))
    drawn, valid = draw(layers, choice)
    density = pdf(layers, choice, drawn)
    weights = np.array(dr.select(valid & (density > 0), evaluate(layers, drawn) / density, 0))
    error = weights.std(axis=1) / np.sqrt(COUNT) + 1e-4
    assert np.all(np.abs(weights.mean(axis=1) - FURNACE_GLASS[angle]) < 4 * error)


@pytest.mark.parametrize("metallic", [0.0, 1.0])
@pytest.mark.parametrize("roughness", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("angle", [0, 45, 75])
def test_white_furnace_loses_little(metallic: float, roughness: float, angle: int) -> None:
    parameters = {"base_color": (1.0, 1.0, 1.0), "metallic": metallic, "roughness": roughness}
    layers, choice = stack(parameters, unit(angle, 0))
    drawn, valid = draw(layers, choice)
    density = pdf(layers, choice, drawn)
    weights = np.array(dr.select(valid & (density > 0), evaluate(layers, drawn) / density, 0))
    # A white metal returns everything; the plastic's layering is approximate in Cycles too, the tables within 1 %
    assert weights.mean() == pytest.approx(1.0, abs=0.01 if metallic else 0.03)


@pytest.mark.parametrize("view", VIEWS, ids=["steep", "flat", "behind"])
@pytest.mark.parametrize(
    "sockets", [{"transmission_weight": 1.0}, {"transmission_weight": 0.9, "base_color": (0.0,) * 3}]
)
def test_under_glass_the_diffuse_lobe_keeps_a_probability(
    sockets: dict[str, Any], view: tuple[float, float, float]
) -> None:
    lobes = needed_lobes({"transmission_weight": 0.5})
    layers = layer_stack(sockets, mi.Vector3f(*view), lobes, BLENDER_5_0)
    own, floored = (lobe_choice(layers, with_transparency=False, least_diffuse=least) for least in (0.0, 0.02))
    assert float(own["diffuse"][0]) < 1e-4
    assert float(floored["diffuse"][0]) == pytest.approx(0.02)
    assert sum(float(p[0]) for p in floored.probability.values()) == pytest.approx(1.0)
    # the others share what is left as before
    left = {name: float(p[0]) for name, p in own.probability.items() if name != "diffuse"}
    assert {name: float(floored[name][0]) for name in left} == pytest.approx(
        {n: 0.98 * p for n, p in left.items()}, rel=1e-4
    )


def test_a_diffuse_lobe_that_is_likely_or_alone_stays_as_it_is() -> None:
    for sockets in ({"transmission_weight": 0.5}, {}):
        layers, own = stack(sockets, VIEWS[0])
        floored = lobe_choice(layers, with_transparency=False, least_diffuse=0.02)
        assert {k: float(p[0]) for k, p in floored.probability.items()} == pytest.approx(
            {k: float(p[0]) for k, p in own.probability.items()}
        )


def test_a_coat_is_drawn_about_its_own_normal() -> None:
    """A sharp coat tilted by 20 degrees over black: each weight is near the albedo, whichever direction is drawn."""
    up, tilted = mi.Vector3f(0.0, 0.0, 1.0), mi.Vector3f(*unit(20, 70))
    parameters: dict[str, Any] = {
        "base_color": mi.Color3f(0.0), "specular_ior_level": mi.Float(0.0), "coat_weight": mi.Float(1.0),
        "coat_roughness": mi.Float(0.05), "smooth_normal": up, "bumped_normal": up, "coat_normal": tilted,
    }  # fmt: skip
    layers, choice = stack(parameters, unit(30, 100))
    drawn, valid = draw(layers, choice)
    density = pdf(layers, choice, drawn)
    weights = np.array(dr.select(valid & (density > 0), evaluate(layers, drawn) / density, 0))[0]
    directions, solid_angle = grid(1200, 2400)
    integral = float((np.array(evaluate(layers, directions))[0] * solid_angle).sum())
    assert integral > 0.03
    assert weights.mean() == pytest.approx(integral, rel=0.02)
    assert weights.std() < 0.5 * integral


@pytest.mark.parametrize("name", ["plastic", "sheen alone", "glass", "mixture"])
def test_diffuse_lobes_are_drawn_about_a_normal_that_turns_away(name: str) -> None:
    """A mesh's normal 105 degrees off the view: without light from below the microfacets' plane a fifth is lost."""
    away = {"smooth_normal": mi.Vector3f(*unit(65, 30))}
    layers, choice = stack({k: _known(v) for k, v in MATERIALS[name].items()} | away, unit(40, 210))
    directions, solid_angle = grid()
    reachable = np.array(pdf(layers, choice, directions, reachable_only=True)) > 0
    values = np.array(evaluate(layers, directions)) * solid_angle
    integral = (values * reachable).sum(axis=1)
    drawn, valid = draw(layers, choice)
    density = pdf(layers, choice, drawn)
    weights = np.array(dr.select(valid & (density > 0), evaluate(layers, drawn) / density, 0))
    error = weights.std(axis=1) / np.sqrt(COUNT)
    assert np.all(np.abs(weights.mean(axis=1) - integral) < 4 * error + 2e-4), (weights.mean(axis=1), integral)
    above = np.array(directions.z) > 0
    below = (values * ~above).sum() / values.sum()
    if name in ("plastic", "sheen alone"):  # without what glass lets through
        assert below > 0.05
        # all of it can be drawn: a lobe that has no direction there is left to chance alone
        assert (values * ~reachable).sum() < 1e-3 * values.sum()


def _known(value: Any) -> Any:
    return mi.Color3f(*value) if isinstance(value, tuple) else mi.Float(value)
