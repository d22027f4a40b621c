# SPDX-License-Identifier: Apache-2.0
"""SIGKILL for the Blender of an artist in the middle of a fit whose values are inside nodes: three processes run."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from ..addon.fake_backend import png

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = Path(__file__).resolve().parent / "scripts" / "graphs" / "fit_until_killed.py"
START_SECONDS = 90.0  # until the backend has started a Blender for the nodes
ORPHAN_SECONDS = 12.0  # the backend promises ten
BACKEND = b"mfo_backend"


def kill_blender_of_a_graph_fit(command: Sequence[str], folder: Path, *words: str) -> None:
    """Start `command` with the script, kill it when all three run, and look for what is left."""
    temporary = folder / "temporary"
    temporary.mkdir()
    png(folder / "reference.png", (180, 60, 40), 48, 48)
    environment = os.environ | {"TMPDIR": str(temporary), "TEMP": str(temporary), "MFO_BACKEND_PYTHON": sys.executable}
    with subprocess.Popen(
        [*command, str(SCRIPT), "--", str(folder), *words],
        env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    ) as killed:  # fmt: skip
        _wait((folder / "pid").is_file, START_SECONDS, killed)
        blend = (folder / "scene.blend").read_bytes()
        _wait(lambda: _runs_a_node_server(temporary), START_SECONDS, killed)
        os.kill(int((folder / "pid").read_text()), signal.SIGKILL)
    _wait(lambda: not processes_with(temporary), ORPHAN_SECONDS)
    assert (folder / "scene.blend").read_bytes() == blend
    hidden = [path.name for path in folder.glob(".*")]
    assert hidden == [], hidden
    left = left_in(temporary, "blender_", "mfo_nodes_", "mfo_llvm_")
    assert left == [], left
    start = [sys.executable, "-m", "mfo_backend", "--version"]
    subprocess.run(start, env=environment, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
    left = left_in(temporary, "blender_")  # Blender's own folder for one session
    assert left == [], left


def left_in(temporary: Path, *known: str) -> list[str]:
    """What lies there and does not begin with what may."""
    return [path.name for path in temporary.iterdir() if not path.name.startswith(known)]


def processes_with(temporary: Path) -> dict[int, bytes]:
    """Command lines of live processes whose temporary folder this is, by id."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            if str(temporary).encode() in (folder / "environ").read_bytes():
                found[int(folder.name)] = (folder / "cmdline").read_bytes()
        except OSError:
            continue
    return {pid: words for pid, words in found.items() if words}  # a zombie has none


def _runs_a_node_server(temporary: Path) -> bool:
    lines = list(processes_with(temporary).values())
    server = any(b"probe.server" in words or b"probe/server.py" in words for words in lines)
    return server and any(BACKEND in words and b"\0run\0" in words for words in lines)


def _wait(condition: Callable[[], bool], seconds: float, running: subprocess.Popen[bytes] | None = None) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "it took too long"
        assert running is None or running.poll() is None, "Blender has ended"
        time.sleep(0.02)
