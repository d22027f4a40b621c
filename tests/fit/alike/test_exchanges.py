# SPDX-License-Identifier: Apache-2.0
"""Solutions in other basins where there is no noise; the pictures are lines of pixels with highlights in them."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.alike.exchanges import (
    F0_OF_LEVEL,
    best_basin,
    metal_exchanged,
    metal_rivals,
    moved,
    taken_for,
    width_rivals,
)
from mfo_backend.fit.squares.residuals import normal_equations
from mfo_backend.render.paths.recorded_image import TwoSamples
from mfo_backend.solve.bounded_least_squares import SolveLimits, solve_bounded
from mfo_backend.types.parameter import Parameter, ParameterTable

LOBES = ("base_color", "roughness", "specular_ior_level", "coat_weight", "coat_roughness")
COATED = ParameterTable(Parameter(name, 1, 0.02 if "roughness" in name else 0.0, 1.0, 0.5) for name in LOBES)
PLAIN = ParameterTable(
    [Parameter("base_color", 3, 0.0, 1.0, (0.5,) * 3)]
    + [Parameter(name, 1, 0.02, 1.0, 0.5) for name in ("metallic", "roughness", "specular")]
)
FLAT = ParameterTable(Parameter(name, 1, 0.0, 1.0, 0.5) for name in ("base_color", "flatness", "metallic"))
PIXELS = np.linspace(-3.0, 3.0, 600)


def two_highlights(x):
    color, roughness, level, weight, coat_roughness = x
    base = 2.0 * level * np.exp(-0.5 * (PIXELS / roughness) ** 2)
    coat = weight * np.exp(-0.5 * (PIXELS / coat_roughness) ** 2)
    return np.repeat((0.1 + 0.2 * color + base + coat)[:, None], 3, 1)


def f0_of(x):
    color, metallic, level = x[:3], x[3], x[5]
    return (1.0 - metallic) * F0_OF_LEVEL * level + metallic * color


def reflectance(x):
    """A highlight as high as the reflectance at normal incidence, on the diffuse light that is no metal's."""
    color, metallic, roughness = x[:3], x[3], x[4]
    lobe = np.exp(-0.5 * (PIXELS / roughness) ** 2)[:, None]
    return 1e-3 + (1.0 - metallic) * color / np.pi + f0_of(x) * lobe / roughness


class Line:
    """The problem of a picture without noise, in relative residuals."""

    def __init__(self, picture, table, truth, error=0.0):
        def derivatives(x):
            steps = 1e-6 * np.eye(len(x))
            columns = [(picture(x + step) - picture(x - step)) / 2e-6 for step in steps]
            return np.stack([picture(x), *columns], -1)

        data = picture(truth) * (1.0 + error * np.random.default_rng(1).normal(size=(len(PIXELS), 1)))
        self.table, self.independent = table, 1.5 * len(PIXELS)
        self.residual = lambda image: ((image - data) / data, 1.0 / data)
        self.equations = normal_equations(derivatives, self.residual)
        self.evaluate = SimpleNamespace(samples=lambda x: TwoSamples(derivatives(x), None))

    def solve(self, start, wanted=0.0, evaluations=40):
        limits = SolveLimits(evaluations=evaluations, cost_change=1e-7, known=np.inf, wanted=wanted)
        return solve_bounded(self.equations, start, self.table.lower, self.table.upper, limits)


def vector(table, **values):
    return table.pack({p.name: (values[p.name],) * p.size if p.size > 1 else values[p.name] for p in table})


@pytest.mark.parametrize(("roughness", "coat_roughness"), [(0.5, 0.1), (0.15, 0.6)])
def test_a_fit_with_the_highlights_the_wrong_way_round_finds_out(roughness, coat_roughness):
    truth = vector(COATED, base_color=0.4, roughness=roughness, specular_ior_level=0.9, coat_weight=0.7,
                   coat_roughness=coat_roughness)  # fmt: skip
    line = Line(two_highlights, COATED, truth)
    wrong = truth.copy()
    wrong[1], wrong[2], wrong[3], wrong[4] = coat_roughness, 0.3, 1.0, roughness
    found = line.solve(wrong)
    assert found.equations.cost > 5e-4  # another basin
    better = best_basin(line.solve, found, COATED)
    np.testing.assert_allclose(better.x, truth, atol=1e-3)


def test_what_is_solved_is_left_alone():
    truth = vector(COATED, base_color=0.4, roughness=0.5, specular_ior_level=0.6, coat_weight=0.7, coat_roughness=0.1)
    line = Line(two_highlights, COATED, truth)
    found = line.solve(truth + 0.01)

    def never(*_):
        raise AssertionError("nothing to look for")

    assert best_basin(never, found, COATED) is found


def flat_or_metal(x):
    """Flatness takes light from the rims; a metal takes it everywhere and gives it back in the middle."""
    color, flatness, metallic = x
    diffuse = (1.0 - metallic) * color * (1.0 - 0.5 * flatness * (PIXELS / 3.0) ** 2)
    return np.repeat((1e-3 + diffuse + metallic * color * np.exp(-0.5 * PIXELS**2))[:, None], 3, 1)


def test_a_flat_lobe_that_stands_for_a_metals_share_is_found_out():
    truth = vector(FLAT, base_color=0.6, flatness=0.0, metallic=0.4)
    line = Line(flat_or_metal, FLAT, truth)
    wrong = vector(FLAT, base_color=0.5, flatness=0.6, metallic=0.0)
    (start,) = moved(wrong, FLAT)
    np.testing.assert_allclose(start, [0.5, 0.0, 0.5])
    held = replace(line.solve(wrong), x=wrong, equations=line.equations(wrong))
    np.testing.assert_allclose(best_basin(line.solve, held, FLAT).x, truth, atol=1e-3)


