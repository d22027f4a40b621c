# SPDX-License-Identifier: Apache-2.0
"""The report of a bench folder: text, Markdown, plots and one HTML page, all from its rows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path

from ..job.atomic_file import write_atomically
from .plots import pareto, time_to_quality
from .row import Row
from .row_file import RowFile
from .summary import SOLVED_FLIP, TARGETS, Summary, comparable, quantile, summaries

_HEADS = (
    "method", "runs", "raised", f"solved (FLIP ≤ {SOLVED_FLIP:g})", "FLIP ≤ 0.05", "≤ 0.02 above the noise",
    "median s", "p90 s", "s per solved",
    "median passes", "FLIP 25 %", "median", "75 %", "rel. RMSE", "relit rel. RMSE",
)  # fmt: skip
_READING = (
    "Seconds and passes are of the fit with its own final check; loading, kernel compilation and the judge's pictures "
    "are not counted. Errors are means over the object between pictures of the recovered and the true values under "
    "the same new random numbers; relit: under a light no fit saw. Runs that raised stay in every share and count as "
    "infinite error (–). Above the noise: the FLIP between reference and result less that between reference and "
    "true picture. Seconds per solved scene: the time of all runs over the number solved."
)


def write_report(folder: Path, *, notes: Sequence[str] = ()) -> str:
    """Write report.md, report.html and the plots into `folder`; returns the text of report.md.

    Parameters
    ----------
    notes
        Remarks that belong to the figures, such as a busy machine.
    """
    rows = RowFile(folder).read()
    chosen = comparable(rows)
    notes = [*notes]
    if chosen.left_out:
        notes.append(f"{chosen.left_out} rows of scenes that not every method has are left out.")
    text, page = [*_head(rows)], []
    for scenario in dict.fromkeys(row.scenario for row in chosen.rows):
        mine = [row for row in chosen.rows if row.scenario == scenario]
        table = summaries(mine)
        plots = {f"pareto-{scenario}.svg": pareto(mine)}
        plots |= {f"ecdf-{scenario}-{target:g}.svg": time_to_quality(mine, target) for target in TARGETS}
        plots = {name: svg for name, svg in plots.items() if svg}
        for name, svg in plots.items():
            write_atomically(folder / name, svg.encode("utf-8"))
        text += [f"## {scenario}", "", _floor(mine), "", *_markdown(table), ""]
        text += [f"![{name.removesuffix('.svg')}]({name})" for name in plots] + [""]
        figures = "".join(f"<figure>{svg}</figure>" for svg in plots.values())
        page.append(
            f"<section><h2>{escape(scenario)}</h2><p>{escape(_floor(mine))}</p>"
            f'<div class="scroll">{_html(table)}</div><div class="pictures">{figures}</div></section>'
        )
    failed = [row for row in rows if row.error]
    errors = [f"{count} x {row}" for row, count in _counted(f"{r.scenario}, {r.method}: {r.error}" for r in failed)]
    text += ["## What raised", "", *(f"- {line}" for line in errors), ""] if errors else []
    text += ["## How to read this", "", _READING, *(f"\n{note}" for note in notes), ""]
    markdown = "\n".join(text)
    write_atomically(folder / "report.md", markdown.encode("utf-8"))
    tail = [_list("What raised", errors), _list("How to read this", [_READING, *notes])]
    write_atomically(folder / "report.html", _page(_head(rows), [*page, *tail]).encode("utf-8"))
    return markdown


def _head(rows: Sequence[Row]) -> list[str]:
    """Title and what the rows were measured with."""

    def seen(values: Iterable[object]) -> str:
        return ", ".join(dict.fromkeys(str(value) for value in values if value not in (None, "")))

    machines = [row.machine for row in rows]
    versions = seen(f"{name} {value}" for m in machines for name, value in m.get("versions", {}).items())
    warm = sum(row.warm_up_seconds for row in rows)
    facts = [
        f"{len(rows)} rows at {seen(f'{row.size}x{row.size}' for row in rows)} pixels",
        f"commit {seen(m.get('commit') for m in machines) or 'unknown'}",
        seen(m.get("device") for m in machines),
        f"{seen(m.get('threads') for m in machines) or 'unknown'} threads",
        versions,
    ]
    return [
        "# Speed against error",
        "",
        f"{'; '.join(filter(None, facts))}. "
        f"Warm-up before the first row of each scenario and method: {warm:.0f} s in all, not in the tables.",
        "",
    ]


def _floor(rows: Sequence[Row]) -> str:
    scenes = {row.scene: row for row in rows if row.floor_flip is not None}.values()
    floor = quantile([row.floor_flip for row in scenes if row.floor_flip is not None], 0.5)
    start = quantile([row.start_flip for row in scenes if row.start_flip is not None], 0.5)
    count = len({row.scene for row in rows})
    plural = "" if count == 1 else "s"
    noise = f"median FLIP of the reference's own noise {_number(floor)}, of the start {_number(start)}"
    return f"{count} scene{plural}; {noise}."


def _cells(summary: Summary) -> tuple[str, ...]:
    share = "{} ({:.0%})".format
    return (
        summary.method,
        str(summary.runs),
        str(summary.raised),
        share(summary.solved, summary.solved / summary.runs),
        share(summary.close, summary.close / summary.runs),
        share(summary.at_noise, summary.at_noise / summary.runs),
        *(_number(seconds) for seconds in (*summary.seconds, summary.seconds_per_solved)),
        "–" if math.isnan(summary.passes) else f"{summary.passes:.0f}",
        *(_number(flip) for flip in summary.flip),
        _number(summary.relative_rmse),
        _number(summary.relit_relative_rmse),
    )


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "–"
    return f"{value:.3g}" if value < 1000 else f"{value:.0f}"


def _markdown(table: Sequence[Summary]) -> list[str]:
    lines = [_HEADS, ("---", *["--:"] * (len(_HEADS) - 1)), *(_cells(summary) for summary in table)]
    return [f"| {' | '.join(line)} |" for line in lines]


def _html(table: Sequence[Summary]) -> str:
    head = "".join(f"<th>{escape(name)}</th>" for name in _HEADS)
    rows = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in _cells(s)) + "</tr>" for s in table)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"


def _list(title: str, lines: Sequence[str]) -> str:
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<section><h2>{escape(title)}</h2><ul>{items}</ul></section>" if lines else ""


def _counted(lines: Iterable[str]) -> list[tuple[str, int]]:
    counts: dict[str, int] = {}
    for line in lines:
        counts[line] = counts.get(line, 0) + 1
    return list(counts.items())


def _page(head: Sequence[str], sections: Sequence[str]) -> str:
    style = (Path(__file__).parents[1] / "report" / "report.css").read_text("utf-8")
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">
<title>Speed against error</title>
<style>{style}
main {{ max-width: 1320px; }}
p + .scroll {{ margin-top: 14px; }}
.pictures {{ grid-template-columns: repeat(auto-fit, minmax(380px, 1fr)); margin-top: 18px; }}</style>
</head>
<body>
<main>
<h1>Speed against error</h1>
<p class="soft">{escape(head[2])}</p>
<br>
{"".join(sections)}
</main>
</body>
</html>
"""
