# SPDX-License-Identifier: Apache-2.0
"""A table as Markdown, HTML and CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape


@dataclass(frozen=True)
class Table:
    """Cells as text, the first column left and the others right."""

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]

    def markdown(self) -> list[str]:
        """Lines of a Markdown table."""
        lines = [self.heads, ("---", *["--:"] * (len(self.heads) - 1)), *self.rows]
        return [f"| {' | '.join(line)} |" for line in lines]

    def html(self) -> str:
        """A table element."""
        head = "".join(f"<th>{escape(name)}</th>" for name in self.heads)
        rows = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in self.rows)
        return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'

    def csv(self) -> str:
        """Comma-separated values with a line of heads."""
        text = io.StringIO()
        csv.writer(text, lineterminator="\n").writerows([self.heads, *self.rows])
        return text.getvalue()


def number(value: float | None) -> str:
    """Three digits; a dash where there is no finite value."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def minutes(seconds: float | None) -> str:
    """mm:ss as the paper writes it; tenths of a second below ten."""
    if seconds is None or not math.isfinite(seconds):
        return "–"
    return f"{seconds:.1f} s" if seconds < 10 else "{:02d}:{:02d}".format(*divmod(round(seconds), 60))
