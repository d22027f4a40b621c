# SPDX-License-Identifier: Apache-2.0
"""What a killed Blender has left in the temporary folder goes with the next folder that is made."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

pytest.importorskip("bpy")


@pytest.mark.skipif(os.name == "nt", reason="Windows cannot be asked for a process")
def test_folders_of_blenders_that_are_gone_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from blender_addon.process.temporary_folder import temporary_folder

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    kept = {f"material_fit_check_{os.getpid()}_abcd_123", "material_fit_jobs", f"material_fit_x_{gone.pid}_abcd_123"}
    for name in (*kept, f"material_fit_check_{gone.pid}_abcd_123", f"material_fit_probe_{gone.pid}_abcd_123"):
        (tmp_path / name).mkdir()
    with temporary_folder("view") as folder:
        assert {path.name for path in tmp_path.iterdir()} == kept | {folder.name}
    assert {path.name for path in tmp_path.iterdir()} == kept


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux names zombies in /proc")
def test_the_folder_of_a_zombie_goes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from blender_addon.process.temporary_folder import temporary_folder

    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with subprocess.Popen([sys.executable, "-c", ""]) as zombie:
        os.waitid(os.P_PID, zombie.pid, os.WEXITED | os.WNOWAIT)  # it has ended, and nobody has asked for it
        (tmp_path / f"material_fit_check_{zombie.pid}_abcd_123").mkdir()
        with temporary_folder("view") as folder:
            assert list(tmp_path.iterdir()) == [folder]
