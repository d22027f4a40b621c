# SPDX-License-Identifier: Apache-2.0
"""Time against quality: the share of scenes that reach a target by a time, and the Pareto plot."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from ..rows.row import Row
from ..rows.summary import comparable_seconds, error_of, quantile
from ..runs.method import METHODS
from .svg_axes import COLOURS, SvgAxes, around

TimeOf = Callable[[Row], float | None]
_ORDER = tuple(METHODS)


def time_to_quality(rows: Sequence[Row], target: float) -> str:
    """An SVG with the share of all scenes of one scenario that end at a mean FLIP of at most `target`, over seconds.

    A run counts from its end on; one that raises or ends above the target never does, so its curve stays below 100 %.
    Empty if no run has ended.
    """
    name, seconds_of = comparable_seconds(rows)
    return _reached(rows, target, f"{name} of the fit", seconds_of)


def _reached(rows: Sequence[Row], target: float, x_name: str, time_of: TimeOf) -> str:
    times = [time for time in map(time_of, rows) if time]
    if not times:
        return ""
    axes = SvgAxes(
        f"Share of scenes with FLIP at most {target:g}",
        x_name,
        f"scenes with FLIP ≤ {target:g}",
        around(times),
        (0.0, 1.0),
    )
    for method, mine in _by_method(rows):
        reached = sorted(time for row in mine if (time := time_of(row)) and error_of(row.flip) <= target)
        points = [(axes.x_range[0], 0.0)]
        for count, seconds in enumerate(reached, start=1):
            points += [(seconds, (count - 1) / len(mine)), (seconds, count / len(mine))]
        points.append((axes.x_range[1], len(reached) / len(mine)))
        axes.line(points, _colour(method))
    axes.legend([(method, _colour(method)) for method, _ in _by_method(rows)])
    return axes.svg()


def data_profile(rows: Sequence[Row], target: float) -> str:
    """As `time_to_quality`, over passes, which do not depend on the machine."""
    return _reached(rows, target, "passes (pictures at full size; an Adam step counts 3)", lambda row: row.passes)


def pareto(rows: Sequence[Row]) -> str:
    """An SVG with each method's median time and median mean FLIP (a dot) and both quartile ranges (a box).

    Runs that raised count as infinitely wrong; where they are half of a method's runs it has no dot, where a quarter
    its box reaches the top. Empty if nothing can be drawn.
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
        return ""
    errors = [flip for _, _, flips in boxes for flip in flips if math.isfinite(flip)]
    axes = SvgAxes(
        "Error against time",
        f"{name} of the fit",
        "mean FLIP over the object",
        around([seconds for _, times, _ in boxes for seconds in times]),
        around(errors),
        log_y=True,
    )
    for method, times, flips in boxes:
        axes.box((times[0], times[2]), (flips[0], min(flips[2], axes.y_range[1])), _colour(method))
    for method, times, flips in boxes:
        axes.dot(times[1], flips[1], _colour(method))
    axes.legend([(method, _colour(method)) for method, _, _ in boxes])
    return axes.svg()


def _by_method(rows: Sequence[Row]) -> list[tuple[str, list[Row]]]:
    names = sorted({row.method for row in rows}, key=lambda name: _ORDER.index(name) if name in _ORDER else 99)
    return [(name, [row for row in rows if row.method == name]) for name in names]


def _colour(method: str) -> str:
    """A method has the same colour in every plot; ours come first."""
    return COLOURS[_ORDER.index(method) % len(COLOURS)] if method in _ORDER else COLOURS[-1]
