# SPDX-License-Identifier: Apache-2.0
"""Least squares on Monte Carlo rows. Oracle: the same problem without noise."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.solve.noisy_least_squares import CrossProducts, SafeMatrix, cautious_step, cross_equations

TRUE = np.array([0.3, -0.2, 0.5])
WIDTH = np.ones(3)


def samples(rng, jacobian, count, noise, reference_noise=None):
    """Rows of residual and derivatives at 0 of the linear model J (x - TRUE), each with its own noise."""
    exact = np.column_stack([-jacobian @ TRUE, jacobian])
    if reference_noise is not None:
        exact[:, 0] += reference_noise
    return [exact + noise * rng.normal(size=exact.shape) for _ in range(count)]


def pooled(parts):
    pool = CrossProducts(*parts[0].shape)
    for part in parts:
        pool.add(part)
    return pool


@pytest.fixture
def problem():
    rng = np.random.default_rng(0)
    return rng, rng.normal(size=(3000, 3))


def test_products_of_different_samples_have_no_bias(problem):
    rng, jacobian = problem
    parts = samples(rng, jacobian, 6, 3.0)
    exact = samples(rng, jacobian, 1, 0.0)[0]
    gram = pooled(parts).gram()
    # each entry is a mean over 3000 rows and 15 pairs of products with a spread of about 9
    np.testing.assert_allclose(gram, exact.T @ exact / 3000, atol=0.3)
    plain = np.mean([part.T @ part for part in parts], axis=0) / 3000
    assert np.diag(plain).min() > 8.0  # what the own noise would add


def test_a_faded_sample_counts_less(problem):
    rng, jacobian = problem
    old, new = samples(rng, jacobian, 2, 0.0), samples(rng, 2.0 * jacobian, 2, 0.0)
    pool = pooled(old)
    pool.fade(1e-6)
    for part in new:
        pool.add(part)
    np.testing.assert_allclose(pool.gram(), new[0].T @ new[0] / 3000, rtol=1e-4)
    np.testing.assert_allclose(pool.mean, new[0], rtol=1e-4)


def test_a_weight_stands_for_as_many_samples(problem):
    rng, jacobian = problem
    parts = samples(rng, jacobian, 3, 0.0)
    pool = pooled(parts[:1])
    pool.add(2.0 * parts[1], 3.0)
    np.testing.assert_allclose(pool.mean, 1.75 * parts[0])
    exact = parts[0].T @ parts[0] / len(jacobian)
    np.testing.assert_allclose(pool.gram(), 2.0 * exact, rtol=1e-12)  # the only pair of different samples


def test_moving_the_samples_is_taking_them_elsewhere(problem):
    rng, jacobian = problem
    parts = samples(rng, jacobian, 3, 0.0)
    pool = pooled(parts)
    pool.shifted(TRUE)
    equations = cross_equations(pool.gram())
    assert equations.cost == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(equations.gradient, 0.0, atol=1e-9)


def test_one_step_solves_a_noisy_linear_problem(problem):
    rng, jacobian = problem
    equations = cross_equations(pooled(samples(rng, jacobian, 8, 2.0)).gram())
    step = cautious_step(equations, -WIDTH, WIDTH, WIDTH, 0.0)
    np.testing.assert_allclose(step, TRUE, atol=0.12)  # four times the spread over seeds
    bounded = cautious_step(equations, np.full(3, -0.1), np.full(3, 0.1), WIDTH, 0.0)
    assert np.abs(bounded).max() <= 0.1 + 1e-12


def test_what_noise_explains_moves_nothing():
    equations = cross_equations(np.array([[1.0, 0.01], [0.01, 1.0]]))
    one = np.ones(1)
    assert cautious_step(equations, -one, one, one, 0.0, noise=np.array([[0.02**2]]))[0] == 0.0
    assert cautious_step(equations, -one, one, one, 0.0, noise=np.array([[0.001**2]]))[0] == pytest.approx(-0.0099)


def test_an_indefinite_matrix_gives_a_bounded_step_downhill():
    gram = np.array([[1.0, 0.2, 0.1], [0.2, 1.0, 0.3], [0.1, 0.3, -0.5]])
    step = cautious_step(cross_equations(gram), -np.ones(2), np.ones(2), np.ones(2), 0.0)
    assert np.isfinite(step).all()
    assert step @ gram[0, 1:] < 0.0


def test_a_column_of_noise_moves_nothing_and_spoils_no_other():
    # its product with itself is negative, so those with others are noise: without bound where the scale is small
    gram = np.array([[1.0, 0.2, 0.3], [0.2, 1.0, 0.4], [0.3, 0.4, -0.01]])
    equations = cross_equations(gram)
    one = np.ones(2)
    step = cautious_step(equations, -one, one, one, 0.0)
    np.testing.assert_allclose(step, [-0.2, 0.0])
    covariance = SafeMatrix(equations, one).covariance(np.diag([1e-4, 1.0]))
    np.testing.assert_allclose(covariance, np.diag([1e-4, 1.0]))


def test_the_covariance_covers_the_scatter_of_solutions(problem):
    rng, jacobian = problem
    found, stated = [], []
    for _ in range(60):
        pool = pooled(samples(rng, jacobian, 4, 0.5, 2.0 * rng.normal(size=3000)))
        equations = cross_equations(pool.gram())
        step = cautious_step(equations, -WIDTH, WIDTH, WIDTH, 0.0)
        pool.shifted(step)
        found.append(step)
        stated.append(np.diag(SafeMatrix(equations, WIDTH).covariance(pool.gradient_noise(3))))
    ratio = np.mean(stated, axis=0) / np.var(found, axis=0)
    assert np.all((ratio > 0.5) & (ratio < 2.0))  # the variance of 60 solutions is known to a fifth


def few_groups(rng, count=20, heavy=1.0):
    """Rows of few groups, some with far larger derivatives than the others, and residuals that a group shares."""
    size = np.exp(heavy * rng.normal(size=count)).repeat(3)[:, None]
    jacobian = size * rng.normal(size=(3 * count, 3))
    return jacobian, rng.normal(size=count).repeat(3) + 0.3 * rng.normal(size=3 * count)


def test_the_covariance_is_that_of_solutions_without_one_group_each():
    jacobian, noise = few_groups(np.random.default_rng(2), count=20, heavy=0.5)
    (solved, *_) = np.linalg.lstsq(jacobian, noise, rcond=None)
    exact = np.column_stack([noise - jacobian @ solved, -jacobian])  # at the solution
    pool = pooled([exact, exact])
    matrix = SafeMatrix(cross_equations(pool.gram()), WIDTH)
    covariance = matrix.covariance(pool.jackknife_noise(3, matrix))
    left = np.array(
        [np.linalg.lstsq(*(np.delete(a, np.s_[3 * g : 3 * g + 3], 0) for a in (jacobian, noise)), rcond=None)[0]
         for g in range(20)]
    )  # fmt: skip
    np.testing.assert_allclose(covariance, 20 * np.cov(left.T), rtol=1e-9)  # the jackknife (J. Tukey 1958), 20 for 19


def test_few_groups_that_rule_the_solution_do_not_make_it_look_sure():
    rng = np.random.default_rng(3)
    inside = []
    for _ in range(200):
        jacobian, noise = few_groups(rng)
        (solved, *_) = np.linalg.lstsq(jacobian, noise, rcond=None)  # the truth is 0
        exact = np.column_stack([noise - jacobian @ solved, -jacobian])
        pool = pooled([exact, exact])
        matrix = SafeMatrix(cross_equations(pool.gram()), 100.0 * WIDTH)
        spread = matrix.covariance(pool.jackknife_noise(3, matrix))
        inside.append(np.abs(solved) < 1.96 * np.sqrt(np.diag(spread)))
    assert 0.91 < np.mean(inside) < 0.99  # 600 values, 95 % is asked for; without the leverage 85 %


def test_a_column_without_effect_has_no_leverage():
    rng = np.random.default_rng(4)
    jacobian = rng.normal(size=(3000, 2))
    residual = rng.normal(size=3000)
    parts = []
    for _ in range(2):
        noise = 1e-3 * rng.normal(size=3000)  # all there is of the second column
        parts.append(np.column_stack([residual, jacobian[:, 0], noise]))
    parts[1][:, 2] -= 2.0 * (parts[0][:, 2] @ parts[1][:, 2]) / (parts[0][:, 2] @ parts[0][:, 2]) * parts[0][:, 2]
    with_it, alone = (
        pool.jackknife_noise(3, SafeMatrix(cross_equations(pool.gram()), WIDTH[: pool.total.shape[1] - 1]))[0, 0]
        for pool in (pooled(parts), pooled([part[:, :2] for part in parts]))
    )
    np.testing.assert_allclose(with_it, alone, rtol=1e-6)


def test_a_column_without_effect_is_as_unsure_as_its_range():
    gram = np.array([[1.0, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 0.0]])
    matrix = SafeMatrix(cross_equations(gram), np.array([1.0, 2.0]))
    covariance = matrix.covariance(np.diag([1e-4, 0.0]))
    np.testing.assert_allclose(np.diag(covariance), [1e-4, 4.0])
    np.testing.assert_allclose(matrix.solution_covariance(np.diag([1e-4, 0.0]))[0, 0], 1e-4)


def test_the_expected_error_is_that_of_the_solutions(problem):
    rng, jacobian = problem
    errors, stated = [], []
    for _ in range(60):
        pool = pooled(samples(rng, jacobian, 4, 0.5, 2.0 * rng.normal(size=3000)))
        equations = cross_equations(pool.gram())
        off = cautious_step(equations, -WIDTH, WIDTH, WIDTH, 0.0) - TRUE
        errors.append(np.mean((jacobian @ off) ** 2))
        stated.append(SafeMatrix(equations, WIDTH).expected_error(pool.gradient_noise(3)))
    assert 0.5 < np.mean(stated) / np.mean(errors) < 2.0  # as the variances above


@pytest.mark.parametrize(("noise", "reference_noise"), [(2.0, 0.5), (0.5, 2.0), (1.0, 1.0)])
def test_own_share_is_what_a_new_draw_of_the_samples_changes(noise, reference_noise):
    rng = np.random.default_rng(4)
    jacobian, count = rng.normal(size=(400, 3)), 3
    own, both, stated = [], [], []
    kept = reference_noise * rng.normal(size=400)
    for _ in range(400):
        drawn = reference_noise * rng.normal(size=400)
        for found, there in ((own, kept), (both, drawn)):
            parts = samples(rng, jacobian, count, noise, there + jacobian @ TRUE)  # at the solution
            found.append(cross_equations(pooled(parts).gram()).gradient)
        stated.append(pooled(parts).own_share())
    expected = np.var(own, axis=0) / np.var(both, axis=0)
    np.testing.assert_allclose(np.median(stated, axis=0), expected, atol=0.12)  # two variances of 400, each to 7 %
