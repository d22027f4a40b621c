# SPDX-License-Identifier: Apache-2.0
"""Oracle: the scatter of repeated linear fits with known noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mfo_backend.fit.certainty.covariance import (
    INFLATION,
    Further,
    certainties,
    certainties_away,
    covariance,
    standard_deviations,
)
from mfo_backend.types.certainty import Level
from mfo_backend.types.parameter import Parameter, ParameterTable

TABLE = ParameterTable([Parameter("colour", 3, 0.0, 1.0, (0.5,) * 3), Parameter("width", 1, 0.0, 2.0, 1.0)])


def with_residual(jacobian: np.ndarray, residual: np.ndarray) -> np.ndarray:
    return np.concatenate([residual[:, :, None], jacobian], axis=2)


@pytest.mark.parametrize("shared", [False, True], ids=["independent-channels", "shared-by-channels"])
def test_predicts_the_scatter_of_repeated_fits(shared):
    rng = np.random.default_rng(0)
    # the channels of a pixel move alike, so noise they share does not average out
    jacobian = (rng.normal(size=(400, 1, 4)) + 0.3 * rng.normal(size=(400, 3, 4))) * [1.0, 0.5, 2.0, 0.1]
    rows = jacobian.reshape(-1, 4)
    solve = np.linalg.pinv(rows)
    found, predicted = [], []
    for _ in range(200):
        noise = rng.normal(size=(400, 1 if shared else 3)) * 0.2 * np.ones((1, 3))
        x = solve @ noise.ravel()
        found.append(x)
        spread = covariance(with_residual(jacobian, noise - (rows @ x).reshape(400, 3)), None, TABLE)
        predicted.append(standard_deviations(spread, TABLE))
    # 200 repetitions give the empirical value to 5 %; 1.2 is added for noise in the Jacobian
    np.testing.assert_allclose(np.mean(predicted, axis=0) / INFLATION, np.std(found, axis=0), rtol=0.12)


def test_noise_in_the_derivatives_makes_no_value_look_sharper():
    # as in a recording whose own noise in the derivatives is as large as they are
    rng = np.random.default_rng(3)
    jacobian = rng.normal(size=(2000, 3, 4)) * [1.0, 0.5, 2.0, 0.1]
    found, stated, naive = [], [], []
    for _ in range(100):
        a, b = (jacobian + rng.normal(size=jacobian.shape) * [1.0, 0.5, 2.0, 0.1] for _ in range(2))
        noise = rng.normal(size=(2000, 3)) * 0.2
        mean, half = 0.5 * (a + b), 0.5 * (a - b)
        products = np.einsum("gck,gcl->kl", mean, mean) - np.einsum("gck,gcl->kl", half, half)
        x = np.linalg.solve(products, np.einsum("gck,gc->k", mean, noise))
        found.append(x)
        rows = with_residual(mean, noise - mean @ x)
        own = with_residual(half, -half @ x)
        stated.append(standard_deviations(covariance(rows, own, TABLE), TABLE))
        naive.append(standard_deviations(covariance(rows, None, TABLE), TABLE))
    scatter = np.std(found, axis=0)
    # 100 repetitions give the empirical value to 7 %
    np.testing.assert_allclose(np.mean(stated, axis=0), scatter, rtol=0.2)
    assert (np.mean(naive, axis=0) / INFLATION < 0.85 * scatter).all()


def test_a_column_without_effect_may_lie_anywhere_in_its_box():
    jacobian = np.random.default_rng(1).normal(size=(200, 3, 4))
    jacobian[:, :, 3] = 0.0
    sd = standard_deviations(covariance(with_residual(jacobian, np.full((200, 3), 0.01)), None, TABLE), TABLE)
    levels = certainties(sd, TABLE)
    anywhere = np.random.default_rng(0).uniform(0.0, 2.0, 100_000)  # as far as that may be from a value at a bound
    assert sd[3] == pytest.approx(np.sqrt(np.mean(anywhere**2)), rel=0.01)
    assert levels["width"].level is Level.NOT_VISIBLE
    assert levels["colour"].level is Level.DETERMINED


def test_what_trades_against_a_value_that_cannot_leave_its_box_is_surer():
    """Two columns whose effects nearly cancel: without the box both would be many boxes wide."""
    random = np.random.default_rng(4)
    jacobian = random.normal(size=(400, 3, 4))
    jacobian[:, :, 3] = 0.05 * jacobian[:, :, 2] + 1e-5 * random.normal(size=(400, 3))
    noise = random.normal(size=(400, 3))
    rows = with_residual(jacobian, 0.01 * noise)
    sd = standard_deviations(covariance(rows, None, TABLE), TABLE)
    # of the posterior of a uniform prior, by the weights of points that the picture cannot tell: colour = -0.05 width
    assert 0.3 * 2.0 < sd[3] <= 2.0 / np.sqrt(3.0)
    assert sd[2] == pytest.approx(0.05 * sd[3], rel=0.05)
    assert sd[0] < 0.001


def test_an_exact_fit_still_has_the_error_of_the_model():
    jacobian = np.random.default_rng(1).normal(size=(200, 3, 4)) * 1e-3
    sd = standard_deviations(covariance(with_residual(jacobian, np.zeros((200, 3))), None, TABLE), TABLE)
    assert (sd > 0.02).all()


def test_the_unit_of_the_residuals_does_not_matter():
    random = np.random.default_rng(7)
    jacobian = random.normal(size=(100, 3, 4)) * [1.0, 0.5, 2.0, 0.01]
    rows = with_residual(jacobian, random.uniform(0.5, 1.0, (100, 3)))
    found = covariance(rows, None, TABLE, 0.05)
    for unit in (1e-3, 1e3):
        np.testing.assert_allclose(covariance(unit * rows, None, TABLE, unit * 0.05), found, rtol=1e-9, atol=1e-15)


def test_the_levels_have_the_stated_limits():
    levels = certainties(np.array([0.01, 0.019, 0.01, 0.299]), TABLE)
    assert (levels["colour"].level, levels["width"].level) == (Level.DETERMINED, Level.WEAK)
    levels = certainties(np.array([0.01, 0.021, 0.01, 0.301]), TABLE)
    assert (levels["colour"].level, levels["width"].level) == (Level.WEAK, Level.NOT_VISIBLE)


def test_scores_are_products_of_the_two_samples():
    """With samples a and b of the light a group's score is (J_a r_b + J_b r_a) / 2, which has no noise of its own."""
    rng = np.random.default_rng(5)
    jacobian, noise = rng.normal(size=(3000, 3, 4)), 0.5 * rng.normal(size=(2, 3000, 3, 4))
    residual = 0.2 * rng.normal(size=(3000, 3))
    a, b = (with_residual(jacobian + n, residual + n @ [0.5, -0.4, 0.3, 0.6]) for n in noise)
    width = TABLE.upper - TABLE.lower
    scores = 0.5 * (np.einsum("gck,gc->gk", a[:, :, 1:], b[:, :, 0]) + np.einsum("gck,gc->gk", b[:, :, 1:], a[:, :, 0]))
    gram = np.einsum("gck,gcl->kl", a[:, :, 1:], b[:, :, 1:])
    inverse = np.linalg.inv(0.5 * (gram + gram.T))
    expected = inverse @ (scores.T @ scores) @ inverse / np.outer(width, width)
    found = covariance(0.5 * (a + b), 0.5 * (a - b), TABLE)
    # few of 3000 groups rule nothing, so what leverage adds is below a hundredth
    np.testing.assert_allclose(np.sqrt(np.diag(found)), np.sqrt(np.diag(expected)), rtol=0.02)


