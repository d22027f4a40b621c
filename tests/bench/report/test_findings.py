# SPDX-License-Identifier: Apache-2.0
"""Tables beyond error and time, from rows whose figures are known."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from mfo_backend.bench.report.findings import (
    TOGETHER,
    ablations,
    against_the_loop,
    calibration,
    promises,
    stage_gains,
    time_parts,
)
from mfo_backend.bench.report.hard_section import hard_section
from mfo_backend.bench.report.paper_figures import PAPER_NAMES, paper_figure
from mfo_backend.bench.report.paper_tables import paper_tables
from mfo_backend.bench.report.table import Table, minutes, number
from mfo_backend.bench.rows.row import Task
from mfo_backend.types.errors import BadInputError

from ..made_up_rows import row

SD = {"roughness": {"sd": [0.01], "level": "determined"}, "base_color": {"sd": [0.1, 0.1, 0.1], "level": "weak"}}
TRUTH = {"roughness": 0.5, "base_color": [0.5, 0.5, 0.5]}


def fitted(scene, roughness, colour):
    found = {"roughness": roughness, "base_color": colour}
    return row(Task("noise", scene, "balanced"), certainty=SD, truth=TRUTH, recovered=found)


def test_coverage_counts_every_component():
    table = calibration([fitted(0, 0.505, [0.5, 0.65, 0.9]), fitted(1, 0.525, [0.45, 0.5, 0.5])])
    assert table is not None
    cells = {line[2]: line[3:7] for line in table.rows}
    assert cells["determined"] == ("2", "50%", "50%", "100%")  # errors of 0.5 and 2.5 sd
    assert cells["weak"] == ("6", "67%", "83%", "83%")  # 0, 1.5, 4, 0.5, 0, 0
    assert calibration([row(Task("noise", 0, "mfo-hdr"))]) is None


def test_promises_are_counted_by_value_and_intervals_by_component():
    table = promises([fitted(0, 0.525, [0.5, 0.65, 0.9]), fitted(1, 0.535, [0.45, 0.5, 0.5])])
    assert table is not None
    # roughness is off by 0.025 and 0.035 with 0.01: outside both intervals, wrong from 0.03 on; of the colour's six
    # components one is off by 4 deviations, all others by at most 1.5
    assert table.rows == [("noise", "balanced", "2", "2", "1", "8", "62%")]
    unseen = {"roughness": {"sd": [0.3], "level": "not_visible"}}
    hidden = row(Task("noise", 0, "balanced"), certainty=unseen, truth=TRUTH, recovered={"roughness": 0.5})
    assert promises([hidden]) is None
    assert promises([row(Task("noise", 0, "mfo-hdr"))]) is None


def test_the_loop_is_held_against_ours_on_common_scenes():
    ours = [row(Task("noise", n, "balanced"), flip=0.02, processor_seconds=2.0) for n in range(3)]
    loop = [
        row(Task("noise", 1, "mse-ldr"), flip=0.01, processor_seconds=40.0),
        row(Task("noise", 2, "mse-ldr"), flip=0.05, processor_seconds=20.0, reference_flip=0.03),
        row(Task("noise", 7, "mse-ldr"), flip=0.9, processor_seconds=1.0),
        row(Task("noise", 1, "mfo-hdr-kept"), flip=0.01, processor_seconds=1.0),
    ]
    table = against_the_loop([*ours, *loop])
    assert table is not None
    assert table.rows == [("noise", "mse-ldr", "2 of 2", "0.02", "1 of 2", "0.03", "1", "15", "–")]
    assert against_the_loop(loop) is None


def test_the_loops_time_is_held_against_the_stage_that_is_as_near():
    ends = (("scan", 0.04, 0.5), ("start", 0.03, 0.8), ("refine", 0.02, 1.6))
    stages = [{"name": name, "flip": flip, "processor_seconds": seconds} for name, flip, seconds in ends]
    ours = [row(Task("noise", n, "balanced"), flip=0.02, processor_seconds=2.0, stages=stages) for n in range(3)]
    flips = (0.035, 0.02, 0.01)  # nearer than any stage: it takes us forever
    loop = [row(Task("noise", n, "mfo-hdr"), flip=flip, processor_seconds=16.0) for n, flip in enumerate(flips)]
    for chosen, ratio in ((loop[:1], "20"), (loop[1:2], "10"), (loop[2:], "0"), (loop, "10")):
        table = against_the_loop([*ours, *chosen])
        assert table is not None
        assert table.rows[0][-1] == ratio


def test_every_scene_counts_once_where_scenarios_are_taken_together():
    tasks = [Task("noise", 0, ""), Task("noise", 1, ""), Task("base", 0, "")]
    ours = [row(replace(task, method="balanced"), flip=0.01, processor_seconds=1.0) for task in tasks]
    loop = [
        row(replace(task, method="mfo-hdr"), flip=flip, processor_seconds=seconds)
        for task, flip, seconds in zip(tasks, (0.04, 0.005, 0.06), (10.0, 20.0, 90.0), strict=True)
    ]
    table = against_the_loop([*ours, *loop])
    assert table is not None
    assert table.rows[-1] == (TOGETHER, "mfo-hdr", "3 of 3", "0.01", "3 of 3", "0.035", "1", "20", "–")
    assert {line[0] for line in table.rows[:-1]} == {"noise", "base"}


def test_an_ablation_is_compared_on_common_scenes():
    rows = [row(Task("noise", scene, "balanced"), flip=0.01, passes=100.0) for scene in range(4)]
    rows += [row(Task("noise", scene, "balanced-no-scan"), flip=0.03 + scene, passes=50.0) for scene in (2, 3)]
    table = ablations(rows)
    assert table is not None
    assert table.rows == [
        ("noise", "balanced", "2 of 2", "0.01", "0.01", "100"),
        ("noise", "balanced-no-scan", "0 of 2", "2.53", "2.93", "50"),
    ]
    assert ablations(rows[:4]) is None


def test_the_first_fit_costs_its_kernels_more():
    first = row(
        Task("base", 0, "fast"),
        warm_up_seconds=5.0,
        seconds=2.0,
        load_seconds=0.5,
        parts={"solve": 2.0},
        machine={"import_seconds": 1.5},
    )
    second = row(Task("base", 1, "fast"), seconds=4.0, load_seconds=0.7, parts={"solve": 1.0, "record": 3.0})
    table = time_parts([first, second])
    assert table is not None
    cells = dict(zip(table.heads, table.rows[0], strict=True))
    assert (cells["load"], cells["solve"], cells["record"], cells["fit"]) == ("0.6", "1.5", "1.5", "3")
    assert (cells["kernels, once"], cells["imports, once"]) == ("2.5", "1.5")


def test_stages_have_their_flip():
    stages = [{"name": "mse-hdr", "flip": 0.2, "passes": 10.0}, {"name": "flip-hdr", "flip": 0.1, "passes": None}]
    table = stage_gains([row(Task("base", 0, "mfo-hdr"), stages=stages)])
    assert table is not None
    assert [line[2:] for line in table.rows] == [("mse-hdr", "0.2", "0.2", "10"), ("flip-hdr", "0.1", "0.1", "–")]


def test_paper_cells_are_those_of_its_tables():
    figure = paper_figure("transparency", "mfo-hdr")
    assert figure is not None
    assert (figure.seconds, figure.q_jod, figure.solved) == (14 * 60 + 6, (8.17, 4.89, 9.99), 0.33)
    four = paper_figure("transparency_4spp", "lpips-pu")
    assert four is not None
    assert (four.seconds, four.q_jod, four.solved) == (42, (7.01, 4.06, 9.22), None)
    assert paper_figure("relighting", "mfo-hdr") is None
    assert len(PAPER_NAMES) == 8
    assert all(paper_figure(s, m) for s in ("base", "noise", "parameters", "transparency") for m in PAPER_NAMES)


def test_failures_stay_in_shares_and_in_the_time_of_all_runs():
    rows = [
        row(Task("base", 0, "mfo-hdr"), seconds=60.0, jod=9.5, flip=0.001),
        row(Task("base", 1, "mfo-hdr"), seconds=180.0, jod=5.0, flip=0.5),
        row(Task("base", 2, "mfo-hdr"), seconds=None, jod=None, flip=None, error="ValueError: no"),
        row(Task("base", 3, "mfo-hdr"), seconds=180.0, jod=9.1, flip=0.03),
    ]
    tables = dict(paper_tables(rows))
    lines = {title.split(":")[0]: next(x for x in t.rows if "mfo-hdr" in x[0]) for title, t in tables.items()}
    assert lines["Table 1"][1:] == ["03:08", "02:00 (02:20)"]
    assert lines["Table 2"][1:] == ["9.83 (7.58/9.99)", "7.87 (5.00/9.50) *"]
    assert lines["Table 3"][1:] == ["92%", "JOD 50%, FLIP 25% of 4"]


@pytest.mark.parametrize(("value", "text"), [(None, "–"), (float("inf"), "–"), (0.01234, "0.0123"), (1234.4, "1234")])
def test_numbers_have_three_digits(value, text):
    assert number(value) == text


def test_minutes_are_the_papers():
    assert [minutes(s) for s in (3.14, 59.7, 846.0, float("nan"))] == ["3.1 s", "01:00", "14:06", "–"]


def test_a_table_is_markdown_html_and_csv():
    table = Table(("a", "b"), [("x <", "1,5")])
    assert table.markdown() == ["| a | b |", "| --- | --: |", "| x < | 1,5 |"]
    assert "x &lt;" in table.html()
    assert table.csv() == 'a,b\nx <,"1,5"\n'


def test_hard_cases_are_counted_with_their_guards(tmp_path):
    runs = [
        {"case": "mirror", "seed": 0, "solved": True, "error": 0.01, "finite": True, "passes": 10.0, "guards": [],
         "wrong": ["specular"]},
        {"case": "mirror", "seed": 1, "solved": False, "error": 0.5, "finite": True, "passes": 30.0,
         "guards": ["Fireflies are left out: 12 pixels.", "Kept 3 values."], "wrong": ["roughness"]},
        {"case": "tiny", "seed": 0, "solved": True, "error": 0.0, "finite": False, "passes": 5.0, "guards": []},
    ]  # fmt: skip
    assert hard_section(tmp_path) is None
    lines = [json.dumps(run) for run in runs]
    (tmp_path / "hard.jsonl").write_text("\n".join([*lines, '{"case": "cut of']))
    table = hard_section(tmp_path)
    assert table is not None
    assert table.rows == [
        ("mirror", "2", "1 (50%)", "0.5", "20", "0", "1", "2", "Fireflies are left out (1); Kept values (1)"),
        ("tiny", "1", "1 (100%)", "0", "5", "1", "–", "–", "–"),
    ]
    (tmp_path / "hard.jsonl").write_text('{"case": "tiny"}\n')
    with pytest.raises(BadInputError, match="no hard case"):
        hard_section(tmp_path)
