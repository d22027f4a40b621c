# SPDX-License-Identifier: Apache-2.0
"""The report of a fit: one HTML file with everything in it, for light and dark, without any address to load from."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from pathlib import Path

from ..types.result import FitResult
from ..types.status import Status
from ..types.verdict import Verdict
from .loss_plot import loss_plot
from .value_table import as_text, value_rows

_CAPTIONS = {
    "reference": ("Reference", "the picture to match"),
    "start": ("Start", "before the fit"),
    "result": ("Result", "with the recovered values"),
    "difference": ("Difference", "FLIP of reference and result"),
}
_ERROR_NAMES = {"flip": "FLIP", "hdr_flip": "HDR-FLIP", "mse": "MSE"}
_SPLIT_BYTES = 2_000_000  # of two pictures that are in the file a second time
_TONES = {Status.FAILED: "bad", Status.CANCELLED: "warn"}
_VERDICT_TONES = {Verdict.SAME: "good", Verdict.CLOSE: "warn", Verdict.DIFFERENT: "bad"}


@dataclass(frozen=True)
class ReportContent:
    """What a report shows; `pictures` are PNG files by the names reference, start, result and difference.

    Of a fit of several pictures `more_pictures` has those of each, by what it is called. Of a fit of several
    `materials` there are the folder below this report and the result of each, by what it is called.
    """

    title: str
    result: FitResult
    pictures: Mapping[str, bytes]
    subtitle: str = ""
    more_pictures: Mapping[str, Mapping[str, bytes]] = field(default_factory=dict)
    notes: Sequence[str] = ()
    versions: Mapping[str, str] = field(default_factory=dict)
    materials: Mapping[str, tuple[str, FitResult]] = field(default_factory=dict)


def report_html(content: ReportContent) -> str:
    """The report as the text of one self-contained HTML file."""
    style = Path(__file__).with_name("report.css").read_text("utf-8")
    result = content.result
    sections = [
        _section("Pictures", _all_pictures(content)),
        _section("Materials", _materials(content.materials)),
        _section("Values", _value_table(result)),
        _section("Loss over time", _plot(result)),
        _section("Stages", _stage_table(result)),
        _section("Image differences", _error_table(result)),
        _section("Notes", "<ul>" + "".join(f"<li>{escape(note)}</li>" for note in content.notes) + "</ul>")
        if content.notes
        else "",
    ]
    versions = ", ".join(f"{escape(name)} {escape(value)}" for name, value in content.versions.items())
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<title>{escape(content.title)}</title>
<style>{style}</style>
</head>
<body>
<main>
<h1>{escape(content.title)}</h1>
<p class="soft">{escape(content.subtitle)}</p>
{_headline(result)}
{_figures(result)}
{"".join(sections)}
<footer>{versions}</footer>
</main>
</body>
</html>
"""


def _headline(result: FitResult) -> str:
    """The verdict; how the fit ended where there is none. A tick only where the result looks the same."""
    verdict = result.judgement.verdict if result.judgement is not None else None
    tone = _VERDICT_TONES[verdict] if verdict is not None else _TONES.get(result.status, "warn")
    tick = "✓ " if verdict is Verdict.SAME else ""
    return f'<p class="status {tone}">{tick}{escape(result.message)}</p>'


def _section(title: str, body: str) -> str:
    return f"<section><h2>{escape(title)}</h2>{body}</section>\n" if body else ""


def _figures(result: FitResult) -> str:
    """The few numbers one looks for first."""
    figures = []
    for name in ("flip", "hdr_flip"):
        if name in result.errors:
            before, after = result.errors[name]
            figures.append((f"{before:.3f} → {after:.3f}", f"mean {_ERROR_NAMES[name]}"))
    if result.model_gap is not None:
        gap = result.model_gap
        figures.append((f"{100 * gap.relative:.2g} %", f"model gap, at most {100 * gap.at_most:.2g} %"))
    iterations = sum(stage.iterations for stage in result.stages)
    figures.append((f"{result.seconds:.1f} s", f"{iterations} iterations"))
    figures.append((f"{result.passes:.0f}", "passes of one full render"))
    inner = "".join(f'<div><b>{escape(value)}</b><span class="soft">{label}</span></div>' for value, label in figures)
    return f'<div class="figures">{inner}</div>'


