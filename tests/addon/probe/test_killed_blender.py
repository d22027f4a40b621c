# SPDX-License-Identifier: Apache-2.0
"""A Blender that is killed while its fit evaluates nodes leaves no process, no file, and the user's file as it was."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from ...blender.killed_blender import kill_blender_of_a_graph_fit

pytest.importorskip("bpy")


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="looks for processes in /proc")
def test_the_module_killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).resolve().parents[3]))
    kill_blender_of_a_graph_fit([sys.executable], tmp_path)
