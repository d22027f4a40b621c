# SPDX-License-Identifier: Apache-2.0
"""Oracle: what the environment and the system say."""

from __future__ import annotations

import os

import pytest

from mfo_backend.types.processors import processors, threads_wanted


@pytest.mark.parametrize(("text", "threads"), [("3", 3), ("0", 1), ("", None), ("all", None), ("-2", None)])
def test_the_environment_limits_threads(monkeypatch, text, threads):
    monkeypatch.setenv("MFO_THREADS", text)
    assert threads_wanted() == threads


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no processor affinity here")
def test_processors_are_those_of_this_process():
    mine = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(mine)})
        assert processors() == 1
    finally:
        os.sched_setaffinity(0, mine)
    assert processors() == len(mine)
