# SPDX-License-Identifier: Apache-2.0
"""The values of a material as HTML rows: recovered, how sure, initial and where they lie between their bounds."""

from __future__ import annotations

from html import escape

import numpy as np

from ..metrics.display.colour import srgb_from_linear
from ..types.certainty import Certainty, Level
from ..types.parameter import Value, socket_name
from ..types.result import FitResult

_WITH_SPREAD = (Level.DETERMINED, Level.WEAK)


def value_rows(result: FitResult) -> str:
    """One table row per fitted parameter."""
    return "".join(_row(name, result) for name in result.recovered)


def as_text(result: FitResult) -> str:
    """Verdict and values as lines for a mail: colours as hex codes of a display, others with four digits."""
    lines = [result.message]
    for name, value in result.recovered.items():
        shown = swatch_colour(value) if len(_components(value)) == 3 else value_text(value)
        sure = result.certainty.get(name)
        words = f" ({sure.words})" if sure is not None else ""
        lines.append(f"{result.labels.get(name) or socket_name(name)}: {shown}{words}")
    return "\n".join(lines)


def value_text(value: Value) -> str:
    """A value with four significant digits, components separated by spaces."""
    return " ".join(f"{component:.4g}" for component in _components(value))


def swatch_colour(value: Value) -> str:
    """The CSS colour of a linear Rec.709 colour, clipped to the display."""
    display = srgb_from_linear(np.clip(np.asarray(_components(value), np.float32), 0.0, 1.0))
    red, green, blue = (round(float(component) * 255) for component in display)
    return f"#{red:02x}{green:02x}{blue:02x}"


def _row(name: str, result: FitResult) -> str:
    recovered, initial, bounds = result.recovered[name], result.initial.get(name), result.bounds.get(name)
    cells = [f'<th scope="row">{escape(result.labels.get(name) or socket_name(name))}</th>']
    cells.append(f"<td>{_shown(recovered)}</td>")
    if result.certainty:
        cells.append(f'<td class="sentence">{_certainty(result.certainty.get(name))}</td>')
    cells.append(f"<td>{_shown(initial)}</td>")
    cells.append(f'<td class="bounds">{bounds[0]:.4g} to {bounds[1]:.4g}</td>' if bounds else "<td></td>")
    cells.append(f'<td class="where">{_track(initial, recovered, bounds)}</td>')
    return f"<tr>{''.join(cells)}</tr>"


def _certainty(certainty: Certainty | None) -> str:
    """The level in words with the standard deviation, where that says something."""
    if certainty is None:
        return ""
    spread = f" ±{max(certainty.sd):.2g}" if certainty.level in _WITH_SPREAD else ""
    return escape(certainty.words) + spread


def _shown(value: Value | None) -> str:
    if value is None:
        return ""
    if len(_components(value)) == 3:
        code = swatch_colour(value)
        swatch = f'<span class="swatch" style="background:{code}"></span>'
        return f'{swatch}<code>{code}</code><span class="linear">{value_text(value)}</span>'
    return value_text(value)


def _track(initial: Value | None, recovered: Value, bounds: tuple[float, float] | None) -> str:
    """A line from lower to upper bound with a ring per initial and a dot per recovered component."""
    if bounds is None or not bounds[1] > bounds[0]:
        return ""

    def position(component: float) -> float:
        share = (component - bounds[0]) / (bounds[1] - bounds[0])
        return 6 + 108 * min(max(share, 0.0), 1.0)

    marks = ['<line class="rail" x1="6" x2="114" y1="9" y2="9"/>']
    for kind, value in (("from", initial), ("to", recovered)):
        components = () if value is None else _components(value)
        for index, component in enumerate(components):
            channel = f" c{index}" if len(components) == 3 else ""
            marks.append(f'<circle class="{kind}{channel}" cx="{position(component):.1f}" cy="9" r="4.5"/>')
    return f'<svg viewBox="0 0 120 18" width="120" height="18" aria-hidden="true">{"".join(marks)}</svg>'


def _components(value: Value) -> tuple[float, ...]:
    return tuple(value) if isinstance(value, tuple) else (float(value),)
