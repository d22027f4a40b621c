# SPDX-License-Identifier: Apache-2.0
"""The medium below a surface. Oracles: random walks in NumPy in a half-space, finite differences."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray

from mfo_backend.material.arrays.dual import Dual
from mfo_backend.material.cycles_model import cycles_model
from mfo_backend.material.principled import random_walk
from mfo_backend.material.principled.random_walk import SHORTENED, Medium

COLOURS = (0.05, 0.3, 0.8)
WALKS, MOST = 40_000, 2000


def medium(colour: Any, g: float = 0.0, method: str = "RANDOM_WALK", scale: Any = 0.5, version: Any = (5, 0)) -> Medium:
    values = {"base_color": mi.Color3f(colour), "subsurface_radius": mi.Color3f(1.0, 0.2, 0.1)}
    numbers = {"subsurface_scale": scale, "subsurface_anisotropy": g, "subsurface_ior": 1.4}
    return Medium.of(
        values | {k: mi.Float(v) for k, v in numbers.items()}, cycles_model(version, subsurface_method=method)
    )


def walks_out_of_a_half_space(extinction: float, g: float) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Whether walks come out, with their collisions and lengths; none is absorbed, they enter to all sides alike."""
    rng = np.random.default_rng(3)
    cosine = -np.sqrt(rng.uniform(size=WALKS))
    depth, length, collisions = np.zeros(WALKS), np.zeros(WALKS), np.zeros(WALKS, int)
    inside, out = np.ones(WALKS, bool), np.zeros(WALKS, bool)
    for _ in range(MOST):
        free = rng.exponential(1.0 / extinction, WALKS)
        surface = np.where(cosine > 0.0, depth / np.maximum(cosine, 1e-9), np.inf)
        leaves = inside & (surface < free)
        length += np.where(inside, np.minimum(free, surface), 0.0)
        out |= leaves
        inside &= ~leaves
        depth -= np.where(inside, free * cosine, 0.0)
        collisions += inside
        u = rng.uniform(size=WALKS)
        bent = 1.0 - 2.0 * u if g == 0.0 else (1 + g * g - ((1 - g * g) / (1 + g - 2 * g * u)) ** 2) / (2 * g)
        sine = np.sqrt(np.maximum(1.0 - bent**2, 0.0)) * np.sqrt(np.maximum(1.0 - cosine**2, 0.0))
        cosine = np.clip(cosine * bent + sine * np.cos(2 * np.pi * rng.uniform(size=WALKS)), -1.0, 1.0)
        if not inside.any():
            break
    return out, collisions, length


@pytest.mark.parametrize(("g", "version"), [(0.0, (5, 0)), (0.5, (5, 0)), (0.0, (5, 2)), (0.5, (5, 2)), (-0.4, (5, 2))])
def test_a_half_space_reflects_its_colour(g: float, version: Any) -> None:
    """The inversion is a fit: at an anisotropy of 0.5 it is 0.042 off for the brightest."""
    below = medium(COLOURS, g, version=version)
    out, collisions, _ = walks_out_of_a_half_space(1.0, g)
    for k, colour in enumerate(COLOURS):
        reflected = float(below.share[k][0]) * np.mean(out * float(below.albedo[k][0]) ** collisions)
        assert abs(reflected - colour) < 0.05, (k, reflected)


def test_a_walk_for_one_medium_tells_the_light_of_another() -> None:
    """Walks that were drawn for one extinction, at all lengths up to which both are likely."""
    below = medium((0.3, 0.5, 0.7))
    drawn = 1.3 * float(below.extinction[1][0])
    out, collisions, length = walks_out_of_a_half_space(drawn, 0.0)
    log_density = collisions * np.log(drawn) - drawn * length
    carried = below.carried(*(mi.Float(v.astype(np.float32)) for v in (collisions, length, log_density)))
    direct_out, direct, _ = walks_out_of_a_half_space(1.0, 0.0)  # what leaves does not depend on the scale
    albedo = float(below.albedo[1][0])
    expected = np.mean(direct_out * albedo**direct)
    found = out * carried[1].numpy()
    assert abs(found.mean() - expected) < 4.0 * found.std() / WALKS**0.5 + 0.005


