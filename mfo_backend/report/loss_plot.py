# SPDX-License-Identifier: Apache-2.0
"""The loss over time as inline SVG; colours come from the CSS classes of the report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from ..types.result import StageReport

WIDTH, HEIGHT = 880, 340
LEFT, RIGHT, TOP, BOTTOM = 64, 16, 34, 44
LETTER = 8.0  # of a bold letter of 13 pixels, at most
MOST_POINTS = 600  # about one a pixel; thousands of iterations would only make the file large


def loss_plot(stages: Sequence[StageReport]) -> str:
    """An SVG element with every stage's loss (thin) and best loss (thick) on a log axis over the seconds of the fit.

    Empty if no stage has a finite, positive loss.
    """
    points = [(p.seconds, value) for stage in stages for p in stage.curve for value in (p.loss, p.best)]
    values = [value for _, value in points if math.isfinite(value) and value > 0]
    if not values:
        return ""
    end = max(max(seconds for seconds, _ in points), 1e-3)
    low, high = _decades(min(values), max(values))

    def x(seconds: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * seconds / end

    def y(value: float) -> float:
        return TOP + (HEIGHT - TOP - BOTTOM) * (high - math.log10(value)) / (high - low)

    parts = [*_grid(low, high, end, x, y)]
    begin, free = 0.0, 0.0
    for number, stage in enumerate(stage for stage in stages if stage.curve):
        if number:
            at = f"{x(begin):.1f}"
            parts.append(f'<line class="switch" x1="{at}" x2="{at}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>')
        # a narrow last stage would push its label over the edge
        anchor = "end" if x(begin) > WIDTH * 0.8 else "start"
        shift = -6 if anchor == "end" else 6
        place, width = x(begin) + shift, LETTER * len(stage.name)
        left = place - width if anchor == "end" else place
        height = TOP - 12 if left >= free else TOP + 16  # below the name of a short stage before it
        free = max(free, left + width)
        parts.append(
            f'<text class="stage s{number % 4}" x="{place:.1f}" y="{height}" text-anchor="{anchor}">'
            f"{escape(stage.name)}</text>"
        )
        for kind in ("loss", "best"):
            line = [(p.seconds, getattr(p, kind)) for p in _thinned(stage.curve)]
            drawn = " ".join(f"{x(t):.1f},{y(v):.1f}" for t, v in line if math.isfinite(v) and v > 0)
            parts.append(f'<polyline class="{kind} s{number % 4}" points="{drawn}"/>')
        begin = max(p.seconds for p in stage.curve)
    names = " then ".join(stage.name for stage in stages)
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="Loss over time: {escape(names)}">'
        + "".join(parts)
        + "</svg>"
    )


def _decades(lowest: float, highest: float) -> tuple[float, float]:
    """Bounds of the axis in powers of ten, on whole decades or, for a narrow range, close around it."""
    low, high = math.log10(lowest), math.log10(highest)
    if high - low < 1.0:
        return low - 0.1, max(high + 0.1, low + 0.3)
    return math.floor(low + 1e-9), math.ceil(high - 1e-9)


def _grid(low, high, end, x, y):  # type: ignore[no-untyped-def]  # x and y are closures of loss_plot
    bottom = HEIGHT - BOTTOM
    for value in _loss_ticks(low, high):
        yield f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y(value):.1f}" y2="{y(value):.1f}"/>'
        yield f'<text class="tick" x="{LEFT - 8}" y="{y(value) + 4:.1f}" text-anchor="end">{value:.3g}</text>'
    for seconds in _time_ticks(end):
        yield f'<line class="axis" x1="{x(seconds):.1f}" x2="{x(seconds):.1f}" y1="{bottom}" y2="{bottom + 5}"/>'
        yield f'<text class="tick" x="{x(seconds):.1f}" y="{bottom + 20}" text-anchor="middle">{seconds:g}</text>'
    yield f'<line class="axis" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{bottom}" y2="{bottom}"/>'
    yield f'<text class="tick" x="{WIDTH - RIGHT}" y="{HEIGHT - 6}" text-anchor="end">seconds</text>'


def _loss_ticks(low: float, high: float) -> list[float]:
    if high - low >= 1.0:
        step = max(1, math.ceil((high - low) / 8))
        ticks = [10.0**power for power in range(math.ceil(low), math.floor(high) + 1, step)]
        if high - low <= 2.0:
            ticks += [digit * 10.0**power for power in range(math.floor(low), math.ceil(high)) for digit in (2, 5)]
        return sorted(ticks)
    step = _nice((10**high - 10**low) / 5)
    return [n * step for n in range(math.ceil(10**low / step), math.floor(10**high / step) + 1)]


def _time_ticks(end: float) -> list[float]:
    step = _nice(end / 7)
    return [round(n * step, 9) for n in range(math.floor(end / step) + 1)]


def _nice(step: float) -> float:
    """The next of 1, 2, 5 times a power of ten at or above `step`."""
    power = 10.0 ** math.floor(math.log10(step))
    return next(digit * power for digit in (1, 2, 5, 10) if digit * power >= step * 0.999)


def _thinned(curve):  # type: ignore[no-untyped-def]  # tuple[CurvePoint, ...] in and out
    if len(curve) <= MOST_POINTS:
        return curve
    stride = math.ceil(len(curve) / MOST_POINTS)
    return [*curve[:-1:stride], curve[-1]]
