# SPDX-License-Identifier: Apache-2.0
"""Rows summed up per scenario and method. A run that raised stays in every share and counts as an infinite error."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from ..scenes.scenario import SCENARIOS
from .method import METHODS
from .row import Row

SOLVED_FLIP = 0.02  # mean FLIP over the object; set before the runs of docs/bench
TARGETS = (0.1, 0.05, SOLVED_FLIP)


@dataclass(frozen=True)
class Summary:
    """One method in one scenario.

    `solved` and `close` count runs with a mean FLIP of at most 0.02 and 0.05,
    `at_noise` those whose picture differs from the reference by no more than 0.02 above what the true one does.
    `seconds` are of runs that did not raise: median and 90th percentile; so is the median `processor_seconds`.
    `seconds_per_solved` is the `comparable_seconds` of all runs over the number solved.
    `flip` holds the quartiles of all runs, `relit_flip` the median under all lights no fit saw, `jod` mean and minimum.
    """

    scenario: str
    method: str
    runs: int
    raised: int
    solved: int
    close: int
    at_noise: int
    seconds: tuple[float, float]
    processor_seconds: float
    seconds_per_solved: float
    passes: float
    flip: tuple[float, float, float]
    relative_rmse: float
    relit_relative_rmse: float
    relit_flip: float
    jod: tuple[float, float]


@dataclass(frozen=True)
class Comparable:
    """The rows of scenes that every method of their scenario has, in the order of the tables, and the others' count."""

    rows: tuple[Row, ...]
    left_out: int


def comparable(rows: Iterable[Row]) -> Comparable:
    """Leave out scenes that a stopped bench did not finish: methods are compared on the same ones."""
    rows = list(rows)
    methods: dict[str, set[str]] = {}
    present: dict[tuple[str, int], set[str]] = {}
    for row in rows:
        methods.setdefault(row.scenario, set()).add(row.method)
        present.setdefault((row.scenario, row.scene), set()).add(row.method)
    kept = [row for row in rows if present[row.scenario, row.scene] == methods[row.scenario]]
    kept.sort(key=lambda row: (_place(row.scenario, tuple(SCENARIOS)), row.scene, _place(row.method, tuple(METHODS))))
    return Comparable(tuple(kept), len(rows) - len(kept))


def summaries(rows: Iterable[Row]) -> list[Summary]:
    """One summary per scenario and method, in the order of the tables."""
    rows = list(rows)
    _, seconds_of = comparable_seconds(rows)
    return [_summary(scenario, method, mine, seconds_of) for (scenario, method), mine in grouped(rows).items()]


def grouped(rows: Iterable[Row]) -> dict[tuple[str, str], list[Row]]:
    """The rows of each scenario and method, in the order of the tables."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row.scenario, row.method), []).append(row)
    order = sorted(groups, key=lambda g: (_place(g[0], tuple(SCENARIOS)), _place(g[1], tuple(METHODS))))
    return {group: groups[group] for group in order}


def comparable_seconds(rows: Iterable[Row]) -> tuple[str, Callable[[Row], float | None]]:
    """The name and the getter of the seconds that rows are compared by.

    Processor seconds, which other programs hardly change; those of the clock where a row of an older bench lacks them.
    """
    if all(row.processor_seconds is not None for row in rows if row.seconds is not None):
        return "processor seconds", lambda row: row.processor_seconds
    return "seconds", lambda row: row.seconds


def quantile(values: Sequence[float], share: float) -> float:
    """The quantile with linear interpolation (type 7); infinite where it touches an infinite value, NaN of nothing."""
    if not values:
        return math.nan
    ordered = sorted(values)
    below, part = divmod(share * (len(ordered) - 1), 1.0)
    low = ordered[int(below)]
    if part == 0.0:
        return low
    high = ordered[int(below) + 1]
    return high if math.isinf(high) else low + part * (high - low)


def error_of(value: float | None) -> float:
    """An error measure; infinite where there is none."""
    return math.inf if value is None or math.isnan(value) else value


def is_at_noise(row: Row) -> bool:
    """Whether the result is at most 0.02 further from the reference, in FLIP, than the true picture is."""
    if row.reference_flip is None or row.floor_flip is None:
        return False
    return error_of(row.reference_flip) - row.floor_flip <= SOLVED_FLIP


def _summary(scenario: str, method: str, rows: Sequence[Row], seconds_of: Callable[[Row], float | None]) -> Summary:
    seconds = [row.seconds for row in rows if row.seconds is not None]
    flips = [error_of(row.flip) for row in rows]
    jods = [row.jod for row in rows if row.jod is not None]
    solved = sum(flip <= SOLVED_FLIP for flip in flips)
    return Summary(
        scenario=scenario,
        method=method,
        runs=len(rows),
        raised=sum(bool(row.error) for row in rows),
        solved=solved,
        close=sum(flip <= 0.05 for flip in flips),
        at_noise=sum(map(is_at_noise, rows)),
        seconds=(quantile(seconds, 0.5), quantile(seconds, 0.9)),
        processor_seconds=quantile([r.processor_seconds for r in rows if r.processor_seconds is not None], 0.5),
        seconds_per_solved=sum(seconds_of(row) or 0.0 for row in rows) / solved if solved else math.inf,
        passes=quantile([row.passes for row in rows if row.passes is not None], 0.5),
        flip=(quantile(flips, 0.25), quantile(flips, 0.5), quantile(flips, 0.75)),
        relative_rmse=quantile([error_of(row.relative_rmse) for row in rows], 0.5),
        relit_relative_rmse=quantile([error_of(row.relit_relative_rmse) for row in rows], 0.5),
        relit_flip=quantile([flip for row in rows for flip in (row.relit_flips or [math.inf])], 0.5),
        jod=(sum(jods) / len(jods), min(jods)) if jods else (math.nan, math.nan),
    )


def _place(name: str, order: Sequence[str]) -> int:
    return order.index(name) if name in order else len(order)
