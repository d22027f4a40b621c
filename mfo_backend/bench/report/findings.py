# SPDX-License-Identifier: Apache-2.0
"""What the rows say beyond error and time: kept promises, ablations, where time goes, what each stage gains."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from ...types.certainty import Level
from ..judge.promise import inside, is_wrongly_determined, miss
from ..rows.method import METHODS, OUR_METHODS, PAPER_METHODS
from ..rows.row import Row
from ..rows.summary import SOLVED_FLIP, comparable_seconds, error_of, grouped, is_at_noise, quantile
from ..runs.stopwatch import PARTS
from ..scenes.scenario import SCENARIOS
from ..scenes.scene import TABLES
from .table import Table, number

TOGETHER = "all"  # scenarios of a table
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


def promises(rows: Sequence[Row]) -> Table | None:
    """How many values the presets call determined, how many of those are wrong, and whether intervals hold the truth.

    The 95 % intervals are those of determined and weak values, each component of a colour counted.
    """
    lines = []
    known = (row for row in rows if row.scenario in SCENARIOS and row.method in OUR_METHODS and row.truth)
    for (scenario, method), mine in grouped(known).items():
        determined = wrong = held = shown = 0
        for row in mine:
            for name, said in row.certainty.items():
                parameter = TABLES[SCENARIOS[scenario].model][name]
                missed = miss(row.recovered[name], row.truth[name], parameter)
                if said["level"] == Level.DETERMINED.value:
                    determined += 1
                    wrong += is_wrongly_determined(missed, said["sd"], parameter)
                if said["level"] in (Level.DETERMINED.value, Level.WEAK.value):
                    shown += missed.size
                    held += inside(missed, said["sd"])
        if shown:
            share = f"{held / shown:.0%}"
            counts = (len(mine), determined, wrong, shown)
            lines.append((scenario, method, *map(str, counts), share))
    heads = ("scenario", "method", "runs", "called determined", "of these wrong", "determined and weak", "inside 95 %")
    return Table(heads, lines) if lines else None


def against_the_loop(rows: Sequence[Row]) -> Table | None:
    """Each loss of the paper's loop beside the default preset, on the scenes that both have.

    Nearer: scenes in which the loop's result has the smaller FLIP. Times longer: median ratio of `comparable_seconds`,
    and of the loop's to what the preset takes to the end of its first stage with no more than the loop's last FLIP.
    Last, all scenarios together, each scene counting once.
    """
    _, seconds_of = comparable_seconds(rows)
    lines = []
    groups = grouped(rows)
    together: dict[str, list[tuple[Row, Row]]] = {}
    for (scenario, method), theirs in groups.items():
        ours = {row.scene: row for row in groups.get((scenario, "balanced"), ())}
        both = [(ours[row.scene], row) for row in theirs if method in PAPER_METHODS and row.scene in ours]
        if both:
            lines.append((scenario, method, *_beside(both, seconds_of)))
            together.setdefault(method, []).extend(both)
    if len({scenario for scenario, *_ in lines}) > 1:
        lines += [(TOGETHER, method, *_beside(both, seconds_of)) for method, both in together.items()]
    heads = (
        "scenario", "loop with", "`balanced`: at the noise", "mean FLIP", "loop: at the noise", "mean FLIP",
        "loop nearer", "times longer", "to the same FLIP",
    )  # fmt: skip
    return Table(heads, lines) if lines else None


def _beside(both: Sequence[tuple[Row, Row]], seconds_of: Callable[[Row], float | None]) -> list[str]:
    """What `against_the_loop` says of runs of the preset and the loop on the same scenes."""
    cells = []
    for side in zip(*both, strict=True):
        mean = np.mean([error_of(row.flip) for row in side])
        cells += [f"{sum(map(is_at_noise, side))} of {len(both)}", number(float(mean))]
    nearer = sum(error_of(its.flip) < error_of(own.flip) for own, its in both)
    times = [(seconds_of(own), seconds_of(its)) for own, its in both]
    ratio = quantile([long / short for short, long in times if short and long], 0.5)
    to_it = [(row.processor_seconds, _seconds_to(error_of(row.flip), own)) for own, row in both]
    same = [long / short for long, short in to_it if long and short]
    return [*cells, str(nearer), number(ratio), number(quantile(same, 0.5)) if same else "–"]


def _seconds_to(flip: float, row: Row) -> float | None:
    """Processor seconds of a fit until a stage has ended within `flip` of the truth; infinite where none does, None
    where the row does not know them."""
    times = {stage["name"]: stage.get("processor_seconds") for stage in row.stages}
    if not times or None in times.values():
        return None
    return next((times[stage["name"]] for stage in row.stages if error_of(stage["flip"]) <= flip), np.inf)


def ablations(rows: Sequence[Row]) -> Table | None:
    """Each ablation against the whole method, on the scenes that both have."""
    lines = []
    groups = grouped(rows)
    for name, method in METHODS.items():
        for scenario in dict.fromkeys(row.scenario for row in rows):
            less = {row.scene: row for row in groups.get((scenario, name), ())}
            whole = {row.scene: row for row in groups.get((scenario, method.compares_with), ())}
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
    for (scenario, method), group in grouped(rows).items():
        mine = [row for row in group if row.parts]
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
    for (scenario, method), group in grouped(rows).items():
        mine = [row for row in group if row.stages]
        names = dict.fromkeys(stage["name"] for row in mine for stage in row.stages)
        for name in names:
            ends = [stage for row in mine for stage in row.stages if stage["name"] == name]
            flips = [error_of(stage["flip"]) for stage in ends]
            passes = [stage["passes"] for stage in ends if stage["passes"] is not None]
            cells = (number(quantile(flips, 0.5)), number(quantile(flips, 0.9)), number(quantile(passes, 0.5)))
            lines.append((scenario, method, name, *cells))
    heads = ("scenario", "method", "stage", "median FLIP at its end", "90 %", "median passes until then")
    return Table(heads, lines) if lines else None
