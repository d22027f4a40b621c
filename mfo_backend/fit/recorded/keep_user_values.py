# SPDX-License-Identifier: Apache-2.0
"""Which values go back to the user's: lobes that only noise asked for, and values the picture does not determine."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ...render.paths.recorded_image import RecordedImage
from ...solve.bounded_least_squares import step_in_box
from ...types.certainty import Certainty, Level
from ...types.image import Pixels
from ...types.parameter import ParameterTable
from ..alike.compare import rival_notes
from ..alike.hidden_coat import largest_covariance
from ..alike.unneeded_lobes import box_holding, dispensable, moved_to_user, unneeded_lobes, with_user_details
from ..certainty.covariance import certainties, covariance, standard_deviations, with_rivals
from ..result.outcome import kept_note
from ..squares.problem import Problem, Refined
from ..squares.recording_noise import rows_of_samples
from ..squares.residuals import RelativeResidual, Residual
from ..tolerances import AS_GOOD, MODEL_ERROR, NOT_AS_GOOD, SIGNIFICANT, UNSEEN_CHANGE, VISIBLE
from .recording import Recording, Setting, Vector
from .refine import OnRecording
from .solve import solve_within


@dataclass(frozen=True)
class Kept:
    """A vector, how sure each value is, their covariance in widths of the box, and sentences for the report.

    `held` names the values that are the user's again; later stages leave them alone.
    """

    x: Vector
    held: tuple[str, ...]
    certainty: dict[str, Certainty]
    spread: NDArray[np.float64]
    notes: tuple[str, ...]


def keep_values(end: OnRecording, seen: Callable[[Pixels], float] | None = None) -> Kept:
    """The refined vector with unneeded lobes switched off again and undetermined values given back.

    Where light is sampled residuals are in standard deviations of the noise. Others have a floor, below which a change
    may be seen all the same: `seen`, the mean error of a picture to the eye, must not grow either.
    """
    setting, refined = end.recording.setting, end.refined
    table, user = setting.table, setting.user
    found, problem = with_user_details(refined.x, user, table), refined.all
    judged, unseen_change = Judged(setting, refined), _UnseenChange(end.recording, refined, seen)
    cost, off = judged.cost(found), list(refined.off)
    if not off:
        equations, least = problem.equations(found), judged.model_error
        off = unneeded_lobes(equations, problem.independent, found, user, table, least)
    moved = moved_to_user(off, found, user, table)
    if moved:
        allowed = cost + SIGNIFICANT * len(moved) * max(cost, judged.model_error**2) / problem.independent
        simpler = _solve_holding(setting, refined, found, off)
        simpler = None if simpler is None else with_user_details(simpler, user, table)
        if simpler is not None and (again := judged.cost(simpler)) <= allowed + 1e-12 and unseen_change(simpler):
            found, cost = simpler, again
        else:
            off = [name for name in off if name not in moved]

    certainty, spread = judged(found)
    notes: list[str] = []
    unseen = [name for name, c in certainty.items() if c.level is Level.NOT_VISIBLE]
    if unseen and len(unseen) < len(table):
        for back in _sets_to_return(unseen, off, problem, found, user, table):
            held = [*back, *(name for name in off if name not in back)]
            kept = _solve_holding(setting, refined, found, held)
            if kept is not None and judged.cost(kept) <= AS_GOOD * cost + 1e-8 and unseen_change(kept):
                found, off = kept, held
                notes.append(kept_note(back, table))
                break
    notes += rival_notes(refined.rivals, found, table, unseen)
    return Kept(found, tuple(off), certainty, spread, tuple(notes))


def _sets_to_return(
    unseen: list[str], off: list[str], problem: Problem, found: Vector, user: Vector, table: ParameterTable
) -> Iterator[list[str]]:
    """All values the picture does not determine, then those of them that go back without any sign of it.

    One of them alone may be free where all together are not: they trade against each other.
    """
    yield unseen
    equations = problem.equations(found)

    def change(names: list[str]) -> float:
        return step_in_box(equations, found, *box_holding(table, user, [*names, *off]))[1]

    limit = SIGNIFICANT * equations.cost / problem.independent
    others = [name for name in unseen if name not in off]
    some = dispensable(others, change, limit)
    if len(some) == len(others):  # these have just been tried
        some = some[: len(some) // 2]
    while some:
        yield some
        some = some[: len(some) // 2]  # the cheapest


class Judged:
    """Certainty and covariance at a vector, and what they are taken from."""

    def __init__(self, setting: Setting, refined: Refined) -> None:
        self._setting, self._problem, self._rivals = setting, refined.all, refined.rivals

    def __call__(self, x: Vector) -> tuple[dict[str, Certainty], NDArray[np.float64]]:
        """Both; of a coat that is not there as if it were where the picture would know least of it."""
        table = self._setting.table
        spread = largest_covariance(self._covariance, x, table)
        spread = with_rivals(spread, x, self._rivals, table.width)
        return certainties(standard_deviations(spread, table), table, spread), spread

    def cost(self, x: Vector) -> float:
        """The mean square residual."""
        return 2.0 * self._problem.equations(x).cost

    def _covariance(self, x: Vector) -> NDArray[np.float64]:
        coarser = None if self._problem.coarser is None else self._rows_of(self._problem.coarser, x)
        return covariance(*self.rows(x), self._setting.table, self.model_error, coarser=coarser)

    @property
    def model_error(self) -> float:
        """The least error of a residual; deviations of the noise hold it."""
        return 0.0 if self._setting.sampled else MODEL_ERROR

    def rows(self, x: Vector) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
        """Residuals and derivatives (g, 3, 1 + k) that certainty is taken from, and the recording's noise in them."""
        return self._rows_of(self._problem.evaluate, x)

    @property
    def residual(self) -> Residual:
        """What certainty is taken from: deviations of the noise, or relative differences."""
        if self._setting.sampled:
            return self._problem.residual
        return RelativeResidual(self._problem.groups.average(self._setting.reference))

    def _rows_of(self, evaluate: RecordedImage, x: Vector) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
        return rows_of_samples(evaluate.samples(x), self.residual)