def test_an_end_of_another_stage_is_as_unsure_as_it_is_far():
    table = ParameterTable([Parameter("roughness", 1, 0.0, 1.0, 0.5), Parameter("tint", 3, 0.0, 1.0, 1.0)])
    known = certainties(np.array([0.004, 0.003, 0.2, 0.003]), table)
    known["roughness"] = replace(known["roughness"], along=("tint",))
    assert certainties_away(known, np.zeros(4), table) == known
    away = certainties_away(known, np.array([-0.03, 0.0, 0.0, 0.0]), table)
    assert away["roughness"].sd == pytest.approx((np.hypot(0.004, 0.03),))
    assert (known["roughness"].level, away["roughness"].level) == (Level.DETERMINED, Level.WEAK)
    assert away["roughness"].along == ("tint",)
    assert away["tint"] == known["tint"]
    assert certainties_away({}, np.ones(4), table) == {}


def test_further_groups_count_as_the_mean_over_residuals_like_the_present_ones():
    """Oracle: many draws, each a present group's three channels with a sign by chance."""
    random = np.random.default_rng(4)
    table = ParameterTable([Parameter("roughness", 1, 0.0, 1.0, 0.5), Parameter("coat_weight", 1, 0.0, 1.0, 0.5)])
    rows = random.normal(size=(60, 3, 3)) * [0.05, 1.0, 0.3]
    rows[:, :, 0] += 0.1 * random.normal(size=(60, 1))
    further = random.normal(size=(40, 3, 3)) * [0.0, 0.5, 2.0]
    further[3, :, 2] *= 20.0  # rules the second value
    told = Further(further[:, :, 1:])

    def drawn() -> np.ndarray:
        further[:, :, 0] = rows[random.integers(60, size=40), :, 0] * random.choice((-1.0, 1.0), (40, 1))
        return covariance(np.concatenate([rows, further]), None, table, 1e-6)

    expected = np.mean([drawn() for _ in range(3000)], axis=0)
    np.testing.assert_allclose(covariance(rows, None, table, 1e-6, told), expected, rtol=0.06, atol=2e-6)


