# SPDX-License-Identifier: Apache-2.0
"""Of materials that a picture does not tell apart the simplest is chosen, and the others count as doubt.

The picture is a line of pixels with two Gaussian highlights on a diffuse level: the base's and the coat's.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mfo_backend.fit.alike import simplest as simplest_end
from mfo_backend.fit.alike.compare import Comparison
from mfo_backend.fit.alike.simplest import OtherEnds, coat_to_base, exchanged
from mfo_backend.fit.certainty.covariance import with_rivals
from mfo_backend.fit.squares.problem import Refined, Rival
from mfo_backend.fit.squares.residuals import normal_equations
from mfo_backend.fit.tolerances import HOPELESS
from mfo_backend.render.paths.recorded_image import TwoSamples
from mfo_backend.solve.bounded_least_squares import SolveLimits, solve_bounded
from mfo_backend.types.parameter import Parameter, ParameterTable

NAMES = ("base_color", "specular_ior_level", "roughness", "coat_weight", "coat_roughness")
TABLE = ParameterTable(Parameter(name, 1, 0.02 if "roughness" in name else 0.0, 1.0, 0.5) for name in NAMES)
NO_COAT = TABLE.pack(dict(zip(NAMES, (0.5, 0.5, 0.5, 0.0, 0.2), strict=True)))
COAT = TABLE.pack(dict(zip(NAMES, (0.5, 0.5, 0.5, 0.5, 0.2), strict=True)))
BOX = (TABLE.lower, TABLE.upper)
PIXELS = np.linspace(-3.0, 3.0, 1500)
NOISE = 0.02


def picture(x):
    color, level, roughness, weight, coat_roughness = x
    base = 2.0 * level * np.exp(-0.5 * (PIXELS / roughness) ** 2)
    coat = weight * np.exp(-0.5 * (PIXELS / coat_roughness) ** 2)
    return 0.2 * color * (1.0 - 0.1 * weight) + 0.2 * (base + coat)


def table_of(x):
    """Image and derivatives (g, 3, 1 + k), three equal channels."""
    columns = [picture(x)]
    for i in range(len(x)):
        step = np.zeros(len(x))
        step[i] = 1e-6
        columns.append((picture(x + step) - picture(x - step)) / 2e-6)
    return np.repeat(np.stack(columns, -1)[:, None, :], 3, 1)


class Line:
    """The least-squares problem of a noisy picture of `truth`."""

    def __init__(self, truth, seed=0, fireflies=0.0):
        data = np.repeat(picture(truth)[:, None], 3, 1)
        data = data + NOISE * np.random.default_rng(seed).normal(size=data.shape)
        middle = len(PIXELS) // 2
        data[middle : middle + 2] += fireflies * NOISE
        self.residual = lambda image: ((image - data) / NOISE, np.full_like(data, 1.0 / NOISE))
        self.equations = normal_equations(table_of, self.residual)
        self.evaluate = SimpleNamespace(samples=lambda x: TwoSamples(table_of(x), None))
        self.independent = 1.5 * len(PIXELS)


def solve(problem, start, box, evaluations=12):
    limits = SolveLimits(evaluations=evaluations, cost_change=1e-6, known=np.inf, wanted=np.inf)
    return solve_bounded(problem.equations, start, *box, limits).x


def simplest_from(values, truth, user, seed=0):
    line = Line(truth, seed)
    found = Refined(solve(line, TABLE.pack(dict(zip(NAMES, values, strict=True))), BOX, 40), line, line)
    return found, OtherEnds(solve, user, TABLE).simplest(found)


WITHOUT = TABLE.pack(dict(zip(NAMES, (0.6, 0.4, 0.15, 0.0, 0.3), strict=True)))
BOTH = TABLE.pack(dict(zip(NAMES, (0.6, 0.3, 0.6, 0.5, 0.12), strict=True)))


@pytest.mark.parametrize("seed", range(6))
def test_a_highlight_is_the_base_s_where_the_user_has_no_coat(seed):
    found, last = simplest_from((0.6, 0.02, 0.5, 0.8, 0.15), WITHOUT, NO_COAT, seed)
    assert found.x[3] > 0.3  # it explains the picture as well
    assert last.off == ("coat_weight",)
    np.testing.assert_allclose(last.x[:4], WITHOUT[:4], atol=0.03)
    assert last.x[3] == 0.0
    # the coat is a doubt, and a small one
    assert any(rival.x[3] > 0.3 for rival in last.rivals)
    assert 0.0 < sum(rival.share for rival in last.rivals) < 0.5


@pytest.mark.parametrize("seed", range(6))
def test_highlights_are_exchanged_towards_the_user_s(seed):
    found, last = simplest_from((0.6, 0.25, 0.12, 0.6, 0.6), BOTH, COAT, seed)
    assert found.x[2] < 0.2  # the highlights are the wrong way round
    np.testing.assert_allclose(last.x, BOTH, atol=0.04)
    assert last.off == ()
    (rival,) = last.rivals
    np.testing.assert_allclose(rival.x, found.x)
    assert 0.02 < rival.share < 0.98
    # so that nothing of it is determined
    spread = with_rivals(np.zeros((5, 5)), last.x, last.rivals, TABLE.upper - TABLE.lower)
    apart = rival.share * (rival.x[2] - last.x[2]) ** 2 / 0.98**2
    assert spread[2, 2] == pytest.approx(apart)
    assert np.sqrt(spread[2, 2]) > 0.05


def test_a_coat_that_the_picture_shows_stays():
    found, last = simplest_from(BOTH, BOTH, NO_COAT)
    assert last.x[3] > 0.2
    assert last.all.equations(last.x).cost <= found.all.equations(found.x).cost * 1.01
    assert last.off == ()


def test_two_fireflies_do_not_ask_for_a_coat():
    """Their chi squared is five times what is hopeless; as it comes from two pixels it says next to nothing.

    A narrow highlight asks for one, where more pixels have it.
    """
    line = Line(WITHOUT, fireflies=40.0)
    narrow = TABLE.pack(dict(zip(NAMES, (0.6, 0.4, 0.15, 0.9, 0.02), strict=True)))
    found = Refined(solve(line, narrow, BOX, 40), line, line)
    assert found.x[3] > 0.3
    last = OtherEnds(solve, NO_COAT, TABLE).simplest(found)
    assert line.equations(last.x).cost / line.equations(found.x).cost - 1.0 > 5.0 * HOPELESS / line.independent
    assert last.off == ("coat_weight",)


def test_a_lobe_goes_alone_where_another_one_has_to_stay(monkeypatch):
    def without(self, found, lobes):
        return None if "specular_ior_level" in lobes else replace(found, off=(*found.off, *lobes))

    monkeypatch.setattr(OtherEnds, "_without", without)
    neither = TABLE.pack(dict(zip(NAMES, (0.5, 0.0, 0.5, 0.0, 0.2), strict=True)))
    _, last = simplest_from(BOTH, BOTH, neither)
    assert last.off == ("coat_weight",)


def test_materials_without_a_coat_are_not_looked_at_again():
    line = Line(WITHOUT)
    found = Refined(WITHOUT, line, line, off=("coat_weight",))

    def never(*_, **__):
        raise AssertionError("nothing to try")

    assert OtherEnds(never, NO_COAT, TABLE).simplest(found) is found


def test_exchanging_twice_changes_nothing():
    np.testing.assert_allclose(exchanged(exchanged(BOTH, TABLE), TABLE), BOTH)


def test_the_base_takes_the_coat_s_highlight_over():
    base = coat_to_base(BOTH, TABLE)
    assert dict(zip(NAMES, base, strict=True)) == pytest.approx(
        {"base_color": 0.6, "specular_ior_level": 0.55, "roughness": 0.12, "coat_weight": 0.0, "coat_roughness": 0.12}
    )


def test_doubts_widen_a_covariance_by_their_share():
    width = np.array([1.0, 2.0])
    rivals = (Rival(np.array([0.4, 1.0]), 0.25), Rival(np.array([0.0, 0.0]), 0.0))
    spread = with_rivals(np.eye(2), np.array([0.2, 0.0]), rivals, width)
    np.testing.assert_allclose(spread, np.eye(2) + 0.25 * np.array([[0.04, 0.1], [0.1, 0.25]]))


@pytest.mark.parametrize(("distance", "taken"), [(4.9, False), (100.0, True)], ids=["scatter", "noise alone"])
def test_an_exchange_that_the_user_s_material_speaks_against_has_to_be_clearly_better(monkeypatch, distance, taken):
    # 12 less of chi squared, which scatter between tiles explains where it is larger than the pictures' distance allows
    monkeypatch.setattr(simplest_end, "compare", lambda *_: Comparison(-12.0, 8.3, distance, -12.0))
    swapped = (0.6, 0.25, 0.12, 0.6, 0.6)
    found, last = simplest_from(swapped, BOTH, TABLE.pack(dict(zip(NAMES, swapped, strict=True))))
    np.testing.assert_allclose(last.x, BOTH if taken else found.x, atol=0.04)
    assert len(last.rivals) == 1


@pytest.mark.parametrize(("more", "asked"), [(500.0, True), (20.0, False)])
def test_pictures_are_asked_where_few_tiles_stand_against_the_simpler(monkeypatch, more, asked):
    """Such as those of a small highlight: what no noise explains may still be a firefly, or seen."""
    monkeypatch.setattr(simplest_end, "compare", lambda *_: Comparison(more, 2.0 * more, more, 5.0))
    found, last = simplest_from((0.6, 0.02, 0.5, 0.8, 0.15), WITHOUT, NO_COAT)
    assert last.off == ("coat_weight",)
    assert [list(x) for x in last.richer] == ([list(found.x)] if asked else [])
