# SPDX-License-Identifier: Apache-2.0
"""Starts from nothing: ends that agree, nodes that differ."""

from __future__ import annotations

import numpy as np
import pytest

from mfo_backend.fit.search.global_start import (
    BRUSHED,
    FILM,
    METAL,
    OPPOSITE_WIDTH,
    ROUGHER_WIDTH,
    ScanNode,
    agreeing_ends,
    best_starts,
    different_nodes,
    random_start,
    scan,
    scan_lobe,
)
from mfo_backend.solve.bounded_least_squares import NormalEquations, Solution, solve_bounded
from mfo_backend.types.parameter import Parameter, ParameterTable

TABLE = ParameterTable(
    (
        Parameter("base_color", 3, 0.0, 1.0, (0.5, 0.5, 0.5)),
        Parameter("roughness", 1, 0.05, 1.0, 0.5),
        Parameter("metallic", 1, 0.0, 1.0, 0.5),
    )
)
SCANNED = ("roughness",)
ROUGHNESS, METALLIC = TABLE.slice_of("roughness"), TABLE.slice_of("metallic")


def squares(residuals):
    """Normal equations of a function to residuals (m,), derivatives by central differences."""

    def at(x):
        h = 1e-6
        jacobian = np.stack([(residuals(x + h * e) - residuals(x - h * e)) / (2 * h) for e in np.eye(len(x))], axis=1)
        r = residuals(x)
        return NormalEquations(0.5 * float(r @ r), jacobian.T @ r, jacobian.T @ jacobian)

    return at


def one_basin(x):
    return x - np.array([0.2, 0.4, 0.6, 0.3, 0.7])


def one_noisy_basin(x):
    return np.concatenate([one_basin(x), [0.1]])  # what no value explains


def two_basins(x):
    """A low end for metals and a higher one for dielectrics."""
    m = x[METALLIC][0]
    return np.concatenate([x[:4] - 0.5, [m * (1.0 - m) * 4.0, 0.3 + 0.1 * (1.0 - m)]])


def solver(residuals, seen):
    def solve(start):
        seen.append(start)
        return solve_bounded(squares(residuals), start, TABLE.lower, TABLE.upper)

    return solve


@pytest.mark.parametrize("metal_width", [OPPOSITE_WIDTH, ROUGHER_WIDTH])
def test_opposite_starts_that_end_in_one_place_agree(metal_width):
    starts = []
    ends = agreeing_ends(solver(one_basin, starts), TABLE, SCANNED, 1.02, metal_width=metal_width)
    assert [start[METALLIC][0] for start in starts] == pytest.approx([1 - METAL, METAL])
    assert [start[ROUGHNESS][0] for start in starts] == [OPPOSITE_WIDTH, metal_width]
    assert len(ends) == 0  # noise-free: both costs are near 0, and their ratio says nothing
    ends = agreeing_ends(solver(one_noisy_basin, []), TABLE, SCANNED, 1.02)
    assert len(ends) == 2
    for end in ends:  # the solver stops where steps promise a 1e-8 of the cost
        np.testing.assert_allclose(end, [0.2, 0.4, 0.6, 0.3, 0.7], atol=1e-4)


def test_ends_in_different_basins_do_not_agree():
    assert agreeing_ends(solver(two_basins, []), TABLE, SCANNED, 1.02) == []
    # the factor decides: costs of 0.3^2 and 0.4^2
    ends = agreeing_ends(solver(two_basins, []), TABLE, SCANNED, 1.02 * (0.4 / 0.3) ** 2)
    assert [round(float(end[METALLIC][0])) for end in ends] == [1, 0]


def test_the_better_end_comes_first():
    ends = agreeing_ends(ends_at(2.0, 1.99), TABLE, SCANNED, 1.02)
    assert [end[METALLIC][0] for end in ends] == pytest.approx([METAL, 1 - METAL])


def ends_at(*costs):
    """Solves that stay where they begin, at these costs."""
    left, nothing = iter(costs), np.zeros(TABLE.length)
    return lambda start: Solution(start, NormalEquations(next(left), nothing, np.diag(nothing)), (1.0,), True)