PIXELS, POINTS, SUBPIXELS, RAYS = 1000, 64, 4, 8
GAIN = ParameterTable([Parameter("gain", 1, 0.0, 4.0, 1.0), Parameter("offset", 1, -1.0, 1.0, 0.0)])


def edges(rng: np.random.Generator) -> np.ndarray:
    at = np.arange(PIXELS * POINTS) / POINTS
    where = np.sort(rng.uniform(0.0, PIXELS, PIXELS))
    return rng.uniform(0.0, 1.0, PIXELS + 1)[np.searchsorted(where, at)]


def waves(rng: np.random.Generator) -> np.ndarray:
    at = 2.0 * np.pi * rng.uniform(0.15, 0.25) * np.arange(PIXELS * POINTS) / POINTS
    return 0.5 + 0.2 * np.sin(at + rng.uniform(0.0, 6.0)) + 0.2 * np.sin(1.37 * at)


@pytest.mark.parametrize(("pattern", "widest"), [(edges, 1.0), (waves, 4.0)])
def test_deviations_hold_the_error_of_a_pattern_that_is_sampled(pattern, widest):
    """Oracle: gain and offset of a pattern whose every point is known, found by one sample in each subpixel.

    A pixel's rays read the sample of the subpixel that they meet; the picture is the mean of all points. `widest` is
    how many times larger than the error deviations may be.
    """
    filter_ = np.minimum(np.arange(POINTS) + 1.0, POINTS - np.arange(POINTS))
    truth = np.array([1.3, 0.2])
    errors, without, stated = [], [], []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        fine = pattern(rng).reshape(PIXELS, POINTS)
        picture = truth[0] * np.average(fine, axis=1, weights=filter_) + truth[1]
        picture = picture[:, None] + rng.normal(size=(PIXELS, 3)) * 0.003
        rays = (POINTS * (np.arange(RAYS) + rng.uniform(0.0, 1.0, (PIXELS, RAYS))) / RAYS).astype(int)
        within = POINTS // SUBPIXELS
        place = rng.integers(0, within, (PIXELS, SUBPIXELS, 1))
        sampled = np.take_along_axis(fine.reshape(PIXELS, SUBPIXELS, within), place, axis=2)[:, :, 0]
        halved = sampled.reshape(PIXELS, SUBPIXELS // 2, 2).mean(axis=2).repeat(2, axis=1)

        def derivatives(of, rays=rays, within=within):
            read = np.take_along_axis(of, rays // within, axis=1)
            mean = (read * filter_[rays]).sum(axis=1) / filter_[rays].sum(axis=1)
            return np.stack([mean, np.ones(PIXELS)], axis=1)

        x = np.linalg.lstsq(derivatives(sampled), picture.mean(axis=1), rcond=None)[0]

        def rows(of, x=x, picture=picture, derivatives=derivatives):
            jacobian = derivatives(of)
            return with_residual(np.repeat(jacobian[:, None], 3, axis=1), (jacobian @ x)[:, None] - picture)

        errors.append(x - truth)
        without.append(standard_deviations(covariance(rows(sampled), None, GAIN), GAIN))
        coarser = (rows(halved), None)
        stated.append(standard_deviations(covariance(rows(sampled), None, GAIN, coarser=coarser), GAIN))

    def rms(values):
        return np.sqrt(np.mean(np.square(values), axis=0))

    assert (rms(np.array(errors) / without) > 2.5).all()
    assert (rms(np.array(errors) / stated) < 2.0).all()
    assert (rms(stated) < widest * rms(errors)).all()
