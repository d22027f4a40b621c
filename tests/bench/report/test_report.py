# SPDX-License-Identifier: Apache-2.0
"""Tables and plots of rows whose figures are known."""

from __future__ import annotations

import base64
import math
import re
import sys
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from mfo_backend.bench.report.figure import svg
from mfo_backend.bench.report.gallery import best_median_worst, gallery
from mfo_backend.bench.report.plots import pareto, time_to_quality
from mfo_backend.bench.report.report import write_report
from mfo_backend.bench.rows.row import Task
from mfo_backend.bench.rows.row_file import RowFile
from mfo_backend.bench.rows.row_pictures import picture_file
from mfo_backend.bench.rows.summary import comparable, quantile, summaries
from mfo_backend.types.errors import SetupError

from ..made_up_rows import row

FLIPS = [0.001, 0.019, 0.04, None]  # two solved, one close, one raised
ROWS = [
    row(
        Task("base", scene, "fast"),
        flip=flip,
        seconds=None if flip is None else scene + 1.0,
        relative_rmse=flip,
        reference_flip=flip and 0.0209,
        error="" if flip else "ValueError: no <light>",
    )
    for scene, flip in enumerate(FLIPS)
]
OTHERS = [row(Task("base", scene, "mfo-hdr"), flip=0.03, seconds=50.0) for scene in range(4)]


def test_a_run_that_raised_stays_in_every_share():
    (summary,) = summaries(ROWS)
    assert (summary.runs, summary.raised, summary.solved, summary.close, summary.at_noise) == (4, 1, 2, 3, 3)
    assert summary.seconds == pytest.approx((2.0, 2.8))  # of 1, 2, 3
    assert summary.seconds_per_solved == 3.0  # (1 + 2 + 3) / 2
    assert summary.flip == pytest.approx((0.0145, 0.0295, math.inf))  # of 0.001, 0.019, 0.04 and infinity


def test_processor_seconds_count_where_every_row_has_them(tmp_path):
    timed = [replace(r, processor_seconds=None if r.seconds is None else 10 * r.seconds) for r in ROWS]
    (summary,) = summaries(timed)
    assert summary.seconds == pytest.approx((2.0, 2.8))
    assert (summary.processor_seconds, summary.seconds_per_solved) == (20.0, 30.0)
    assert time_to_quality(timed, 0.02).axes[0].get_xlabel() == "processor seconds of the fit"
    ours, theirs = summaries([*timed, *OTHERS])  # of which the others have none
    assert (ours.seconds_per_solved, theirs.processor_seconds) == (3.0, pytest.approx(math.nan, nan_ok=True))
    assert pareto([*timed, *OTHERS]).axes[0].get_xlabel() == "seconds of the fit"


def test_nothing_solved_costs_infinitely_much():
    (summary,) = summaries(OTHERS)
    assert summary.seconds_per_solved == math.inf


@pytest.mark.parametrize("share", [0.0, 0.1, 0.25, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("count", [1, 2, 5, 8])
def test_quantiles_are_numpys(share, count):
    values = np.random.default_rng(count).normal(size=count)
    assert quantile(list(values), share) == pytest.approx(np.quantile(values, share))


def test_scenes_that_a_method_lacks_are_left_out_and_counted():
    chosen = comparable([*ROWS, *OTHERS[:2]])
    assert chosen.left_out == 2
    assert [(r.scene, r.method) for r in chosen.rows] == [(0, "fast"), (0, "mfo-hdr"), (1, "fast"), (1, "mfo-hdr")]


def test_time_to_quality_ends_at_the_share_that_reached_it():
    figure = time_to_quality([*ROWS, *OTHERS], 0.02)
    ours = figure.axes[0].lines[0]
    assert ours.get_label() == "fast"
    assert ours.get_ydata()[0] == 0.0
    assert ours.get_ydata()[-1] == 0.5  # two of four
    assert (np.diff(ours.get_xdata()) >= 0.0).all()
    assert time_to_quality([row(Task("base", 0, "fast"), seconds=None)], 0.02) is None


def test_a_method_that_mostly_raised_has_no_dot():
    raised = [row(Task("base", scene, "fast"), flip=None, seconds=1.0 if scene else None) for scene in range(4)]
    (axes,) = pareto([*raised, *OTHERS]).axes
    assert [line.get_label() for line in axes.lines] == ["mfo-hdr"]
    assert pareto(raised) is None


def test_a_figure_is_the_same_file_every_time_and_its_text_is_text():
    first, again = (svg(time_to_quality(ROWS, 0.02)) for _ in range(2))
    assert first == again
    assert "fast" in "".join(ElementTree.fromstring(first).itertext())


def test_without_matplotlib_one_sentence_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(SetupError, match="need matplotlib"):
        time_to_quality(ROWS, 0.02)


def test_the_report_says_what_raised_and_loads_nothing(tmp_path):
    for one in [*ROWS, *OTHERS]:
        RowFile(tmp_path).append(one)
    text = write_report(tmp_path, notes=["The machine was shared & busy."])
    assert "| fast | 4 | 1 | 2 (50%) | 3 (75%) | 3 (75%) | 2 | 2.8 | – | 3 | 30 | 0.0145 | 0.0295 | – |" in text
    assert "| mfo-hdr | 4 | 0 | 0 (0%) | 4 (100%) | 4 (100%) | 50 | 50 | – | – |" in text
    assert "| base | fast | 1 | ValueError: no <light> |" in text
    assert "busy" in write_report(tmp_path)  # kept
    assert (tmp_path / "report.md").read_text("utf-8") == text
    page = (tmp_path / "report.html").read_text("utf-8")
    assert "busy" in page
    assert "no &lt;light&gt;" in page
    assert not re.search(r"<script|src=|href=\"(?!#)|url\((?!#)", page)
    for name in re.findall(r"\]\((.*?)\)", text):
        ElementTree.parse(tmp_path / name)
    assert (tmp_path / "summary.csv").read_text().startswith("scenario,method,runs")


def test_pictures_are_of_the_best_median_and_worst_scene(tmp_path):
    rows = [row(Task("base", scene, "balanced"), flip=flip) for scene, flip in enumerate((0.3, 0.1, None, 0.2, 0.4))]
    assert [(name, r.scene) for name, r in best_median_worst(rows)] == [("best", 1), ("median", 3), ("worst", 4)]
    raised = row(Task("base", 5, "balanced"), flip=None, error="no")
    assert best_median_worst([raised]) == []
    for one in rows:
        for method in ("reference", "truth", "balanced"):
            path = picture_file(tmp_path, Task("base", one.scene, method))
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(f"{one.scene} {method}".encode())
    page = gallery(tmp_path, rows, ["balanced", "mfo-hdr"])
    pictures = [base64.b64decode(text).decode() for text in re.findall(r"base64,(.*?)\"", page)]
    assert pictures == [f"{s} {m}" for s in (1, 3, 4) for m in ("reference", "truth", "balanced")]


def test_seconds_of_a_busy_machine_are_marked(tmp_path):
    for scene, share in enumerate((0.5, 0.3, 0.0)):
        RowFile(tmp_path).append(row(Task("base", scene, "fast"), others_busy=share))
    assert "While 2 of 3 rows were measured" in write_report(tmp_path)