class _UnseenChange:
    """Whether the recorded picture of a vector is no worse to the eye than that of the solution."""

    def __init__(self, recording: Recording, refined: Refined, seen: Callable[[Pixels], float] | None) -> None:
        self._recording, self._found, self._evaluate, self._seen = recording, refined.x, refined.all.evaluate, seen

    def __call__(self, x: Vector) -> bool:
        if self._seen is None:
            return True
        # of the problem's pixels, evenly spread and the brightest: those that see nothing of the target do not change
        before, after = (self._evaluate(vector)[:, :, 0] for vector in (self._found, x))
        if relative_change(before, after) * self._recording.setting.mask.mean() <= UNSEEN_CHANGE:
            return True
        return self._seen(self._recording.whole.picture(x)) <= self._error + VISIBLE

    @cached_property
    def _error(self) -> float:
        assert self._seen is not None
        return self._seen(self._recording.whole.picture(self._found))


def relative_change(before: NDArray[np.floating], after: NDArray[np.floating]) -> float:
    """Mean change of linear values, relative to each of them and to a hundredth of their median."""
    dim = max(0.01 * float(np.median(before)), 1e-30)
    return float(np.mean(np.abs(after - before) / (np.abs(before) + dim)))


def _solve_holding(setting: Setting, refined: Refined, found: Vector, names: list[str]) -> Vector | None:
    """The best vector with these names at the user's values; None where it is hopeless by some of the groups alone.

    The quadratic around `found` mostly tells where it is: what goes back hardly shows.
    """
    lower, upper = box_holding(setting.table, setting.user, names)
    start = np.clip(found, lower, upper)
    if np.all(lower >= upper):
        return start
    if refined.few is not refined.all:
        around = refined.all.equations(found)
        step, rise = step_in_box(around, found, lower, upper)
        if rise > around.cost:
            return None
        guess, cost = found + step, refined.few.equations
        before = cost(found).cost
        if cost(guess).cost <= AS_GOOD * before:
            start = guess
        else:
            nearer, hopeless = min(start, guess, key=lambda x: cost(x).cost), NOT_AS_GOOD * before
            start = solve_within(setting, refined.few, nearer, (lower, upper), wanted=hopeless)
            if cost(start).cost > hopeless:
                return None
    return solve_within(setting, refined.all, start, (lower, upper))
