# SPDX-License-Identifier: Apache-2.0
"""A few of the kills that `tests.faults.kill` counts by the hundred."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import pytest

from .kill import kill_backend, kill_blender
from .scene import make_demo

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(os.name == "nt", reason="POSIX signals"),
    pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="the bpy module is not installed"),
]


def test_a_killed_backend_leaves_nothing_half(tmp_path: Path) -> None:
    files = make_demo(tmp_path / "demo", 16)
    backend = kill_backend(files, tmp_path / "backend", 2, longest=3.0)
    assert backend["half"] == backend["changed_without_apply"] == backend["not_reverted"] == 0
    assert backend["without_sentence"] == 0
    assert backend["left"] == []


@pytest.mark.skipif("MFO_KILLS" not in os.environ, reason="MFO_KILLS says at how many moments Blender is killed")
def test_a_killed_blender_leaves_nothing_half(tmp_path: Path) -> None:
    moments = int(os.environ["MFO_KILLS"])
    blender = kill_blender(make_demo(tmp_path / "demo", 16), tmp_path / "blender", moments, seed=5)
    assert blender["unchanged"] + blender["complete"] == moments
    assert blender["orphans"] == 0
    assert blender["left_after_next_start"] == []
