# SPDX-License-Identifier: Apache-2.0
"""Loss surfaces as one SVG: a panel for each loss with the fit's way on it."""

from __future__ import annotations

import base64
from html import escape

import numpy as np
from numpy.typing import NDArray

from ...report.picture import png_bytes
from ..judge.surface import Surface

_SIDE, _LEFT, _TOP, _GAP, _BOTTOM = 300, 62, 34, 74, 64
_GREY = "#8a8f94"
_STAGE_COLOURS = ("#ffffff", "#ff8c42", "#d55e00", "#cc79a7", "#56b4e9")
# from low to high, dark to light, also without colour (five points of Smith and van der Walt's viridis)
_SCALE = np.array([[0.27, 0.0, 0.33], [0.23, 0.32, 0.55], [0.13, 0.57, 0.55], [0.37, 0.79, 0.38], [0.99, 0.91, 0.14]])


def surface_svg(surface: Surface) -> str:
    """The panels in the order of the losses; the low-fidelity part of the way is white, what follows orange."""
    names = list(surface.losses)
    width = _LEFT + len(names) * (_SIDE + _GAP) - _GAP + 16
    height = _TOP + _SIDE + _BOTTOM
    parts = [_panel(surface, name, _LEFT + index * (_SIDE + _GAP)) for index, name in enumerate(names)]
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img" aria-label="Loss surfaces" '
        f'font-family="system-ui, sans-serif" font-size="12">{"".join(parts)}{_legend(surface, height)}</svg>'
    )


def _panel(surface: Surface, name: str, left: float) -> str:
    data = base64.b64encode(png_bytes(heat(surface.losses[name]))).decode("ascii")
    place = f'x="{left}" y="{_TOP}" width="{_SIDE}" height="{_SIDE}"'
    parts = [
        f'<image {place} preserveAspectRatio="none" href="data:image/png;base64,{data}"/>',
        _text(left + _SIDE / 2, _TOP - 12, f"{name}, log scale"),
        _text(left + _SIDE / 2, _TOP + _SIDE + 32, surface.names[0]),
    ]
    for axis in (0, 1):
        low, high = surface.nodes[axis][0], surface.nodes[axis][-1]
        for value in (low, (low + high) / 2, high):
            share = (value - low) / (high - low)
            if axis == 0:
                parts.append(_text(left + share * _SIDE, _TOP + _SIDE + 16, f"{value:.2f}"))
            else:
                parts.append(_text(left - 6, _TOP + _SIDE * (1 - share) + 4, f"{value:.2f}", anchor="end"))
    middle = _TOP + _SIDE / 2
    turned = f'transform="rotate(-90 {left - 44} {middle})"'
    parts.append(
        f'<text x="{left - 44}" y="{middle}" text-anchor="middle" fill="{_GREY}" {turned}>'
        f"{escape(surface.names[1])}</text>"
    )
    points = [_at(surface, left, values) for values in surface.path]
    begin = 0
    for number, end in enumerate(surface.ends.values()):
        drawn = " ".join(f"{x:.1f},{y:.1f}" for x, y in points[max(begin - 1, 0) : end])
        colour = _STAGE_COLOURS[min(number, len(_STAGE_COLOURS) - 1)]
        parts.append(f'<polyline points="{drawn}" fill="none" stroke="{colour}" stroke-width="1.8"/>')
        begin = end
    for end in [*surface.ends.values()][:-1]:
        x, y = points[min(end, len(points)) - 1]
        parts.append(f'<rect x="{x - 5:.1f}" y="{y - 5:.1f}" width="10" height="10" fill="none" stroke="#fff"/>')
    x, y = points[0]
    parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" fill="#fff" stroke="#000"/>')
    x, y = _at(surface, left, np.array(surface.truth))
    cross = f"M{x - 6:.1f} {y - 6:.1f}l12 12m0 -12l-12 12"
    parts.append(
        f'<path d="{cross}" stroke="#000" stroke-width="4"/><path d="{cross}" stroke="#fff" stroke-width="2"/>'
    )
    return "".join(parts)


def _at(surface: Surface, left: float, values: NDArray[np.float64]) -> tuple[float, float]:
    shares = [
        (values[axis] - surface.nodes[axis][0]) / (surface.nodes[axis][-1] - surface.nodes[axis][0]) for axis in (0, 1)
    ]
    return left + _SIDE * float(shares[0]), _TOP + _SIDE * (1.0 - float(shares[1]))


def heat(losses: NDArray[np.float64], side: int = 150) -> NDArray[np.float32]:
    """A picture (side, side, 3) of the logarithm of losses (n, n), low ones dark, the first row at the bottom."""
    level = np.log(np.maximum(losses, 1e-12))
    level = (level - level.min()) / max(float(np.ptp(level)), 1e-12)
    at = np.linspace(0.0, len(level) - 1.0, side)
    rows = np.stack([np.interp(at, np.arange(len(level)), column) for column in level.T], axis=1)
    full = np.stack([np.interp(at, np.arange(rows.shape[1]), row) for row in rows])[::-1]
    stops = np.linspace(0.0, 1.0, len(_SCALE))
    return np.stack([np.interp(full, stops, channel) for channel in _SCALE.T], axis=-1).astype(np.float32)


def _legend(surface: Surface, height: int) -> str:
    stages = ", then ".join(surface.ends)
    text = f"ring: start; line: {stages} (white, then orange); squares: where a stage hands over; cross: truth"
    return _text(_LEFT, height - 10, text, anchor="start")


def _text(x: float, y: float, text: str, *, anchor: str = "middle") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{_GREY}">{escape(text)}</text>'
