# SPDX-License-Identifier: Apache-2.0
"""What a killed backend has left in the temporary folder goes with the next start of a command."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from mfo_backend.render.machine.temporary_folder import remove_abandoned, temporary_folder

ROOT = Path(__file__).resolve().parents[3]
PROBES = """
import subprocess, sys, time
from pathlib import Path
from mfo_backend.render.machine import llvm
def slow(*words, env, **options):
    print(env["DRJIT_CACHE_DIR"], flush=True)
    time.sleep(60)
llvm.subprocess.run = slow
llvm._probe_in_child(Path("libLLVM.so"), 60.0)
"""


@pytest.mark.skipif(os.name == "nt", reason="Windows cannot be asked for a process")
def test_folders_of_backends_that_are_gone_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    kept = {f"mfo_nodes_{os.getpid()}_abcd_123", "mfo_nodes_of_mine", f"mfo_renders_{gone.pid}_abcd_123"}
    for name in (*kept, f"mfo_nodes_{gone.pid}_abcd_123", f"mfo_hdrvdp_{gone.pid}_abcd_123"):
        (tmp_path / name).mkdir()
    (tmp_path / f"mfo_nodes_{gone.pid}_abcd_123" / "picture.exr").touch()
    remove_abandoned()
    assert {path.name for path in tmp_path.iterdir()} == kept


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux names zombies in /proc")
def test_the_folder_of_a_zombie_goes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with subprocess.Popen([sys.executable, "-c", ""]) as zombie:
        os.waitid(os.P_PID, zombie.pid, os.WEXITED | os.WNOWAIT)  # it has ended, and nobody has asked for it
        (tmp_path / f"mfo_nodes_{zombie.pid}_abcd_123").mkdir()
        remove_abandoned()
        assert list(tmp_path.iterdir()) == []


def test_a_folder_goes_at_the_end_of_its_block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    with temporary_folder("llvm") as folder:
        (folder / "kernel").touch()
        remove_abandoned()
        assert (folder / "kernel").is_file()
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
def test_killed_while_llvm_is_probed(tmp_path: Path) -> None:
    environment = os.environ | {"TMPDIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        [sys.executable, "-c", PROBES], env=environment, stdout=subprocess.PIPE, text=True
    ) as probing:
        assert probing.stdout is not None
        folder = Path(probing.stdout.readline().strip())
        assert folder.parent == tmp_path
        assert folder.is_dir()
        os.kill(probing.pid, signal.SIGKILL)
    assert folder.is_dir()
    subprocess.run([sys.executable, "-m", "mfo_backend", "--version"], env=environment, cwd=ROOT, check=True)
    assert list(tmp_path.iterdir()) == []