def _all_pictures(content: ReportContent) -> str:
    """The pictures of a fit; of several with what is said of each."""
    if not content.more_pictures:
        return f'<div class="pictures">{_pictures(content.pictures)}</div>'
    parts = []
    for (label, files), found in zip(content.more_pictures.items(), content.result.pictures, strict=True):
        judgement = found.judgement
        said = "" if judgement is None else escape(judgement.sentence)
        flip = "mean FLIP {:.3f} → {:.3f}".format(*found.errors["flip"])
        parts.append(
            f'<h3>{escape(label)}</h3><p class="soft">{said} {flip}</p><div class="pictures">{_pictures(files)}</div>'
        )
    return "".join(parts)


def _materials(materials: Mapping[str, tuple[str, FitResult]]) -> str:
    """Verdict, error and values of each of several materials, with the way to its own report."""
    return "".join(
        f'<h3>{escape(label)}</h3>{_headline(result)}<p class="soft">mean FLIP {result.errors["flip"][0]:.3f} → '
        f'{result.errors["flip"][1]:.3f}. <a href="{escape(folder)}/index.html">Pictures, course and notes</a></p>'
        f"{_value_table(result)}"
        for label, (folder, result) in materials.items()
    )


def _pictures(pictures: Mapping[str, bytes]) -> str:
    shown = [_split(pictures)]
    for name, (title, words) in _CAPTIONS.items():
        if name in pictures:
            data = base64.b64encode(pictures[name]).decode("ascii")
            scale = '<span class="scale">0 <i></i> 1</span>' if name == "difference" else ""
            shown.append(
                f'<figure><img src="data:image/png;base64,{data}" alt="{title}: {words}">'
                f"<figcaption><b>{title}</b>, {words}{scale}</figcaption></figure>"
            )
    return "".join(shown)


def _split(pictures: Mapping[str, bytes]) -> str:
    """Reference and result over each other with an edge to drag, by CSS alone; not of files that would grow large."""
    pair = [pictures[name] for name in ("reference", "result") if name in pictures]
    if len(pair) < 2 or sum(map(len, pair)) > _SPLIT_BYTES:
        return ""
    below, above = (
        f'<img src="data:image/png;base64,{base64.b64encode(data).decode("ascii")}" alt="{title}">'
        for data, title in ((pair[1], "Result"), (pair[0], "Reference"))
    )
    words = "<b>Reference</b> left, <b>Result</b> right: drag the corner of the line"
    return (
        f'<figure class="split"><div class="pair">{below}<div class="over">{above}</div></div>'
        f"<figcaption>{words}</figcaption></figure>"
    )


def _value_table(result: FitResult) -> str:
    sure = ["How sure"] if result.certainty else []
    heads = [result.shader or "Parameter", "Recovered", *sure, "Initial", "Bounds", "○ initial ● recovered"]
    table = _table(heads, value_rows(result))
    lines = f"<details><summary>As text, to copy</summary><pre>{escape(as_text(result))}</pre></details>"
    weak = "".join(f"<li>{escape(weak.sentence)}</li>" for weak in result.weak_combinations)
    weak = f"<ul>{weak}</ul>" if weak else ""
    colours = '<p class="soft">Colours: the hex code on a display, then linear Rec.709.</p>'
    return f"{table}{colours}{weak}{lines}" if table else ""


def _plot(result: FitResult) -> str:
    plot = loss_plot(result.stages)
    legend = "Thick: best so far; thin: every iteration. A dashed line marks the switch of the loss."
    return f'<div class="plot">{plot}</div><p class="soft">{legend}</p>' if plot else ""


def _stage_table(result: FitResult) -> str:
    rows = "".join(
        f'<tr><th scope="row">{escape(stage.name)}</th><td>{stage.loss_start:.4g}</td><td>{stage.loss_best:.4g}</td>'
        f"<td>{stage.iterations}</td><td>{stage.seconds:.1f} s</td>"
        f'<td class="sentence">{escape(stage.status.sentence)}</td></tr>'
        for stage in result.stages
    )
    return _table(("Stage", "Loss at start", "Best loss", "Iterations", "Time", "Ended"), rows)


def _error_table(result: FitResult) -> str:
    rows = "".join(
        f'<tr><th scope="row">{escape(_ERROR_NAMES.get(name, name))}</th><td>{before:.4g}</td><td>{after:.4g}</td>'
        f"<td>{f'{before / after:.1f} times smaller' if 0 < after < before else ''}</td></tr>"
        for name, (before, after) in result.errors.items()
    )
    return _table(("Measure", "Start", "Result", ""), rows)


def _table(heads: Sequence[str], rows: str) -> str:
    head = "".join(f"<th>{escape(name)}</th>" for name in heads)
    body = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
    return f'<div class="scroll">{body}</div>' if rows else ""
