# SPDX-License-Identifier: Apache-2.0
"""What the rows say beyond error and time: calibration, ablations, where time goes, what each stage gains."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from .method import METHODS
from .row import Row
from .stopwatch import PARTS
from .summary import SOLVED_FLIP, error_of, quantile
from .table import Table, number

# a normal error is inside 1, 2 and 3 standard deviations in these shares
_NORMAL = {1: 0.683, 2: 0.954, 3: 0.997}


def calibration(rows: Sequence[Row]) -> Table | None:
    """Shares of |error| within 1, 2 and 3 predicted standard deviations, by what the fit says of the value."""
    ratios: dict[tuple[str, str, str], list[float]] = {}
    for row in rows:
        for name, said in row.certainty.items():
            if name not in row.truth or name not in row.recovered:
                continue
            errors = np.abs(np.subtract(row.recovered[name], row.truth[name])).ravel()
            for error, sd in zip(errors, said["sd"], strict=True):
                ratio = error / sd if sd else math.inf
                ratios.setdefault((row.scenario, row.method, said["level"]), []).append(float(ratio))
    if not ratios:
        return None
    normal = ", ".join(f"{share:.0%}" for share in _NORMAL.values())
    heads = ("scenario", "method", "level", "values", *(f"within {k} sd" for k in _NORMAL), "median error / sd")
    lines = [("a normal error", "", "", "", *normal.split(", "), "0.674")]
    for (scenario, method, level), found in sorted(ratios.items()):
        shares = (f"{np.mean([ratio <= k for ratio in found]):.0%}" for k in _NORMAL)
        lines.append((scenario, method, level, str(len(found)), *shares, number(quantile(found, 0.5))))
    return Table(heads, lines)


def ablations(rows: Sequence[Row]) -> Table | None:
    """Each ablation against the whole method, on the scenes that both have."""
    lines = []
    for name, method in METHODS.items():
        for scenario in dict.fromkeys(row.scenario for row in rows):
            less = {row.scene: row for row in rows if (row.scenario, row.method) == (scenario, name)}
            whole = {row.scene: row for row in rows if (row.scenario, row.method) == (scenario, method.compares_with)}
            scenes = sorted(set(less) & set(whole))
            if not scenes:
                continue
            for title, chosen in ((method.compares_with, whole), (name, less)):
                mine = [chosen[scene] for scene in scenes]
                flips = [error_of(row.flip) for row in mine]
                passes = [row.passes for row in mine if row.passes is not None]
                good = sum(flip <= SOLVED_FLIP for flip in flips)
                cells = (f"{good} of {len(mine)}", number(quantile(flips, 0.5)), number(quantile(flips, 0.9)))
                lines.append((scenario, title, *cells, number(quantile(passes, 0.5))))
    heads = ("scenario", "method", f"FLIP ≤ {SOLVED_FLIP:g}", "median FLIP", "90 %", "median passes")
    return Table(heads, lines) if lines else None


def time_parts(rows: Sequence[Row]) -> Table | None:
    """Median seconds of loading and of the parts of a fit, and what a process costs once: imports and kernels."""
    lines = []
    for scenario, method in dict.fromkeys((row.scenario, row.method) for row in rows):
        mine = [row for row in rows if (row.scenario, row.method) == (scenario, method) and row.parts]
        if not mine:
            continue
        warm = [
            row for row in mine if row.warm_up_seconds and row.seconds and METHODS[method].settings["preset"] != "paper"
        ]
        first = [row.warm_up_seconds - (row.seconds or 0.0) - (row.load_seconds or 0.0) for row in warm]
        imports = [row.machine["import_seconds"] for row in mine if "import_seconds" in row.machine]
        lines.append(
            (
                scenario,
                method,
                number(quantile([row.load_seconds for row in mine if row.load_seconds is not None], 0.5)),
                *(number(quantile([row.parts.get(part, 0.0) for row in mine], 0.5)) for part in PARTS),
                number(quantile([row.seconds for row in mine if row.seconds is not None], 0.5)),
                number(max(0.0, quantile(first, 0.5))) if first else "–",
                number(quantile(imports, 0.5)),
            )
        )  # fmt: skip
    heads = ("scenario", "method", "load", *PARTS, "fit", "kernels, once", "imports, once")
    return Table(heads, lines) if lines else None


def stage_gains(rows: Sequence[Row]) -> Table | None:
    """Median FLIP and passes at the end of every stage."""
    lines = []
    for scenario, method in dict.fromkeys((row.scenario, row.method) for row in rows):
        mine = [row for row in rows if (row.scenario, row.method) == (scenario, method) and row.stages]
        names = dict.fromkeys(stage["name"] for row in mine for stage in row.stages)
        for name in names:
            ends = [stage for row in mine for stage in row.stages if stage["name"] == name]
            flips = [error_of(stage["flip"]) for stage in ends]
            passes = [stage["passes"] for stage in ends if stage["passes"] is not None]
            cells = (number(quantile(flips, 0.5)), number(quantile(flips, 0.9)), number(quantile(passes, 0.5)))
            lines.append((scenario, method, name, *cells))
    heads = ("scenario", "method", "stage", "median FLIP at its end", "90 %", "median passes until then")
    return Table(heads, lines) if lines else None
