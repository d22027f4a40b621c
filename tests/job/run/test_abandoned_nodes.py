# SPDX-License-Identifier: Apache-2.0
"""What a killed backend's Blender has left in the temporary folder goes with the next start."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from mfo_backend.job.run.graph_blender import _remove_abandoned


@pytest.mark.skipif(os.name == "nt", reason="Windows cannot be asked for a process")
def test_folders_of_backends_that_are_gone_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    kept = {f"mfo_nodes_{os.getpid()}_abcd", "mfo_nodes_of_mine"}
    for name in (*kept, f"mfo_nodes_{gone.pid}_abcd"):
        (tmp_path / name).mkdir()
    (tmp_path / f"mfo_nodes_{gone.pid}_abcd" / "picture.exr").touch()
    _remove_abandoned()
    assert {path.name for path in tmp_path.iterdir()} == kept