@pytest.mark.parametrize("most", [np.inf, 2.0])
@pytest.mark.parametrize("costs", [(np.inf, np.inf), (1.0, np.inf), (np.nan, 1.0), (1.0, np.nan)])
def test_ends_without_finite_numbers_do_not_agree(costs, most):
    assert agreeing_ends(ends_at(*costs), TABLE, SCANNED, 1.02, most=most) == []


def test_ends_that_explain_too_little_do_not_agree():
    assert agreeing_ends(ends_at(1.0, 1.0), TABLE, SCANNED, 1.02, most=0.9) == []
    assert len(agreeing_ends(ends_at(1.0, 1.0), TABLE, SCANNED, 1.02, most=1.1)) == 2


def test_without_metallic_nothing_is_opposite():
    table = ParameterTable(TABLE[:2])

    def solve(start):
        raise AssertionError("no start to solve from")

    assert agreeing_ends(solve, table, SCANNED, 1.02) == []


def test_starts_stay_inside_narrow_limits():
    table = ParameterTable((Parameter("roughness", 1, 0.5, 0.9, 0.5), Parameter("metallic", 1, 0.2, 0.4, 0.5)))
    starts = []

    def solve(start):
        starts.append(start)
        return Solution(start, NormalEquations(1.0, np.zeros(2), np.eye(2)), (1.0,), True)

    assert len(agreeing_ends(solve, table, SCANNED, 1.02)) == 2
    np.testing.assert_allclose(starts, [[0.5, 0.2], [0.5, 0.4]])  # roughness, metallic


def test_starts_are_in_the_middle_of_the_box_but_for_what_they_hold():
    table = ParameterTable((*TABLE, Parameter("ior", 1, 1.0, 2.0, 1.2)))
    starts, scanned = [], []

    def solve(start):
        starts.append(start)
        return Solution(start, NormalEquations(1.0, np.zeros(6), np.eye(6)), (1.0,), True)

    def flat(x):
        scanned.append(x)
        return NormalEquations(1.0, np.zeros(6), np.eye(6))

    agreeing_ends(solve, table, SCANNED, 1.02)
    scan(flat, table, SCANNED)
    assert len(scanned) >= 16  # eight widths of dielectrics and of metals
    for start in (*starts, *scanned):
        np.testing.assert_allclose(start[[0, 1, 2, 5]], [0.5, 0.5, 0.5, 1.5])


def test_the_scan_finds_the_lower_basin():
    nodes = scan(squares(two_basins), TABLE, SCANNED)
    assert [node.cost for node in nodes] == sorted(node.cost for node in nodes)
    assert nodes[0].x[METALLIC][0] > 0.9
    assert nodes[0].cost < 0.5 * 0.32**2  # 0.3 and a little left of its few steps


THICKNESS, INDEX = FILM
FILMED = ParameterTable((*TABLE, Parameter(THICKNESS, 1, 0.0, 1000.0, 300.0), Parameter(INDEX, 1, 1.0, 2.4, 1.33)))


def interference(x):
    """Three colours whose fringes depend on the film's optical thickness, and its index alone a little."""
    d, n = x[FILMED.slice_of(THICKNESS)][0], x[FILMED.slice_of(INDEX)][0]
    return np.array([np.cos(4.0 * np.pi * d * n / wavelength) for wavelength in (610.0, 540.0, 450.0)] + [0.3 * n])


@pytest.mark.parametrize(("thickness", "index"), [(420.0, 1.5), (150.0, 1.9), (800.0, 1.4)])
def test_a_film_is_found_among_the_orders_of_its_colours(thickness, index):
    truth = np.concatenate([np.full(5, 0.5), [thickness, index]])

    def apart(x):
        return np.concatenate([interference(x) - interference(truth), x[:5] - truth[:5]])

    nodes = scan_lobe(squares(apart), FILMED, FILM, [FILMED.begin])
    assert [node.cost for node in nodes] == sorted(node.cost for node in nodes)
    ends = [solve_bounded(squares(apart), node.x, FILMED.lower, FILMED.upper) for node in different_nodes(nodes, 4)]
    best = min(ends, key=lambda end: end.equations.cost)
    np.testing.assert_allclose(best.x[5:], [thickness, index], rtol=1e-3)
    # from the middle of the box alone it is another order
    one = solve_bounded(squares(apart), FILMED.begin, FILMED.lower, FILMED.upper)
    assert one.equations.cost > 10.0 * best.equations.cost + 1e-6


