# SPDX-License-Identifier: Apache-2.0
"""A result as a few lines for a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def result_text(result: Mapping[str, Any]) -> str:
    """Values and image differences before and after, from the content of result.json; of each material of several."""
    if result.get("materials"):
        parts = [
            f"{found['material']} on {found['object']}: {found['sentence']}\n{result_text(found)}"
            for found in result["materials"]
        ]
        return "\n\n".join(parts)
    labels = result.get("labels") or {}
    rows = [(result.get("shader") or "", "start", "result", "")]
    for name, value in result["recovered"].items():
        certainty = result.get("certainty", {}).get(name, {})
        level = certainty.get("words") or certainty.get("level", "")
        rows.append(
            (labels.get(name, name), _numbers(result["initial"].get(name)), _numbers(value), level.replace("_", " "))
        )
    rows += [(f"mean {name}", *map(_numbers, pair), "") for name, pair in result["errors"].items()]
    for picture in result.get("pictures", []):
        name = f"FLIP of picture {picture['number']} {picture['name']}".rstrip()
        rows.append((name, *map(_numbers, picture["errors"]["flip"]), picture["verdict"] or ""))
    if result.get("model_gap"):
        gap = result["model_gap"]
        rows.append(("model gap", "", f"{100 * gap['relative']:.2g} %", f"at most {100 * gap['at_most']:.2g} %"))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    lines += [weak["sentence"] for weak in result.get("weak_combinations", [])]
    lines += [result["next_picture"]["sentence"]] if result.get("next_picture") else []
    return "\n".join(lines)


def _numbers(value: Any) -> str:
    if value is None:
        return "-"
    return " ".join(f"{part:.4g}" for part in (value if isinstance(value, (list, tuple)) else [value]))
