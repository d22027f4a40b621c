# SPDX-License-Identifier: Apache-2.0
"""The report: everything a reader needs is in it, nothing has to be loaded, no text can break out of its place."""

from __future__ import annotations

import base64
import dataclasses
import io
import re
from html.parser import HTMLParser

import numpy as np
import pytest
from PIL import Image as Pillow

from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.report.html_report import ReportContent, report_html
from mfo_backend.report.picture import displayed, displayed_linear, png_bytes
from mfo_backend.report.value_table import swatch_colour, value_text
from mfo_backend.types.image import Encoding, Image
from mfo_backend.types.model_gap import ModelGap
from mfo_backend.types.parameter import socket_name
from mfo_backend.types.result import CurvePoint, FitResult, StageReport
from mfo_backend.types.status import Status
from mfo_backend.types.verdict import Cause, Difference, Judgement, Verdict

VOID = {"meta", "img", "br", "hr", "link", "input"}


class WellFormed(HTMLParser):
    """Collects tags and text, and insists on every element being closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.text = ""

    def handle_starttag(self, tag, attrs):
        self.attributes += [(tag, key, value or "") for key, value in attrs]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.attributes += [(tag, key, value or "") for key, value in attrs]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] != "style":
            self.text += data + " "


def curve(first: float, ratio: float, begin: float) -> tuple[CurvePoint, ...]:
    return tuple(CurvePoint(i, first * ratio**i * 1.1, first * ratio**i, begin + i, 3.0 * i) for i in range(11))


@pytest.fixture
def result() -> FitResult:
    stages = (
        StageReport("mse-hdr", Status.STALE, 0.1, 0.001, 11, 10.0, {}, curve(0.1, 0.631, 0.0)),
        StageReport("flip-hdr", Status.CONVERGED, 0.2, 0.02, 11, 10.0, {}, curve(0.2, 0.794, 11.0)),
    )
    return FitResult(
        status=Status.CONVERGED,
        message="The fit converged.",
        model="mitsuba_principled",
        initial={"base_color": (0.8, 0.8, 0.8), "roughness": 0.5},
        recovered={"base_color": (0.25, 0.5, 1.0), "roughness": 0.31234567},
        bounds={"base_color": (0.001, 0.999), "roughness": (0.04, 1.0)},
        stages=stages,
        errors={"flip": (0.24, 0.012), "hdr_flip": (0.3, 0.05), "mse": (0.1, 0.0004)},
        seconds=21.04,
        passes=66.0,
        model_gap=ModelGap(0.0214, 0.0296),
    )


@pytest.fixture
def content(result: FitResult) -> ReportContent:
    picture = png_bytes(np.full((4, 6, 3), 0.5, np.float32))
    return ReportContent(
        title="Glaze on Vase",
        result=result,
        pictures=dict.fromkeys(("reference", "start", "result", "difference"), picture),
        subtitle="reference.exr",
        notes=["Light 'Sun': specular factor is ignored."],
        versions={"mitsuba": "3.9.1", "variant": "llvm_ad_rgb"},
    )


def parsed(content: ReportContent) -> WellFormed:
    page = WellFormed()
    page.feed(report_html(content))
    page.close()
    assert page.open == []
    return page


@pytest.mark.parametrize(
    "words",
    [
        "Glaze on Vase",
        "model gap, at most 3 %",
        "The fit converged.",
        "0.240 → 0.012",
        "0.300 → 0.050",
        "21.0 s",
        "22 iterations",
        "Base Color",
        "0.8 0.8 0.8",
        "0.25 0.5 1",
        "0.3123",
        "0.04 to 1",
        "mse-hdr",
        "The best loss did not improve for ten iterations.",
        "20.0 times smaller",
        "Light 'Sun': specular factor is ignored.",
        "mitsuba 3.9.1, variant llvm_ad_rgb",
    ],
)
def test_the_report_says(content: ReportContent, words: str) -> None:
    assert words in parsed(content).text


def test_the_pictures_are_in_the_file(content: ReportContent) -> None:
    sources = [value for tag, key, value in parsed(content).attributes if (tag, key) == ("img", "src")]
    assert len(sources) == 6  # reference and result once more, over each other
    for source in sources:
        picture = Pillow.open(io.BytesIO(base64.b64decode(source.removeprefix("data:image/png;base64,"))))
        assert picture.size == (6, 4)
        assert picture.getpixel((0, 0)) == (128, 128, 128)


def test_large_pictures_are_in_the_file_once(content: ReportContent, monkeypatch: pytest.MonkeyPatch) -> None:
    assert 'class="split"' in report_html(content)
    monkeypatch.setattr("mfo_backend.report.html_report._SPLIT_BYTES", 10)
    assert 'class="split"' not in report_html(content)
    assert len([value for tag, key, value in parsed(content).attributes if (tag, key) == ("img", "src")]) == 4


def test_values_have_the_names_of_blenders_sockets() -> None:
    names = ("base_color", "specular_ior_level", "ior")
    assert [socket_name(name) for name in names] == ["Base Color", "Specular IOR Level", "IOR"]


def test_verdict_and_values_are_there_as_text(content: ReportContent) -> None:
    text = re.search(r"<pre>(.*?)</pre>", report_html(content), re.DOTALL)
    assert text is not None
    lines = text[1].splitlines()
    assert lines[0] == content.result.message
    assert len(lines) == 1 + len(content.result.recovered)
    colour = next(line for line in lines if line.startswith("Base Color: "))
    assert re.match(r"Base Color: #[0-9a-f]{6}\b", colour)


def test_paper_is_light_whatever_the_screen_is(content: ReportContent) -> None:
    page = report_html(content)
    assert "@media screen and (prefers-color-scheme: dark)" in page
    assert "@media (prefers-color-scheme: dark)" not in page


def test_nothing_is_loaded_from_elsewhere(content: ReportContent) -> None:
    page = parsed(content)
    assert not re.search(r"https?:|//[a-z]|@import|url\(", report_html(content))
    assert {value[:5] for _, key, value in page.attributes if key in ("src", "href")} == {"data:"}
    assert ("meta", "content", "default-src 'none'; img-src data:; style-src 'unsafe-inline'") in page.attributes
    assert "script" not in {tag for tag, _, _ in page.attributes}


def test_text_cannot_break_out(content: ReportContent, result: FitResult) -> None:
    evil = "<script>alert('x')</script>\"&"
    wicked = dataclasses.replace(
        content,
        title=evil,
        subtitle=evil,
        notes=[evil],
        versions={evil: evil},
        result=dataclasses.replace(
            result,
            message=evil,
            recovered={evil: 0.5},
            errors={evil: (1.0, 0.5)},
            stages=(dataclasses.replace(result.stages[0], name=evil),),
        ),
    )
    assert "<script" not in report_html(wicked)
    # head and heading, subtitle, sentence, value, both as text, plot, stage, error, note, and twice a version
    assert parsed(wicked).text.lower().count("alert('x')") == 13


def test_a_cancelled_fit_without_stages_has_a_report(content: ReportContent, result: FitResult) -> None:
    empty = dataclasses.replace(
        result, status=Status.CANCELLED, message="Cancelled.", stages=(), errors={}, recovered={}
    )
    page = parsed(dataclasses.replace(content, result=empty, notes=()))
    assert "Cancelled." in page.text
    for section in ("Values", "Loss over time", "Stages", "Image differences", "Notes"):
        assert section not in page.text


def test_both_colour_schemes_are_served(content: ReportContent) -> None:
    text = report_html(content)
    assert "prefers-color-scheme: dark" in text
    assert "color-scheme: light dark" in text


@pytest.mark.parametrize(
    ("value", "colour"),
    # sRGB of linear 0.214 is 0.5 (IEC 61966-2-1); above white clips
    [((0.0, 0.214, 1.0), "#007fff"), ((2.0, -1.0, 0.0), "#ff0000")],
)
def test_swatches_show_display_colours(value: tuple[float, ...], colour: str) -> None:
    assert swatch_colour(value) == colour


def test_values_have_four_digits() -> None:
    assert value_text((0.123456, 1.0, 1e-5)) == "0.1235 1 1e-05"


def test_a_display_reference_stays_as_given() -> None:
    pixels = np.random.default_rng(3).uniform(size=(4, 5, 3)).astype(np.float32)
    shown = displayed(Image(pixels, Encoding.SRGB), DisplayView(exposure_ev=3.0, gamma=2.0))
    np.testing.assert_array_equal(shown, pixels)


def test_linear_pixels_go_through_the_view() -> None:
    pixels = np.array([[[0.25, 0.107, np.nan], [np.inf, -1.0, 0.5]]], np.float32)
    shown = displayed_linear(pixels, DisplayView(exposure_ev=1.0))
    # twice 0.25 is 0.5, whose sRGB value is 0.7354; twice 0.107 is 0.214, whose value is 0.5 (IEC 61966-2-1)
    np.testing.assert_allclose(shown, [[[0.7354, 0.5, 0.0], [1.0, 0.0, 1.0]]], atol=1e-3)


@pytest.mark.parametrize(
    ("verdict", "tone"), [(Verdict.SAME, "good"), (Verdict.CLOSE, "warn"), (Verdict.DIFFERENT, "bad")]
)
def test_the_verdict_is_at_the_top_and_only_the_same_has_a_tick(
    content: ReportContent, verdict: Verdict, tone: str
) -> None:
    cause = None if verdict is Verdict.SAME else Cause.LIGHT
    judgement = Judgement(verdict, cause, Difference(0.1, 0.05, 0.02, 0.01, 0.02))
    page = report_html(
        dataclasses.replace(
            content, result=dataclasses.replace(content.result, judgement=judgement, message=judgement.sentence)
        )
    )
    tick = "✓ " if verdict is Verdict.SAME else ""
    assert f'<p class="status {tone}">{tick}{judgement.sentence}</p>' in page
    assert page.index(judgement.sentence) < page.index("<h2>")


def test_a_result_without_a_verdict_has_no_tick(content: ReportContent) -> None:
    assert "✓" not in report_html(content)