STRETCHED = ParameterTable(
    (
        *TABLE,
        Parameter("anisotropic", 1, 0.0, 1.0, 0.0),
        Parameter("anisotropic_rotation", 1, 0.0, 1.0, 0.0, period=0.5),
    )
)


@pytest.mark.parametrize("turn", [0.05, 0.2, 0.3, 0.45])
def test_the_direction_of_a_brushed_surface_is_found(turn):
    """Of a stretch along a line what shows are its size times the sine and cosine of twice the angle."""

    def shown(x):
        amount, angle = x[5], 4.0 * np.pi * x[6]
        return np.array([amount * np.cos(angle), amount * np.sin(angle), 0.1 * amount])

    truth = np.concatenate([np.full(5, 0.5), [0.8, turn]])
    apart = squares(lambda x: np.concatenate([shown(x) - shown(truth), x[:5] - truth[:5]]))
    best, *others = different_nodes(scan_lobe(apart, STRETCHED, BRUSHED, [STRETCHED.begin]), 4)
    assert len(others) == 3
    end = solve_bounded(apart, best.x, STRETCHED.lower, STRETCHED.upper)
    np.testing.assert_allclose(end.x[5:], [0.8, turn], atol=1e-3)


def test_beside_each_begin_all_nodes_of_a_film_are_tried():
    flat = [FILMED.begin, FILMED.lower]
    nodes = scan_lobe(lambda x: NormalEquations(1.0, np.zeros(7), np.eye(7)), FILMED, FILM, flat)
    assert len(nodes) == 2 * len({node.held for node in nodes})
    assert {tuple(node.x[:5]) for node in nodes} == {tuple(begin[:5]) for begin in flat}
    assert {tuple(node.x[5:]) for node in nodes} == {node.held for node in nodes}


def test_scans_end_when_they_are_asked_to_stop():
    seen = []

    def flat(x):
        seen.append(x)
        return NormalEquations(1.0, np.zeros(len(x)), np.eye(len(x)))

    def after_three():
        return len(seen) >= 3

    assert len(scan(flat, TABLE, SCANNED, after_three)) <= 3
    seen.clear()
    assert len(scan_lobe(flat, FILMED, FILM, [FILMED.begin, FILMED.lower], after_three)) <= 3
    assert len(seen) <= 6  # a node has four evaluations at most


def test_without_a_film_nothing_of_one_is_tried():
    def never(x):
        raise AssertionError("no film to solve for")

    assert scan_lobe(never, TABLE, FILM, [TABLE.begin]) == []
    index_alone = ParameterTable((*TABLE, Parameter(INDEX, 1, 1.0, 2.4, 1.33)))
    assert scan_lobe(never, index_alone, FILM, [index_alone.begin]) == []


def test_best_starts_are_different_nodes_and_two_metals():
    held = [(0.1,), (0.11,), (0.2,), (0.4,), (0.5,), (0.6,)]
    metal = [False, False, False, False, True, True]
    nodes = [ScanNode(h, m, np.full(1, i), float(i)) for i, (h, m) in enumerate(zip(held, metal, strict=True))]
    assert [node.cost for node in different_nodes(nodes, 2)] == [0.0, 2.0]
    assert [float(x[0]) for x in best_starts(nodes, 2)] == [0, 2, 4, 5]
    # metals among the different nodes are not named twice
    assert [float(x[0]) for x in best_starts(nodes, 4)] == [0, 2, 3, 4, 5]


def test_a_random_start_is_away_from_the_walls_and_the_seeds_own():
    starts = [random_start(TABLE, seed) for seed in (1, 1, 2)]
    np.testing.assert_array_equal(starts[0], starts[1])
    assert np.abs(starts[0] - starts[2]).max() > 0.1
    shares = (np.array(starts) - TABLE.lower) / (TABLE.upper - TABLE.lower)
    assert shares.min() >= 0.1
    assert shares.max() <= 0.9
