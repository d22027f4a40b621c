# SPDX-License-Identifier: Apache-2.0
"""The report of a fit as a German or French Blender opens it: nothing in it is English, and nothing else changed."""

from __future__ import annotations

import re
from html import unescape
from pathlib import Path

import pytest

from mfo_backend.report.html_report import ReportContent, report_html
from mfo_backend.types.certainty import Certainty, Level
from mfo_backend.types.model_gap import ModelGap
from mfo_backend.types.result import CurvePoint, FitResult, StageReport
from mfo_backend.types.status import Status

from .languages import ENGLISH

SENTENCE = "The result looks the same as the reference."
NOTE = "The picture does not determine IOR: kept as in the scene."
UNKNOWN = '<b> & "a sentence" that nobody has translated.'


@pytest.fixture
def page() -> str:
    curve = (CurvePoint(0, 0.1, 0.1, 0.0, 0.0), CurvePoint(1, 0.01, 0.01, 1.0, 3.0))
    result = FitResult(
        status=Status.CONVERGED,
        message=SENTENCE,
        model="blender_principled",
        initial={"base_color": (0.8, 0.8, 0.8), "roughness": 0.5},
        recovered={"base_color": (0.25, 0.5, 1.0), "roughness": 0.3},
        bounds={"base_color": (0.001, 0.999), "roughness": (0.04, 1.0)},
        stages=(StageReport("mse-hdr", Status.STALE, 0.1, 0.001, 11, 10.0, {}, curve),),
        errors={"flip": (0.24, 0.012), "mse": (0.1, 0.0004)},
        seconds=21.0,
        passes=66.0,
        model_gap=ModelGap(0.0214, 0.0296),
        certainty={"roughness": Certainty((0.01,), Level.DETERMINED)},
    )
    picture = b"picture"
    return report_html(
        ReportContent(
            title="Glaze · Vase",
            result=result,
            pictures=dict.fromkeys(("reference", "start", "result", "difference"), picture),
            subtitle="ref.exr, 96 × 64 pixels, scene-linear; model blender_principled, preset balanced, seed 0",
            notes=[NOTE, UNKNOWN],
            versions={"mitsuba": "3.9.1"},
        )
    )


def texts(page: str) -> list[str]:
    body = re.sub(r"<style>.*?</style>", "", page, flags=re.DOTALL)
    return [unescape(text).strip() for text in re.split(r"<[^>]*>", body) if text.strip()]


@pytest.mark.parametrize(("code", "same", "note", "bounds"), [
    ("de", "✓ Das Ergebnis sieht aus wie die Referenz.", "Das Bild bestimmt nicht: IOR. Belassen wie in der Szene.",
     "0.04 bis 1"),
    ("fr", "✓ Le résultat ressemble à la référence.", "L'image ne détermine pas : IOR. Laissé comme dans la scène.",
     "0.04 à 1"),
])  # fmt: skip
def test_no_text_of_a_report_is_left_in_english(
    addon: object, page: str, code: str, same: str, note: str, bounds: str
) -> None:
    from blender_addon.result.report_page import page_in_language

    page = page.replace(f'warn">{SENTENCE}', f'good">✓ {SENTENCE}')
    shown = texts(page_in_language(page, code))
    assert {same, note, bounds, UNKNOWN} <= set(shown)
    assert f"{same.removeprefix('✓ ')}" in "\n".join(shown)  # as text to copy
    assert [text for text in shown if ENGLISH.search(text) and text != UNKNOWN] == []
    left = {text for text in shown if text in set(texts(page)) and re.match("[A-Za-z].*[a-z]{3}", text)}
    # names; Blender's own languages have the sockets
    assert left <= {"Glaze · Vase", "Base Color", "Roughness", "mse-hdr", "mitsuba 3.9.1"}


def test_tags_pictures_and_style_stay(addon: object, page: str) -> None:
    from blender_addon.result.report_page import page_in_language

    german = page_in_language(page, "de")
    tags = [re.findall(r"<[^>]*>", each) for each in (page, german)]
    words = re.compile(r'(alt|aria-label)="[^"]*"|lang="\w+"')
    assert [words.sub("", tag) for tag in tags[0]] == [words.sub("", tag) for tag in tags[1]]
    assert '<html lang="de">' in german
    assert 'alt="Referenz: das Bild, das nachgebildet wird"' in german
    assert "&lt;b&gt; &amp;" in german


def test_the_copy_replaces_a_link_and_leads_to_copies(
    addon: object, page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from blender_addon.result import report_page

    job, other = tmp_path / "job", tmp_path / "other.txt"
    (job / "targets" / "1").mkdir(parents=True)
    other.write_text("mine")
    linked = page.replace("<footer>", '<a href="targets/1/index.html">Pictures, course and notes</a><footer>')
    (job / "index.html").write_text(linked, "utf-8")
    (job / "targets" / "1" / "index.html").write_text(page, "utf-8")
    (job / "index.de.html").symlink_to(other)
    assert report_page.shown_report(job / "index.html") == job / "index.html"  # this Blender is English
    monkeypatch.setattr(report_page, "report_language", lambda: "de")
    shown = report_page.shown_report(job / "index.html")
    assert shown == job / "index.de.html"
    assert other.read_text() == "mine"
    assert 'href="targets/1/index.de.html">Bilder, Verlauf und Hinweise</a>' in shown.read_text("utf-8")
    assert (job / "targets" / "1" / "index.de.html").is_file()
    assert sorted(path.name for path in job.iterdir()) == ["index.de.html", "index.html", "targets"]
