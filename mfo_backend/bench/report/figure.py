# SPDX-License-Identifier: Apache-2.0
"""Figures by matplotlib as SVG that stands alone and reads on light and dark grounds.

Matplotlib is no dependency of a fit: only who draws needs it (the extra `bench`).
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from ...types.errors import SetupError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's palette without its yellow and black, which vanish on one of the grounds, and two greys
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#7a7a7a", "#a65628")
GREY = "#8a8f94"
_STYLE: dict[Any, Any] = {
    "font.size": 9,
    "font.family": "sans-serif",
    **dict.fromkeys(("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color"), GREY),
    "axes.grid": True,
    "grid.color": GREY,
    "grid.alpha": 0.25,
    "svg.fonttype": "none",  # text stays text
    "svg.hashsalt": "material-fit",  # the same figure is the same file
}


def require_matplotlib() -> None:
    """Ask before hours of measuring what the report will need.

    Raises
    ------
    SetupError
        If matplotlib is not installed.
    """
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError:
        raise SetupError("Plots of the bench need matplotlib: run `python -m pip install matplotlib`.") from None


def new_figure(width: float = 5.6, height: float = 3.6, panels: int = 1) -> tuple[Figure, list[Axes]]:
    """An empty figure of so many inches with axes beside each other.

    Raises
    ------
    SetupError
        If matplotlib is not installed.
    """
    require_matplotlib()
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(width, height), layout="constrained")
        return figure, list(figure.subplots(1, panels, squeeze=False)[0])


def log_axis(axis: str, axes: Axes, low: float, high: float) -> None:
    """Make an axis (``"x"`` or ``"y"``) logarithmic over positive values, with some room around them."""
    getattr(axes, f"set_{axis}scale")("log")
    getattr(axes, f"set_{axis}lim")(low / 1.4, high * 1.4)
    getattr(axes, f"{axis}axis").set_major_formatter("{x:g}")


def legend_above(axes: Axes, columns: int = 5) -> None:
    """The names of what was drawn, in its colours, in rows over the frame."""
    options = {"frameon": False, "fontsize": 8, "handlelength": 1.0, "columnspacing": 1.2}
    axes.figure.legend(loc="outside upper left", ncols=columns, labelcolor="linecolor", **options)


def svg(figure: Figure) -> str:
    """The SVG element."""
    import matplotlib as mpl

    out = io.StringIO()
    with mpl.rc_context(_STYLE):
        figure.savefig(out, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    return text[text.index("<svg") :]
