# SPDX-License-Identifier: Apache-2.0
"""Pictures of a method's best, median and worst scenes."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from pathlib import Path

from ..rows.row import Row, Task
from ..rows.row_pictures import picture_file
from ..rows.summary import error_of


def best_median_worst(rows: Sequence[Row]) -> list[tuple[str, Row]]:
    """Three rows of one method by FLIP; those that raised have no picture and are not among them."""
    ordered = sorted((row for row in rows if row.flip is not None), key=lambda row: error_of(row.flip))
    if not ordered:
        return []
    return [("best", ordered[0]), ("median", ordered[(len(ordered) - 1) // 2]), ("worst", ordered[-1])]


def gallery(pictures: Path, rows: Sequence[Row], methods: Sequence[str]) -> str:
    """HTML of reference, truth and result for each method's three scenes; empty without pictures."""
    parts = []
    for method in methods:
        for name, row in best_median_worst([row for row in rows if row.method == method]):
            shown = [
                _figure(pictures, Task(row.scenario, row.scene, which), caption)
                for which, caption in (("reference", "reference"), ("truth", "truth"), (method, "result"))
            ]
            if all(shown):
                title = f"{method}, {name}: scene {row.scene}, FLIP {error_of(row.flip):.4f}, {row.object}, {row.light}"
                if row.material:
                    title += f", {row.material}"
                parts.append(f'<figure class="three">{"".join(shown)}<figcaption>{escape(title)}</figcaption></figure>')
    return f'<div class="pictures">{"".join(parts)}</div>' if parts else ""


def _figure(pictures: Path, task: Task, caption: str) -> str:
    try:
        data = base64.b64encode(picture_file(pictures, task).read_bytes()).decode("ascii")
    except OSError:
        return ""
    return f'<img alt="{escape(caption)}" title="{escape(caption)}" src="data:image/jpeg;base64,{data}">'