def test_where_nothing_is_flat_no_flat_lobe_stands_for_anything():
    assert list(moved(vector(FLAT, base_color=0.5, flatness=0.001, metallic=0.0), FLAT)) == []


@pytest.mark.parametrize(("metallic", "other"), [(0.1, 0.98), (0.45, 0.98), (0.55, 0.02), (0.9, 0.02)])
def test_where_light_is_sampled_a_metal_is_first_taken_for_a_dielectric(metallic, other):
    x = vector(PLAIN, base_color=0.3, metallic=metallic, roughness=0.4, specular=0.5)
    (taken,) = taken_for(x, PLAIN)
    np.testing.assert_allclose(taken, [0.3, 0.3, 0.3, other, 0.4, 0.5])
    dark, brighter = taken_for(vector(FLAT, base_color=0.5, flatness=0.6, metallic=0.0), FLAT)
    np.testing.assert_allclose([dark, brighter], [[0.5, 0.6, 0.98], [0.5, 0.0, 0.5]])


@pytest.mark.parametrize("metallic", [0.3, 0.9])
def test_a_dark_metal_and_a_black_dielectric_are_doubts_of_each_other(metallic):
    truth = vector(PLAIN, base_color=0.002, metallic=0.1, roughness=0.4, specular=0.5)
    line = Line(reflectance, PLAIN, truth, error=0.002)
    found = line.solve(metal_exchanged(truth, PLAIN) if metallic > 0.5 else truth)
    assert (found.x[3] > 0.5) == (metallic > 0.5)
    best, (rival,) = metal_rivals(line, line.solve, found, PLAIN)
    assert best.equations.cost <= found.equations.cost
    assert abs(rival.x[3] - best.x[3]) > 0.5
    assert 0.01 < rival.share <= 0.5


@pytest.mark.parametrize(
    "values",
    [
        {"base_color": 0.5, "metallic": 0.1, "roughness": 0.4, "specular": 0.5},
        {"base_color": 0.6, "metallic": 0.95, "roughness": 0.4, "specular": 0.5},
    ],
    ids=["coloured", "bright metal"],
)
def test_what_is_not_dark_has_no_such_doubt(values):
    truth = vector(PLAIN, **values)
    assert metal_exchanged(truth, PLAIN) is None
    line = Line(reflectance, PLAIN, truth, error=0.002)
    found = line.solve(truth)
    assert metal_rivals(line, line.solve, found, PLAIN) == (found, ())


def test_the_exchange_keeps_the_reflectance():
    truth = vector(PLAIN, base_color=0.002, metallic=0.1, roughness=0.4, specular=0.5)
    metal = metal_exchanged(truth, PLAIN)
    back = metal_exchanged(metal, PLAIN)
    assert metal[3] > 0.9
    assert back[3] < 0.1
    # all but the two per cent that are left of the other kind
    np.testing.assert_allclose([f0_of(metal), f0_of(back)], [f0_of(truth)] * 2, rtol=0.05)


BRUSHED = ParameterTable([Parameter("roughness", 1, 0.02, 1.0, 0.5), Parameter("anisotropic", 1, 0.0, 1.0, 0.5)])


def widths(x):
    """Of Blender's anisotropic lobe (`material/principled/layers.py`)."""
    roughness, stretch = x[0], np.sqrt(1.0 - 0.9 * x[1])
    return min(roughness**2 / stretch, 1.0), roughness**2 * stretch


def brushed(x):
    wide, narrow = (np.exp(-0.5 * (PIXELS / width) ** 2) for width in widths(x))
    return np.repeat((0.1 + wide + narrow)[:, None], 3, 1)


@pytest.mark.parametrize(
    "truth",
    [[0.85, 0.9], [0.8, 0.99], [0.95, 0.3]],  # the far end has the least stretch, or the largest roughness
)
def test_a_fit_short_of_the_widest_lobe_has_the_far_end_of_what_looks_alike_as_its_rival(truth):
    line = Line(brushed, BRUSHED, np.array(truth), 1e-3)
    wide, narrow = widths(truth)
    assert wide == 1.0
    short = np.sqrt(narrow / 0.995)  # of the stretch with which the larger width is 0.995
    x = np.array([np.sqrt(narrow / short), (1.0 - short**2) / 0.9])
    (rival,) = width_rivals(line, x, BRUSHED)
    assert rival.last
    assert widths(rival.x) == pytest.approx((1.0, narrow), rel=1e-6)
    least = max(narrow, np.sqrt(0.1))
    assert rival.x == pytest.approx([np.sqrt(narrow / least), (1.0 - least**2) / 0.9])
    # a value that is as likely anywhere between them
    steps = np.linspace(0.0, 1.0, 1001)
    assert rival.share == pytest.approx(np.mean(steps**2), rel=0.01)


@pytest.mark.parametrize("truth", [[0.5, 0.5], [0.8, 0.55]])
def test_widths_below_the_widest_are_told_apart(truth):
    assert widths(truth)[0] < 0.95
    line = Line(brushed, BRUSHED, np.array(truth), 1e-3)
    assert width_rivals(line, np.array(truth), BRUSHED) == ()


def test_one_of_the_two_values_alone_has_no_rival():
    table = ParameterTable([BRUSHED["roughness"]])
    line = Line(lambda x: brushed([x[0], 0.9]), table, np.array([0.85]))
    assert width_rivals(line, np.array([0.85]), table) == ()
