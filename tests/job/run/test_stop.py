# SPDX-License-Identifier: Apache-2.0
"""When a job that was asked to stop is ended from outside of its fit: orphans that take too long, and while loading."""

from __future__ import annotations

import pytest

from mfo_backend.job.run.stop import LOADING_GRACE, ORPHAN_GRACE, StopSignal
from mfo_backend.types.status import Status

CANCELLED = Status.CANCELLED.exit_code


@pytest.fixture
def ended() -> list[int]:
    return []


@pytest.fixture
def stop(ended: list[int]) -> StopSignal:
    return StopSignal(end_process=ended.append)


def test_a_job_that_somebody_waits_for_may_take_its_time(stop: StopSignal, ended: list[int]) -> None:
    stop.request("the file 'cancel' asked to stop")
    stop._end_if_due(100.0 * ORPHAN_GRACE)
    assert ended == []


def test_an_orphan_has_its_grace_and_no_more(stop: StopSignal, ended: list[int]) -> None:
    stop.request("the file 'cancel' asked to stop")
    stop.request("the program that started this job has ended", orphaned=True)
    assert stop.reason == "the file 'cancel' asked to stop"
    stop._end_if_due(0.9 * ORPHAN_GRACE)
    assert ended == []
    stop._end_if_due(1.1 * ORPHAN_GRACE)
    assert ended == [CANCELLED]


def test_while_a_scene_loads_a_job_says_its_last_words_and_ends(stop: StopSignal, ended: list[int]) -> None:
    said: list[str] = []
    stop.loading(lambda: said.append("cancelled"))
    stop.request("a signal asked to stop")
    stop._end_if_due(0.9 * LOADING_GRACE)
    assert (said, ended) == ([], [])
    stop._end_if_due(1.1 * LOADING_GRACE)
    assert (said, ended) == (["cancelled"], [CANCELLED])


def test_once_loaded_the_fit_answers_itself(stop: StopSignal, ended: list[int]) -> None:
    stop.loading(lambda: ended.append(-1))
    stop.loaded()
    stop.request("a signal asked to stop")
    stop._end_if_due(10.0 * LOADING_GRACE)
    assert ended == []
