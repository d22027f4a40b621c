# SPDX-License-Identifier: Apache-2.0
"""The paper's tables 1 to 4 in its form, its figures beside ours."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..rows.method import METHODS
from ..rows.row import Row
from ..rows.summary import SOLVED_FLIP, error_of
from .paper_figures import PAPER_NAMES, PaperFigure, paper_figure
from .table import Table, minutes

SOLVED_JOD = 9.0  # the paper's limit, there for HDR-VDP-3
_MAIN = ("base", "noise", "parameters", "transparency")
_FOUR = "transparency_4spp"


def paper_tables(rows: Sequence[Row]) -> list[tuple[str, Table]]:
    """Title and table of those of the four for which there are rows."""
    ours = [m for m in METHODS if not METHODS[m].compares_with and any(row.method == m for row in rows)]
    methods = list(dict.fromkeys([*PAPER_NAMES, *ours]))
    here = [name for name in _MAIN if any(row.scenario == name for row in rows)]
    found = []
    if here:
        for title, theirs, mine in (
            ("Table 1: mean runtime, solved scenes; in brackets all runs", _their_time, _our_time),
            (
                "Table 2: Q_JOD, mean (min/max); * JOD of ColorVideoVDP, another metric",
                _their_jod,
                _our_jod,
            ),
            ("Table 3: share of scenes solved", _their_share, _our_share),
        ):
            found.append((title, _table(rows, methods, here, theirs, mine)))
    if any(row.scenario == _FOUR for row in rows):
        times = _table(rows, methods, [_FOUR], _their_time, _our_time)
        jods = _table(rows, methods, [_FOUR], _their_jod, _our_jod)
        shares = _table(rows, methods, [_FOUR], _their_share, _our_share)
        heads = ("method", "time, paper", "time, here", "JOD, paper", "JOD, here", "solved here")
        cells = [(a[0], *a[1:], *b[1:], c[2]) for a, b, c in zip(times.rows, jods.rows, shares.rows, strict=True)]
        found.append(("Table 4: Transparency at 4 samples per pixel", Table(heads, cells)))
    return found


def solved_by_jod(row: Row) -> bool | None:
    """Whether the judge's score reaches the paper's limit; None where there is no score."""
    score = row.q_jod if row.q_jod is not None else row.jod
    if row.error:
        return False
    return None if score is None else score >= SOLVED_JOD


def solved(row: Row) -> bool:
    """By the judge where there is one, else by FLIP."""
    by_jod = solved_by_jod(row)
    return error_of(row.flip) <= SOLVED_FLIP if by_jod is None else by_jod


def _table(
    rows: Sequence[Row],
    methods: Sequence[str],
    scenarios: Sequence[str],
    theirs: Callable[[PaperFigure], str],
    ours: Callable[[Sequence[Row]], str],
) -> Table:
    heads = ["method"]
    for scenario in scenarios:
        heads += [f"{scenario}, paper", "here"]
    lines = []
    for method in methods:
        line = [f"{PAPER_NAMES[method]} `{method}`" if method in PAPER_NAMES else f"`{method}`"]
        for scenario in scenarios:
            figure = paper_figure(scenario, method)
            mine = [row for row in rows if row.scenario == scenario and row.method == method]
            line += ["–" if figure is None else theirs(figure), ours(mine) if mine else "not run"]
        lines.append(line)
    return Table(heads, lines)


def _their_time(figure: PaperFigure) -> str:
    return minutes(figure.seconds)


def _our_time(rows: Sequence[Row]) -> str:
    every = [row.seconds for row in rows if row.seconds is not None]
    good = [row.seconds for row in rows if row.seconds is not None and solved(row)]
    if not every:
        return "raised"
    mean = sum(every) / len(every)
    return f"{minutes(sum(good) / len(good)) if good else '–'} ({minutes(mean)})"


def _their_jod(figure: PaperFigure) -> str:
    mean, least, most = figure.q_jod
    return f"{mean:.2f} ({least:.2f}/{most:.2f})"


def _our_jod(rows: Sequence[Row]) -> str:
    """Of the paper's judge where all rows have its score, else of ColorVideoVDP, marked: never of both together."""
    judged = [row for row in rows if row.q_jod is not None or row.jod is not None]
    if judged and all(row.q_jod is not None for row in judged):
        return _spread([row.q_jod for row in judged if row.q_jod is not None])
    scores = [row.jod for row in rows if row.jod is not None]
    return f"{_spread(scores)} *" if scores else "–"


def _spread(scores: Sequence[float]) -> str:
    return f"{sum(scores) / len(scores):.2f} ({min(scores):.2f}/{max(scores):.2f})"


def _their_share(figure: PaperFigure) -> str:
    return "–" if figure.solved is None else f"{figure.solved:.0%}"


def _our_share(rows: Sequence[Row]) -> str:
    by_flip = sum(error_of(row.flip) <= SOLVED_FLIP for row in rows)
    judged = [solved_by_jod(row) for row in rows]
    flip = f"FLIP {by_flip / len(rows):.0%}"
    count = f"of {len(rows)}"
    if any(verdict is None for verdict in judged):
        return f"{flip} {count}"
    return f"JOD {sum(map(bool, judged)) / len(rows):.0%}, {flip} {count}"
