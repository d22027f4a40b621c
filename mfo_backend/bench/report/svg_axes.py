# SPDX-License-Identifier: Apache-2.0
"""A frame with axes as SVG that stands alone and reads on light and dark grounds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape

WIDTH, HEIGHT = 560, 360
_LEFT, _RIGHT, _TOP, _BOTTOM = 62, 16, 50, 46
# Okabe and Ito's palette without its yellow and black, which vanish on one of the grounds, and two greys
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#7a7a7a", "#a65628")
_GREY = "#8a8f94"


@dataclass
class SvgAxes:
    """Axes over [low, high] of both directions; `log_y` and a log x axis are in decades."""

    title: str
    x_name: str
    y_name: str
    x_range: tuple[float, float]
    y_range: tuple[float, float]
    log_y: bool = False
    parts: list[str] = field(default_factory=list)

    def x(self, value: float) -> float:
        """Pixel of a value on the logarithmic x axis."""
        return _LEFT + (WIDTH - _LEFT - _RIGHT) * _share(value, self.x_range, log=True)

    def y(self, value: float) -> float:
        """Pixel of a value on the y axis."""
        return HEIGHT - _BOTTOM - (HEIGHT - _TOP - _BOTTOM) * _share(value, self.y_range, log=self.log_y)

    def line(self, points: Sequence[tuple[float, float]], colour: str) -> None:
        """A line through points."""
        drawn = " ".join(f"{self.x(a):.1f},{self.y(b):.1f}" for a, b in points)
        self.parts.append(f'<polyline points="{drawn}" fill="none" stroke="{colour}" stroke-width="2.2"/>')

    def box(self, x_range: tuple[float, float], y_range: tuple[float, float], colour: str) -> None:
        """A filled rectangle."""
        left, right = self.x(x_range[0]), self.x(x_range[1])
        bottom, top = self.y(y_range[0]), self.y(y_range[1])
        self.parts.append(
            f'<rect x="{left:.1f}" y="{top:.1f}" '
            f'width="{max(right - left, 1):.1f}" height="{max(bottom - top, 1):.1f}" '
            f'fill="{colour}" fill-opacity="0.18" stroke="{colour}" stroke-opacity="0.6"/>'
        )

    def dot(self, x: float, y: float, colour: str) -> None:
        """A point."""
        self.parts.append(f'<circle cx="{self.x(x):.1f}" cy="{self.y(y):.1f}" r="4.5" fill="{colour}"/>')

    def legend(self, names: Sequence[tuple[str, str]]) -> None:
        """Names with their colours over the frame, at most five in each of two rows."""
        for number, (name, colour) in enumerate(names):
            row, column = divmod(number, 5)
            x, y = _LEFT + column * (WIDTH - _LEFT - _RIGHT) / 5, 18 + 18 * row
            self.parts.append(f'<circle cx="{x + 4:.1f}" cy="{y - 4}" r="4" fill="{colour}"/>')
            self.parts.append(_text(x + 12, y, name, colour=colour))

    def svg(self) -> str:
        """The SVG element."""
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
            f'aria-label="{escape(self.title)}" font-family="system-ui, sans-serif" font-size="12">'
            + "".join([*self._frame(), *self.parts])
            + "</svg>"
        )

    def _frame(self) -> list[str]:
        bottom, right = HEIGHT - _BOTTOM, WIDTH - _RIGHT
        grid = f'stroke="{_GREY}" stroke-opacity="0.25"'
        parts = []
        for value in decade_ticks(*self.x_range):
            at = f"{self.x(value):.1f}"
            parts.append(f'<line x1="{at}" x2="{at}" y1="{_TOP}" y2="{bottom}" {grid}/>')
            parts.append(_text(self.x(value), bottom + 17, f"{value:g}", anchor="middle"))
        ticks = decade_ticks(*self.y_range) if self.log_y else [0.0, 0.25, 0.5, 0.75, 1.0]
        for value in ticks:
            at = f"{self.y(value):.1f}"
            parts.append(f'<line x1="{_LEFT}" x2="{right}" y1="{at}" y2="{at}" {grid}/>')
            label = f"{value:g}" if self.log_y else f"{value:.0%}"
            parts.append(_text(_LEFT - 7, self.y(value) + 4, label, anchor="end"))
        middle = (_TOP + bottom) / 2
        parts.append(_text((_LEFT + right) / 2, HEIGHT - 8, self.x_name, anchor="middle"))
        parts.append(
            f'<text x="14" y="{middle:.1f}" text-anchor="middle" fill="{_GREY}" '
            f'transform="rotate(-90 14 {middle:.1f})">{escape(self.y_name)}</text>'
        )
        return parts


def around(values: Sequence[float]) -> tuple[float, float]:
    """A range with some room around positive values, for a log axis."""
    return min(values) / 1.4, max(values) * 1.4


def decade_ticks(low: float, high: float) -> list[float]:
    """1, 2 and 5 of every decade inside the range, only the decades where it is wide."""
    digits = (1, 2, 5) if math.log10(high / low) <= 2.5 else (1,)
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    return [tick for power in powers for digit in digits if low <= (tick := float(f"{digit}e{power}")) <= high]


def _share(value: float, limits: tuple[float, float], *, log: bool) -> float:
    low, high = limits
    if log:
        low, high, value = math.log10(low), math.log10(high), math.log10(max(value, 1e-300))
    return min(max((value - low) / (high - low), 0.0), 1.0)


def _text(x: float, y: float, text: str, *, anchor: str = "start", colour: str = _GREY) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}">{escape(text)}</text>'
