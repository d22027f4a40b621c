# SPDX-License-Identifier: Apache-2.0
"""Tables of a bench for pages that name its figures, such as the README, so that nobody types them."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from ..rows.findings import against_the_loop, promises
from ..rows.row import Row
from ..rows.summary import SOLVED_FLIP, comparable_seconds, quantile, summaries
from .table import Table, number

OURS, PAPERS = "balanced", "mfo-hdr"
_BLOCK = re.compile(r"(<!-- (bench|bench loop|bench promises) -->\n).*?(<!-- end -->)", re.DOTALL)


def headline(rows: Sequence[Row]) -> Table:
    """Per scenario what the default preset and the paper's loop solve, how exactly and how long they take.

    The last column is the median, over the scenes that both have, of the loop's time over the preset's.
    """
    time_name, seconds_of = comparable_seconds(rows)
    found = {(summary.scenario, summary.method): summary for summary in summaries(rows)}
    lines = []
    for scenario in dict.fromkeys(scenario for scenario, _ in found):
        line = [f"`{scenario}`"]
        for method in (OURS, PAPERS):
            mine = [row for row in rows if (row.scenario, row.method) == (scenario, method)]
            if not mine:
                line += ["–"] * 4
                continue
            summary = found[scenario, method]
            times = [time for time in map(seconds_of, mine) if time is not None]
            line += [f"{summary.solved} of {summary.runs}", str(summary.at_noise)]
            line += [number(summary.flip[1]), number(quantile(times, 0.5))]
        ratios = _ratios([row for row in rows if row.scenario == scenario], seconds_of)
        lines.append([*line, number(quantile(ratios, 0.5))])
    unit = "CPU s" if time_name.startswith("processor") else "s"
    heads = [
        f"{who}{what}" for who in (f"`{OURS}`: ", "paper's loop: ") for what in ("solved", "at the noise", "FLIP", unit)
    ]
    return Table(["scenes", *heads, "times longer"], lines)


def has_block(page: str) -> bool:
    """Whether `fill` would find something to fill."""
    return bool(_BLOCK.search(page))


def fill(page: str, rows: Sequence[Row]) -> str:
    """The page with everything in its blocks made anew; unchanged without them.

    A block goes from ``<!-- bench -->`` to ``<!-- end -->`` and has the short table; from ``<!-- bench loop -->`` it
    has `against_the_loop`, from ``<!-- bench promises -->`` what `promises` says of the default preset.
    """
    return _BLOCK.sub(lambda found: f"{found[1]}{_text(found[2], rows)}{found[3]}", page)


def _text(name: str, rows: Sequence[Row]) -> str:
    if name == "bench":
        table: Table | None = headline(rows)
        below = (
            f"\nSolved: mean FLIP over the object of at most {SOLVED_FLIP:g}; at the noise: the result is at most "
            f"{SOLVED_FLIP:g} further from the reference than the truth is. FLIP and time are medians.\n"
        )
    else:
        table = against_the_loop(rows) if name == "bench loop" else promises([r for r in rows if r.method == OURS])
        below = ""
    return "".join(f"{line}\n" for line in table.markdown()) + below if table else ""


def _ratios(rows: Sequence[Row], seconds_of: Callable[[Row], float | None]) -> list[float]:
    times = {(row.method, row.scene): seconds_of(row) for row in rows}
    pairs = [(times.get((OURS, row.scene)), seconds_of(row)) for row in rows if row.method == PAPERS]
    return [theirs / ours for ours, theirs in pairs if ours and theirs]
