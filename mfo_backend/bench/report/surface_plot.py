# SPDX-License-Identifier: Apache-2.0
"""Loss surfaces as one figure: a panel for each loss with the fit's way on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..runs.surface import Surface
from .figure import GREY, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_STAGE_COLOURS = ("#ffffff", "#ff8c42", "#d55e00", "#cc79a7", "#56b4e9")


def surface_figure(surface: Surface) -> Figure:
    """The panels in the order of the losses; the low-fidelity part of the way is white, what follows orange."""
    figure, panels = new_figure(3.9 * len(surface.losses), 4.1, len(surface.losses))
    for axes, name in zip(panels, surface.losses, strict=True):
        _panel(axes, surface, name)
    stages = ", then ".join(surface.ends)
    text = f"ring: start; line: {stages} (white, then orange); squares: where a stage hands over; cross: truth"
    figure.supxlabel(text, fontsize=8, color=GREY)
    return figure


def _panel(axes: Axes, surface: Surface, name: str) -> None:
    first, second = surface.nodes
    level = np.log(np.maximum(surface.losses[name], 1e-12))
    axes.grid(visible=False)
    axes.pcolormesh(first, second, level, shading="gouraud", cmap="viridis", rasterized=True)
    axes.set(title=f"{name}, log scale", xlabel=surface.names[0], ylabel=surface.names[1])
    axes.set(xlim=(first[0], first[-1]), ylim=(second[0], second[-1]))
    x, y = surface.path.T
    begin = 0
    for number, end in enumerate(surface.ends.values()):
        colour = _STAGE_COLOURS[min(number, len(_STAGE_COLOURS) - 1)]
        part = slice(max(begin - 1, 0), end)
        axes.plot(x[part], y[part], color=colour, linewidth=1.6)
        begin = end
    for end in [*surface.ends.values()][:-1]:
        at = min(end, len(x)) - 1
        axes.plot(x[at], y[at], "s", markersize=9, markerfacecolor="none", markeredgecolor="white")
    axes.plot(x[0], y[0], "o", color="white", markeredgecolor="black")
    for colour, width in (("black", 4), ("white", 2)):
        axes.plot(*surface.truth, "x", color=colour, markersize=9, markeredgewidth=width)
