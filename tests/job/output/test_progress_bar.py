# SPDX-License-Identifier: Apache-2.0
"""The bar of a fit that begins again from another material."""

from __future__ import annotations

import io
import sys
import time

from mfo_backend.job.output.progress_bar import ProgressBar
from mfo_backend.types.event import Progress, StageEnd, Started

REDRAWN_AFTER = 0.15  # seconds; tqdm draws no more than ten times a second


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_fit_that_begins_again_has_a_bar_that_begins_again(monkeypatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    bar = ProgressBar()
    for last in (0.9, 0.3):
        bar.show(Started(stages=("scan",), parameters=("roughness",), seconds=0.0))
        for fraction in (0.0, last):
            bar.show(Progress("scan", 0, 1, 0, 0.5, 0.5, fraction, 0.0, 1.0))
            time.sleep(REDRAWN_AFTER)
        shown = terminal.getvalue()
        terminal.truncate(terminal.seek(0))
    bar.close()
    assert " 30%" in shown
    assert " 90%" not in shown


def test_a_stage_that_was_ended_before_its_first_step_leaves_no_line(capsys) -> None:
    bar = ProgressBar()
    bar.show(StageEnd("scan", "converged", "The fit converged.", 3, 0.5, 0.25))
    bar.show(StageEnd("race", "cancelled", "Cancelled.", 0, float("nan"), float("inf")))
    assert capsys.readouterr().err.splitlines() == ["scan: 0.5 -> 0.25 in 3 iterations. The fit converged."]
