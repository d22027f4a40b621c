# SPDX-License-Identifier: Apache-2.0
"""The report of a bench folder: Markdown, CSV, plots and one HTML page, all from its rows and pictures."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

from ...job.folder.atomic_file import write_atomically
from ..rows.blender_row import read_blender_rows
from ..rows.method import METHODS
from ..rows.row import Row
from ..rows.row_file import RowFile
from ..rows.summary import SOLVED_FLIP, TARGETS, Summary, comparable, quantile, summaries
from .blender_section import blender_table
from .figure import svg
from .findings import ablations, against_the_loop, calibration, promises, stage_gains, time_parts
from .gallery import gallery
from .hard_section import hard_section
from .paper_tables import paper_tables
from .plots import data_profile, pareto, time_to_quality
from .table import Table, number

_HEADS = (
    "method", "runs", "raised", f"FLIP ≤ {SOLVED_FLIP:g}", "FLIP ≤ 0.05", "≤ 0.02 above the noise",
    "median s", "p90 s", "median CPU s", "s per solved",
    "median passes", "FLIP 25 %", "median", "75 %", "rel. RMSE", "relit FLIP", "relit rel. RMSE", "JOD mean", "min",
)  # fmt: skip
_READING = (
    "Seconds and passes are of the fit with its own final check; loading, kernel compilation and the judge's pictures "
    "are not counted. Errors are means over the object between pictures of the recovered and the true values under "
    "the same new random numbers; relit: under lights no fit saw. Runs that raised stay in every share and count as "
    "infinite error (–). Above the noise: the FLIP between reference and result less that between reference and "
    "true picture. CPU s: on all processors together. Seconds per solved scene: the time of all runs, processor "
    f"seconds where every row has them, over the number with FLIP ≤ {SOLVED_FLIP:g}.",
    "JOD is ColorVideoVDP's score of the whole picture, 10 for no difference. The paper's is HDR-VDP-3's Q_JOD, "
    "another metric on another scale, on an NVIDIA RTX 3070, and the paper does not say how it chose Adam's rate and "
    "limits: its columns stand beside ours for orientation, not as a race. Its mean times leave out failed scenes.",
)
_SHOWN = ("balanced", "best", "mfo-hdr")  # in pictures
BUSY = 0.1  # share of the processors that others may use before seconds stop being comparable


@dataclass
class Section:
    """A heading with what stands under it."""

    title: str
    text: list[str] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    plots: dict[str, str] = field(default_factory=dict)
    pictures: str = ""

    def markdown(self) -> list[str]:
        """Lines of Markdown; the pictures are the page's alone."""
        lines = [f"## {self.title}", ""]
        for paragraph in self.text:
            lines += [paragraph, ""]
        for table in self.tables:
            lines += [*table.markdown(), ""]
        return [*lines, *(f"![{name.removesuffix('.svg')}]({name})" for name in self.plots), ""]

    def html(self) -> str:
        """A section element."""
        text = "".join(f"<p>{escape(paragraph)}</p>" for paragraph in self.text)
        tables = "".join(table.html() for table in self.tables)
        figures = "".join(f"<figure>{plot}</figure>" for plot in self.plots.values())
        plots = f'<div class="pictures plots">{figures}</div>' if figures else ""
        return f"<section><h2>{escape(self.title)}</h2>{text}{tables}{plots}{self.pictures}</section>"


def write_report(folder: Path, *, notes: Sequence[str] = ()) -> str:
    """Write report.md, report.html, CSV files and plots into `folder`; returns the text of report.md.

    Parameters
    ----------
    notes
        Remarks that belong to the figures, such as a busy machine; they are kept for the next report.
    """
    rows = RowFile(folder).read()
    said = [*_kept_notes(folder, notes), *_busy(rows)]
    sections = [_scenario(folder, rows, name) for name in dict.fromkeys(row.scenario for row in comparable_order(rows))]
    sections += [Section(title, tables=[table]) for title, table in paper_tables(rows)]
    for title, table in (
        ("The paper's loop against `balanced`", against_the_loop(rows)),
        ("How far certainties can be trusted", promises(rows)),
        ("What each stage gains", stage_gains(rows)),
        ("Ablations", ablations(rows)),
        ("Hard cases", hard_section(folder)),
        ("From .blend files, judged by Cycles", blender_table(read_blender_rows(folder))),
        ("How well the predicted standard deviations hold", calibration(rows)),
        ("Where the time goes: median seconds", time_parts(rows)),
        ("What raised", _raised(rows)),
    ):
        if table is not None:
            sections.append(Section(title, tables=[table]))
    sections.append(Section("How to read this", [*_READING, *said]))
    for section in sections:
        for name, plot in section.plots.items():
            write_atomically(folder / name, plot.encode("utf-8"))
    summary = Table(("scenario", *_HEADS), [(s.scenario, *_cells(s)) for s in summaries(rows)])
    write_atomically(folder / "summary.csv", summary.csv().encode("utf-8"))
    head = _head(rows)
    lines = ["# Speed against error", "", head, ""]
    markdown = "\n".join([*lines, *(line for section in sections for line in section.markdown())])
    write_atomically(folder / "report.md", markdown.encode("utf-8"))
    write_atomically(folder / "report.html", _page(head, sections).encode("utf-8"))
    return markdown


def comparable_order(rows: Sequence[Row]) -> list[Row]:
    """The rows in the order of the tables."""
    order = {(s.scenario, s.method): place for place, s in enumerate(summaries(rows))}
    return sorted(rows, key=lambda row: (order[row.scenario, row.method], row.scene))