def test_how_far_light_goes() -> None:
    paths = [1.0 / e[0] for e in medium(COLOURS).extinction]
    np.testing.assert_allclose(paths, np.array([1.0, 0.2, 0.1]) * 0.5 * SHORTENED, rtol=1e-5)
    bent = [1.0 / e[0] for e in medium(COLOURS, 0.5).extinction]
    np.testing.assert_allclose(bent, np.array(paths) / 2.0, rtol=1e-5)
    for method, shortened in (("RANDOM_WALK", 1.0), ("RANDOM_WALK_LEGACY", SHORTENED)):
        later = [1.0 / e[0] for e in medium(COLOURS, method=method, version=(5, 2)).extinction]
        np.testing.assert_allclose(later, np.array([1.0, 0.2, 0.1]) * 0.5 * shortened, rtol=1e-5)


@pytest.mark.parametrize("colours", [(0.2, 0.5, 0.9), (5e-5, 0.97, 0.999)])
def test_skin_goes_as_far_as_the_bisection_of_cycles_says(colours: tuple[float, float, float]) -> None:
    skin = medium(colours, method="RANDOM_WALK_SKIN")
    inverse = 1.0 / 1.4
    fresnel = inverse * (-1.44 * inverse + 0.71) + 0.668 + 0.0636 * 1.4
    boundary = 4.0 / 3.0 * (1.0 + fresnel) / (1.0 - fresnel)

    def reflected(reduced: float) -> float:
        root = np.sqrt(3.0 * (1.0 - reduced))
        return 0.5 * reduced * (1.0 + np.exp(-boundary * root)) * np.exp(-root)

    for colour, radius, extinction in zip(colours, (1.0, 0.2, 0.1), skin.extinction, strict=True):
        low, high, middle = 0.0, 1.0, 0.0
        for _ in range(12):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if reflected(middle) < colour else (low, middle)
        middle = 0.0 if colour < 1e-4 else 0.999999 if colour >= 0.995 else middle
        path = radius * 0.5 * np.sqrt(3.0 * (1.0 - middle))
        assert extinction[0] == pytest.approx(1.0 / path, rel=0.01)  # one less 0.999999 is coarse in single precision


@pytest.mark.parametrize("method", ["RANDOM_WALK", "RANDOM_WALK_SKIN"])
@pytest.mark.parametrize("name", ["base_color", "subsurface_scale"])
def test_slopes_are_differences(name: str, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The colour of skin counts in steps, whose slope is that of finer ones."""
    monkeypatch.setattr(random_walk, "BISECTIONS", 22)
    model, step = cycles_model(subsurface_method=method), 1e-3

    def carried(moved: float, *, slopes: bool = False) -> Any:
        values = {
            "base_color": mi.Color3f(0.6, 0.3, 0.2), "subsurface_radius": mi.Color3f(1.0, 0.2, 0.1),
            "subsurface_scale": mi.Float(0.5), "subsurface_anisotropy": mi.Float(0.2), "subsurface_ior": mi.Float(1.4),
        }  # fmt: skip
        values[name] = values[name] + moved
        walk = [mi.Float(7.0), mi.Float(0.01), mi.Float(30.0)]
        if slopes:
            one = {0: type(values[name])(1.0)}
            values = {key: Dual(value, one if key == name else {}) for key, value in values.items()}
            walk = [Dual(value) for value in walk]
        return Medium.of(values, model).carried(*walk)

    found = np.array(carried(0.0, slopes=True).slopes[0]).ravel()
    expected = (np.array(carried(step)) - np.array(carried(-step))).ravel() / (2.0 * step)
    np.testing.assert_allclose(found, expected, rtol=0.01)
