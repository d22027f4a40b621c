# SPDX-License-Identifier: Apache-2.0
"""The ladder study as a table and a plot."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from mfo_backend.bench.report.figure import COLOURS, legend_above, log_axis, new_figure

BEGIN, END = "<!-- studies/losses/ladder.py writes from here -->", "<!-- to here -->"
SOLVED = 0.02  # mean FLIP over the object that few see
PAPER = "mse > flip"
_NAMED = (PAPER, "mse", "flip", "mse > cvvdp", "cvvdp")  # in the plot, besides those nothing beats in both directions
Rows = list[dict[str, Any]]
# what a method ends with decides its colour
_GROUPS = ("one squared", "flip", "itp", "pu21", "cvvdp", "ldr", "three losses", "recorded")


def methods_of(rows: Rows) -> list[str]:
    """Names of the methods that every scene has."""
    return [name for name in rows[0]["methods"] if all(name in row["methods"] for row in rows)]


def cost(row: dict[str, Any], name: str, loss_passes: dict[str, float]) -> float:
    """Passes of a method, those its losses take the time of included."""
    method = row["methods"][name]
    return method["passes"] + sum(count * loss_passes[loss] for loss, count in method["iterations"].items())


def loss_costs(rows: Rows) -> dict[str, float]:
    """Median time of each loss in passes."""
    return {name: float(np.median([row["loss_passes"][name] for row in rows])) for name in rows[0]["loss_passes"]}


def table(rows: Rows) -> str:
    """The Markdown between the markers, least mean FLIP first."""
    lights = [sum(row["light"] == light for row in rows) for light in ("point", "probe")]
    losses = loss_costs(rows)
    judged = all(row["methods"]["start"]["lost_jod"] is not None for row in rows)
    lines = [
        f"{len(rows)} scenes, {rows[0]['size']}x{rows[0]['size']} ({lights[0]} with a point light, {lights[1]} with a "
        "light probe and a reference of 64 samples a pixel).",
        "",
        f"| stages | FLIP mean | median | worst quarter from | at most {SOLVED} | below `{PAPER}` | HDR-FLIP mean | "
        f"dE_ITP mean | {'10 - JOD mean | ' if judged else ''}parameters | passes, median |",
        f"|---|---|---|---|---|---|---|---|{'---|' if judged else ''}---|---|",
    ]
    found = []
    paper = np.array([row["methods"][PAPER]["flip"] for row in rows])
    for name in methods_of(rows):
        columns = {
            key: np.array([row["methods"][name][key] for row in rows], float)
            for key in ("flip", "hdr_flip", "de_itp", "lost_jod", "parameter")
        }
        passes = float(np.median([cost(row, name, losses) for row in rows]))
        flip = columns["flip"]
        cells = [
            name,
            f"{flip.mean():.4f}",
            f"{np.median(flip):.4f}",
            f"{np.quantile(flip, 0.75):.4f}",
            f"{np.mean(flip <= SOLVED):.0%}",
            "" if name == PAPER else f"{np.mean(flip < paper):.0%}",
            f"{columns['hdr_flip'].mean():.4f}",
            f"{columns['de_itp'].mean():.2f}",
            *([f"{columns['lost_jod'].mean():.3f}"] if judged else []),
            f"{columns['parameter'].mean():.3f}",
            f"{passes:.0f}",
        ]
        found.append((flip.mean(), f"| {' | '.join(cells)} |"))
    lines += [line for _, line in sorted(found)]
    costs = ", ".join(f"{name} {value:.2g}" for name, value in sorted(losses.items(), key=lambda item: item[1]))
    lines += ["", f"A value with its gradient takes the time of so many passes: {costs}."]
    return "\n".join(lines)


def plot(rows: Rows) -> Figure:
    """A figure with a dot for every method: median passes against mean FLIP, named by what it ends with."""
    losses = loss_costs(rows)
    dots = []
    for name in methods_of(rows):
        if name == "start":
            continue
        flip = float(np.mean([row["methods"][name]["flip"] for row in rows]))
        passes = float(np.median([cost(row, name, losses) for row in rows]))
        dots.append((name, max(passes, 1.0), max(flip, 1e-5)))
    figure, (axes,) = new_figure(7.0, 4.5)
    log_axis("x", axes, min(passes for _, passes, _ in dots) / 1.6, max(passes for _, passes, _ in dots))  # for names
    log_axis("y", axes, min(flip for _, _, flip in dots), max(flip for _, _, flip in dots))
    for group, colour in zip(_GROUPS, COLOURS, strict=True):
        mine = [(passes, flip) for name, passes, flip in dots if _group(name) == group]
        axes.plot([passes for passes, _ in mine], [flip for _, flip in mine], "o", color=colour, label=group)
    named: list[tuple[float, float]] = []
    for name, passes, flip in sorted(dots, key=lambda dot: dot[2]):
        beaten = any(p <= passes and f <= flip and (p, f) != (passes, flip) for _, p, f in dots)
        at = axes.transData.transform((passes, flip))
        free = all(abs(at[0] - x) > 90 or abs(at[1] - y) > 14 for x, y in named)  # dots of the screen
        if (name in _NAMED or not beaten) and free:
            named.append((at[0], at[1]))
            colour = COLOURS[_GROUPS.index(_group(name))]
            text = {"textcoords": "offset points", "ha": "right", "va": "center", "color": colour, "fontsize": 8}
            axes.annotate(name, (passes, flip), (-6, 0), **text)
    axes.set(xlabel="passes, the time of the losses included (median)", ylabel="mean FLIP over the object")
    legend_above(axes)
    return figure


def _group(name: str) -> str:
    stages = name.split(" > ")
    if stages[0] in ("fast", "balanced"):
        return "recorded"
    if len(stages) > 2:
        return "three losses"
    if stages[-1].endswith("-ldr"):
        return "ldr"
    if len(stages) == 1 and stages[0] not in ("flip", "cvvdp"):
        return "one squared"
    return stages[-1]


def write_between_markers(path: Path, text: str) -> None:
    """Replace what stands between the markers in a Markdown file."""
    before, rest = path.read_text("utf-8").split(BEGIN)
    after = rest.split(END)[1]
    path.write_text(f"{before}{BEGIN}\n{text}\n{END}{after}", "utf-8")
