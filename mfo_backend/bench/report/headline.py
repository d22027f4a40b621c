# SPDX-License-Identifier: Apache-2.0
"""Tables of a bench for pages that name its figures, such as the README, so that nobody types them."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

from ..rows.row import Row
from ..rows.summary import SOLVED_FLIP, comparable_seconds, error_of, grouped, is_at_noise, quantile
from .findings import against_the_loop, promises
from .table import Table, number

OURS, PAPERS = "balanced", "mfo-hdr"
# What a reader of the README asks about, and the scenarios that answer; together they are all of them
KINDS = {
    "a lamp, no noise": ("base", "parameters"),
    "a light probe, 4 samples a pixel": ("noise",),
    "a light probe, 64 samples a pixel": ("relighting", "objects"),
    "glass": ("transparency", "transparency_4spp"),
    "rendered by Cycles": ("cycles",),
    "measured materials": ("measured",),
}
_BLOCK = re.compile(r"(<!-- (bench|bench short|bench loop|bench promises) -->\n).*?(<!-- end -->)", re.DOTALL)


def headline(rows: Sequence[Row]) -> Table:
    """Per scenario what the default preset and the paper's loop solve, how exactly and how long they take.

    The last column is the median, over the scenes that both have, of the loop's time over the preset's.
    """
    scenarios = dict.fromkeys(scenario for scenario, _ in grouped(rows))
    return _compared({f"`{name}`": [row for row in rows if row.scenario == name] for name in scenarios}, rows)


def short(rows: Sequence[Row]) -> Table:
    """The same per kind of picture, on the scenes that both have; kinds without any are left out."""
    scenes = [{(row.scenario, row.scene) for row in rows if row.method == method} for method in (OURS, PAPERS)]
    both = scenes[0] & scenes[1]
    kinds = {
        kind: [row for row in rows if row.scenario in scenarios and (row.scenario, row.scene) in both]
        for kind, scenarios in KINDS.items()
    }
    return _compared({kind: found for kind, found in kinds.items() if found}, rows)


def _compared(groups: Mapping[str, Sequence[Row]], rows: Sequence[Row]) -> Table:
    """A line for each group; `rows` are all there are, which say what seconds are compared."""
    time_name, seconds_of = comparable_seconds(rows)
    lines = []
    for label, group in groups.items():
        line = [label]
        for method in (OURS, PAPERS):
            mine = [row for row in group if row.method == method]
            flips = [error_of(row.flip) for row in mine]
            times = [time for time in map(seconds_of, mine) if time is not None]
            solved = f"{sum(flip <= SOLVED_FLIP for flip in flips)} of {len(mine)}"
            found = [solved, str(sum(map(is_at_noise, mine))), *(number(quantile(v, 0.5)) for v in (flips, times))]
            line += found if mine else ["–"] * len(found)
        lines.append([*line, number(quantile(_ratios(group, seconds_of), 0.5))])
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

    A block goes from ``<!-- bench -->`` to ``<!-- end -->`` and has the `headline`; from ``<!-- bench short -->`` it
    has the `short` table, from ``<!-- bench loop -->`` `against_the_loop`, from ``<!-- bench promises -->`` what
    `promises` says of the default preset.
    """
    return _BLOCK.sub(lambda found: f"{found[1]}{_text(found[2], rows)}{found[3]}", page)


def _text(name: str, rows: Sequence[Row]) -> str:
    if name in ("bench", "bench short"):
        table: Table | None = headline(rows) if name == "bench" else short(rows)
        below = (
            f"\nSolved: mean FLIP over the object of at most {SOLVED_FLIP:g}. At the noise: the result is at most "
            f"{SOLVED_FLIP:g} further from the reference\nthan the truth is. FLIP and time are medians.\n"
        )
    else:
        table = against_the_loop(rows) if name == "bench loop" else promises([r for r in rows if r.method == OURS])
        below = ""
    return "".join(f"{line}\n" for line in table.markdown()) + below if table else ""


def _ratios(rows: Sequence[Row], seconds_of: Callable[[Row], float | None]) -> list[float]:
    times = {(row.scenario, row.scene): seconds_of(row) for row in rows if row.method == OURS}
    pairs = [(times.get((row.scenario, row.scene)), seconds_of(row)) for row in rows if row.method == PAPERS]
    return [theirs / ours for ours, theirs in pairs if ours and theirs]