def _scenario(folder: Path, rows: Sequence[Row], name: str) -> Section:
    mine = [row for row in comparable_order(rows) if row.scenario == name]
    standing = [row for row in mine if not (row.method in METHODS and METHODS[row.method].compares_with)] or mine
    section = Section(name, [_floor(mine)], [_table(summaries(mine))])
    chosen = comparable(standing)
    if chosen.left_out and chosen.rows:
        count = len({row.scene for row in chosen.rows})
        section.text.append(
            f"The methods do not have the same scenes. The second table holds the {count} that all have."
        )
        section.tables.append(_table(summaries(chosen.rows)))
    elif chosen.left_out:
        section.text.append("The methods do not have the same scenes, and none has been fitted by all.")
    plots = {f"pareto-{name}.svg": pareto(standing)}
    plots |= {f"ecdf-{name}-{target:g}.svg": time_to_quality(standing, target) for target in TARGETS}
    plots[f"passes-{name}-{SOLVED_FLIP:g}.svg"] = data_profile(standing, SOLVED_FLIP)
    section.plots = {file: svg(figure) for file, figure in plots.items() if figure is not None}
    shown = [m for m in dict.fromkeys(row.method for row in standing) if m in _SHOWN]
    section.pictures = gallery(folder / "pictures", mine, shown)
    return section


def _kept_notes(folder: Path, notes: Sequence[str]) -> list[str]:
    """The notes of this report and of those before."""
    path = folder / "notes.json"
    before = json.loads(path.read_text("utf-8")) if path.is_file() else []
    kept = list(dict.fromkeys([*before, *notes]))
    if kept != before:
        write_atomically(path, json.dumps(kept, indent=1, ensure_ascii=False).encode("utf-8"))
    return kept


def _busy(rows: Sequence[Row]) -> list[str]:
    shares = [row.others_busy for row in rows if row.others_busy is not None]
    disturbed = sum(share > BUSY for share in shares)
    if not disturbed:
        return []
    return [
        f"While {disturbed} of {len(shares)} rows were measured, other programs used more than {BUSY:.0%} of the "
        f"processors (median {quantile(shares, 0.5):.0%}): seconds of the clock compare only roughly within this run "
        "and not with another. Processor seconds depend little on that, passes, errors and shares of scenes not at all."
    ]


def _head(rows: Sequence[Row]) -> str:
    """What the rows were measured with."""

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
    return (
        f"{'; '.join(filter(None, facts))}. "
        f"Warm-up before the first row of each scenario and method: {warm:.0f} s in all, not in the tables."
    )


def _floor(rows: Sequence[Row]) -> str:
    scenes = {row.scene: row for row in rows if row.floor_flip is not None}.values()
    floor = quantile([row.floor_flip for row in scenes if row.floor_flip is not None], 0.5)
    start = quantile([row.start_flip for row in scenes if row.start_flip is not None], 0.5)
    count = len({row.scene for row in rows})
    plural = "" if count == 1 else "s"
    noise = f"median FLIP of the reference's own noise {number(floor)}, of the start {number(start)}"
    gaps = [row.gap_flip for row in scenes if row.gap_flip is not None]
    gap = f"; of our own picture of the true values against Cycles' {number(quantile(gaps, 0.5))}" if gaps else ""
    return f"{count} scene{plural}; {noise}{gap}."


def _table(table: Sequence[Summary]) -> Table:
    return Table(_HEADS, [_cells(summary) for summary in table])


def _cells(summary: Summary) -> tuple[str, ...]:
    share = "{} ({:.0%})".format
    return (
        summary.method,
        str(summary.runs),
        str(summary.raised),
        share(summary.solved, summary.solved / summary.runs),
        share(summary.close, summary.close / summary.runs),
        share(summary.at_noise, summary.at_noise / summary.runs),
        *(number(s) for s in (*summary.seconds, summary.processor_seconds, summary.seconds_per_solved)),
        number(summary.passes),
        *(number(flip) for flip in summary.flip),
        number(summary.relative_rmse),
        number(summary.relit_flip),
        number(summary.relit_relative_rmse),
        *(number(jod) for jod in summary.jod),
    )


def _raised(rows: Sequence[Row]) -> Table | None:
    counts: dict[tuple[str, str, str], int] = {}
    for row in rows:
        if row.error:
            at = (row.scenario, row.method, row.error)
            counts[at] = counts.get(at, 0) + 1
    lines = [(scenario, method, str(count), error) for (scenario, method, error), count in counts.items()]
    return Table(("scenario", "method", "rows", "error"), lines) if lines else None


def _page(head: str, sections: Sequence[Section]) -> str:
    style = (Path(__file__).parents[2] / "report" / "report.css").read_text("utf-8")
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'; img-src data:">
<title>Speed against error</title>
<style>{style}
main {{ max-width: 1320px; }}
p + .scroll, .scroll + .scroll {{ margin-top: 14px; }}
.pictures {{ margin-top: 18px; grid-template-columns: repeat(auto-fit, minmax(300px, 1fr)); }}
.plots {{ grid-template-columns: repeat(auto-fit, minmax(380px, 1fr)); }}
.three {{ display: grid; grid-template-columns: repeat(3, 1fr); gap: 4px; }}
.three figcaption {{ grid-column: 1 / 4; }}</style>
</head>
<body>
<main>
<h1>Speed against error</h1>
<p class="soft">{escape(head)}</p>
<br>
{"".join(section.html() for section in sections)}
</main>
</body>
</html>
"""
