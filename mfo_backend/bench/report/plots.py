# SPDX-License-Identifier: Apache-2.0
"""Time against quality: the share of scenes that reach a target by a time, and the Pareto plot."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from ..rows.method import METHODS
from ..rows.row import Row
from ..rows.summary import comparable_seconds, error_of, quantile
from .figure import COLOURS, legend_above, log_axis, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TimeOf = Callable[[Row], float | None]
_ORDER = tuple(METHODS)


def time_to_quality(rows: Sequence[Row], target: float) -> Figure | None:
    """The share of all scenes of one scenario that end at a mean FLIP of at most `target`, over seconds.

    A run counts from its end on; one that raises or ends above the target never does, so its curve stays below 100 %.
    None if no run has ended.
    """
    name, seconds_of = comparable_seconds(rows)
    return _reached(rows, target, f"{name} of the fit", seconds_of)


def data_profile(rows: Sequence[Row], target: float) -> Figure | None:
    """As `time_to_quality`, over passes, which do not depend on the machine."""
    return _reached(rows, target, "passes (pictures at full size; an Adam step counts 3)", lambda row: row.passes)


def _reached(rows: Sequence[Row], target: float, x_name: str, time_of: TimeOf) -> Figure | None:
    times = [time for time in map(time_of, rows) if time]
    if not times:
        return None
    figure, (axes,) = new_figure()
    log_axis("x", axes, min(times), max(times))
    first, last = axes.get_xlim()
    for method, mine in _by_method(rows):
        reached = sorted(time for row in mine if (time := time_of(row)) and error_of(row.flip) <= target)
        shares = [count / len(mine) for count in range(len(reached) + 1)]
        axes.step([first, *reached, last], [*shares, shares[-1]], where="post", color=_colour(method), label=method)
    axes.set(xlabel=x_name, ylabel=f"scenes with FLIP ≤ {target:g}", ylim=(0.0, 1.0))
    axes.yaxis.set_major_formatter(lambda share, _: f"{share:.0%}")
    legend_above(axes)
    return figure


def pareto(rows: Sequence[Row]) -> Figure | None:
    """Each method's median time and median mean FLIP (a dot) and both quartile ranges (a box).

    Runs that raised count as infinitely wrong; where they are half of a method's runs it has no dot, where a quarter
    its box reaches the top. None if nothing can be drawn.
    """
    name, seconds_of = comparable_seconds(rows)
    boxes = []
    for method, mine in _by_method(rows):
        seconds = [time for time in map(seconds_of, mine) if time]
        flips = [max(error_of(row.flip), 1e-6) for row in mine]
        if seconds and math.isfinite(quantile(flips, 0.5)):
            shares = (0.25, 0.5, 0.75)
            boxes.append((method, [quantile(seconds, s) for s in shares], [quantile(flips, s) for s in shares]))
    if not boxes:
        return None
    from matplotlib.patches import Rectangle

    figure, (axes,) = new_figure()
    all_times = [seconds for _, times, _ in boxes for seconds in times]
    errors = [flip for _, _, flips in boxes for flip in flips if math.isfinite(flip)]
    log_axis("x", axes, min(all_times), max(all_times))
    log_axis("y", axes, min(errors), max(errors))
    for method, times, flips in boxes:
        corner, top, colour = (times[0], flips[0]), min(flips[2], axes.get_ylim()[1]), _colour(method)
        axes.add_patch(Rectangle(corner, times[2] - times[0], top - flips[0], color=colour, alpha=0.18))
        axes.plot(times[1], flips[1], "o", color=colour, label=method)
    axes.set(xlabel=f"{name} of the fit", ylabel="mean FLIP over the object")
    legend_above(axes)
    return figure


def _by_method(rows: Sequence[Row]) -> list[tuple[str, list[Row]]]:
    names = sorted({row.method for row in rows}, key=lambda name: _ORDER.index(name) if name in _ORDER else 99)
    return [(name, [row for row in rows if row.method == name]) for name in names]


def _colour(method: str) -> str:
    """A method has the same colour in every plot; ours come first."""
    return COLOURS[_ORDER.index(method) % len(COLOURS)] if method in _ORDER else COLOURS[-1]
