# SPDX-License-Identifier: Apache-2.0
"""Which picture of a fit does not go with the others, by fits that leave one out.

After G. C. Chow's test of whether two sets of observations have the same coefficients ("Tests of Equality Between Sets
of Coefficients in Two Linear Regressions", 1960): what is left where a set need not agree with the others, against what
is left where all agree.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from ...solve.bounded_least_squares import NormalEquations, SolveLimits, solve_bounded
from ...types.parameter import Vector
from ...types.result import Contradiction
from ..plans import NEAR_EVALUATIONS
from ..result.outcome import listed
from ..squares.problem import Problem
from ..squares.residuals import gram_of, residual_rows
from ..tolerances import AGAINST_REST, AT_NOISE


def contradiction(
    solved: Problem,
    judged: Problem,
    numbers: NDArray[np.int64],
    labels: Sequence[str],
    x: Vector,
    box: tuple[Vector, Vector],
    should_stop: Callable[[], bool] = lambda: False,
) -> Contradiction | None:
    """The picture that speaks against the others; None where all go together.

    Parameters
    ----------
    solved, judged
        The same groups of all pictures with residuals whose slopes reach far, by which a fit without a picture is
        solved, and with residuals in standard deviations of the noise, by which it is judged.
    numbers
        The picture of each group, counted from 0.
    x
        The solution of all pictures together.
    """

    def squares(at: Vector) -> Vector:
        """Mean square residual of each picture."""
        values = np.square(residual_rows(judged.evaluate(at), judged.residual)[:, :, 0]).mean(axis=1)
        return np.array([values[numbers == number].mean() for number in range(len(labels))])

    shown = np.unique(numbers)
    if len(shown) < len(labels):  # the others show nothing of the material
        labels, numbers = [labels[int(number)] for number in shown], np.searchsorted(shown, numbers)
    if len(labels) < 2:
        return None
    together = squares(x)
    if together.mean() < AT_NOISE**2:
        return None
    limits = SolveLimits(evaluations=NEAR_EVALUATIONS, cost_change=1e-3)
    ends, rest = [], np.empty(len(labels))
    for number in range(len(labels)):
        ends.append(solve_bounded(_without(solved, numbers == number), x, *box, limits, should_stop).x)
        rest[number] = max(np.delete(squares(ends[-1]), number).mean(), 1e-12)
    if should_stop() or together.mean() / rest.min() < AGAINST_REST:
        return None
    # all together may have ended in another basin than without one of them, which is no contradiction
    start = ends[int(rest.argmin())]
    again = squares(solve_bounded(_without(solved, numbers < 0), start, *box, limits, should_stop).x).mean()
    gains = min(together.mean(), again) / rest
    if should_stop() or again < AT_NOISE**2 or gains.max() < AGAINST_REST:
        return None
    named = tuple(label for label, gain in zip(labels, gains, strict=True) if gain > gains.max() / AGAINST_REST)
    return Contradiction(named, _sentence(named, len(labels)))


def _without(problem: Problem, left_out: NDArray[np.bool_]) -> Callable[[Vector], NormalEquations]:
    def at(x: Vector) -> NormalEquations:
        gram = gram_of(residual_rows(problem.evaluate(x), problem.residual)[~left_out])
        return NormalEquations(0.5 * float(gram[0, 0]), gram[1:, 0], gram[1:, 1:])

    return at


def _sentence(named: Sequence[str], count: int) -> str:
    cure = "Correct it, or leave it out."
    if len(named) == 1:
        return f"Picture {named[0]} does not go with the rest: its light or camera differs from its scene. {cure}"
    rest = "" if len(named) == count else " with the rest"
    all_of_them = listed(named)
    return (
        f"Pictures {all_of_them} do not go together{rest}: the light or camera of one of them differs from its scene. "
        f"{cure}"
    )
