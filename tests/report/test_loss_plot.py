# SPDX-License-Identifier: Apache-2.0
"""The loss curve as SVG: every point where the axes say it is."""

from __future__ import annotations

import math
from xml.etree import ElementTree

import pytest

from mfo_backend.report.loss_plot import BOTTOM, HEIGHT, LEFT, LETTER, MOST_POINTS, RIGHT, TOP, WIDTH, loss_plot
from mfo_backend.types.result import CurvePoint, StageReport
from mfo_backend.types.status import Status


def stage(name: str, points: list[tuple[float, float, float]]) -> StageReport:
    curve = tuple(CurvePoint(i, loss, best, seconds, 0.0) for i, (seconds, loss, best) in enumerate(points))
    return StageReport(name, Status.STALE, 1.0, 1.0, len(curve), 1.0, {}, curve)


def lines(svg: ElementTree.Element, kind: str) -> list[list[tuple[float, float]]]:
    found = [line for line in svg.iter("polyline") if kind in line.get("class", "").split()]
    return [[tuple(map(float, pair.split(","))) for pair in line.get("points", "").split()] for line in found]


def test_points_lie_where_the_axes_say() -> None:
    svg = ElementTree.fromstring(loss_plot([stage("mse-hdr", [(0.0, 1.0, 1.0), (5.0, 0.1, 0.1), (10.0, 0.01, 0.01)])]))
    (best,) = lines(svg, "best")
    middle = (LEFT + (WIDTH - LEFT - RIGHT) / 2, TOP + (HEIGHT - TOP - BOTTOM) / 2)
    # one loss decade is half the height, half the time half the width; coordinates have one decimal
    assert best[0] == pytest.approx((LEFT, TOP), abs=0.06)
    assert best[1] == pytest.approx(middle, abs=0.06)
    assert best[2] == pytest.approx((WIDTH - RIGHT, HEIGHT - BOTTOM), abs=0.06)


def test_both_stages_and_their_switch_are_drawn() -> None:
    first = stage("mse-hdr", [(0.0, 1.0, 1.0), (4.0, 0.1, 0.1)])
    second = stage("flip-hdr", [(5.0, 0.5, 0.5), (8.0, 0.2, 0.2)])
    svg = ElementTree.fromstring(loss_plot([first, second]))
    assert len(lines(svg, "best")) == len(lines(svg, "loss")) == 2
    (switch,) = [line for line in svg.iter("line") if line.get("class") == "switch"]
    assert float(switch.get("x1", "")) == pytest.approx(LEFT + (WIDTH - LEFT - RIGHT) / 2, abs=0.06)
    labels = [text.text for text in svg.iter("text") if "stage" in text.get("class", "")]
    assert labels == ["mse-hdr", "flip-hdr"]


@pytest.mark.parametrize(
    "points",
    [[], [(0.0, 0.0, 0.0)], [(0.0, math.nan, math.nan)], [(0.0, math.inf, math.inf)], [(0.0, -1.0, -1.0)]],
)
def test_without_a_loss_there_is_no_plot(points: list) -> None:
    assert loss_plot([stage("mse-hdr", points)]) == ""
    assert loss_plot([]) == ""


@pytest.mark.parametrize(
    "losses",
    [
        [0.5],
        [0.5, 0.5],
        [1e-9, 1e6],
        [0.062, 0.061],
        [1.0, 0.1],
        [1e-12, 1.1e-12],
        [math.nan, 0.3, 0.0, math.inf, 0.2],
    ],
)
def test_every_range_of_losses_stays_inside_and_has_ticks(losses: list[float]) -> None:
    svg = ElementTree.fromstring(loss_plot([stage("x", [(float(i), v, v) for i, v in enumerate(losses)])]))
    drawn = [point for line in lines(svg, "loss") for point in line]
    assert len(drawn) == sum(1 for v in losses if math.isfinite(v) and v > 0)
    for x, y in drawn:
        assert LEFT - 0.1 <= x <= WIDTH - RIGHT + 0.1
        assert TOP - 0.1 <= y <= HEIGHT - BOTTOM + 0.1
    grid = [line for line in svg.iter("line") if line.get("class") == "grid"]
    assert 2 <= len(grid) <= 12


def test_a_long_curve_is_thinned_and_keeps_its_end() -> None:
    points = [(i / 10, 1.0 / (1 + i), 1.0 / (1 + i)) for i in range(5000)]
    svg = ElementTree.fromstring(loss_plot([stage("x", points)]))
    (best,) = lines(svg, "best")
    assert len(best) <= MOST_POINTS + 1
    assert best[-1][0] == pytest.approx(WIDTH - RIGHT, abs=0.06)


def test_names_of_short_stages_stand_beside_each_other_or_below() -> None:
    """Each name has its own room, and keeps within the picture; the usual ones of a fit."""
    ends = [("scan", 3.0), ("start", 3.2), ("refine", 9.0), ("itp", 9.5)]
    begins = [0.0, *(end for _, end in ends)]
    made = [stage(n, [(b, 1.0, 1.0), (e, 0.5, 0.5)]) for (n, e), b in zip(ends, begins, strict=False)]
    rooms = []
    for text in ElementTree.fromstring(loss_plot(made)).iter("text"):
        if "stage" in text.get("class", ""):
            x, width = float(text.get("x", "")), LETTER * len(text.text or "")
            left = x - width if text.get("text-anchor") == "end" else x
            rooms.append((left, left + width, text.get("y")))
    assert [y for _, _, y in rooms].count(rooms[0][2]) == 3
    for k, (left, right, y) in enumerate(rooms):
        assert LEFT <= left < right <= WIDTH
        assert all(right <= other[0] or other[1] <= left for other in rooms[k + 1 :] if other[2] == y)
