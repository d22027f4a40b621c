# SPDX-License-Identifier: Apache-2.0
"""SIGKILL at random moments of real fits: ``python -m tests.faults.kill --blender 100 --backend 100``.

After each the .blend must open with the values it had or with all recovered ones, no process of ours may be left, and
the next run must leave no temporary file. The record goes into `docs/reference/reliability.md`.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import shutil
import signal
import subprocess
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .scene import ROOT, DemoFiles, in_blender, make_demo

ORPHAN_SECONDS = 12.0  # the backend promises ten
LEFT = (".tmp", ".partial", ".old", "@")  # of the backend, of an export, of Blender's own saving


def main() -> None:
    """Kill Blender, then the backend, and write what was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blender", type=int, default=100, help="moments at which Blender is killed")
    parser.add_argument("--backend", type=int, default=100, help="moments at which the backend is killed")
    parser.add_argument("--record", type=Path, default=ROOT / "docs" / "reliability" / "kill.json")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="mfo-kill-") as folder:
        files = make_demo(Path(folder, "demo"))
        first = kill_blender(files, Path(folder, "blender"), chosen.blender)
        second = kill_backend(files, Path(folder, "backend"), chosen.backend, first["seconds_unkilled"])
    chosen.record.parent.mkdir(parents=True, exist_ok=True)
    chosen.record.write_text(json.dumps({"blender": first, "backend": second}, indent=1) + "\n")
    print(json.dumps({"blender": first, "backend": second}, indent=1))


def kill_blender(files: DemoFiles, folder: Path, moments: int, seed: int = 11) -> dict[str, Any]:
    """Counts over runs of fit, apply and save whose Blender is killed."""
    rng = random.Random(seed)
    unkilled = _run(files, folder / "whole", None)
    whole = unkilled.at["saved"]
    saving = whole - unkilled.at["fitted"]
    steps: dict[str, int] = {}
    orphans = 0
    for index in range(moments):
        # every second one while it applies and saves, which is a small part of the whole
        since = "fitted" if index % 2 else "begin"
        at = rng.uniform(0.0, 1.1 * (saving if index % 2 else whole))
        run = _run(files, folder / f"run_{index:03d}", at, since)
        steps[run.last] = steps.get(run.last, 0) + 1
        orphans += not _ends(run.backend)
    # the next start cleans up: an export beside what the killed ones left
    _run(files, folder / "next", None, jobs=folder / "jobs")
    blends = [folder / "whole" / "a.blend", *(folder / f"run_{i:03d}" / "a.blend" for i in range(moments))]
    found = _values(files.start, *blends)
    start, done = found[str(files.start)], found[str(blends[0])]
    states = [_state(found.get(str(blend)), start, done) for blend in blends[1:]]
    return {
        "moments": moments,
        "seconds_unkilled": round(whole, 1),
        "seconds_saving": round(saving, 3),
        "killed_after": steps,
        "unchanged": states.count("unchanged"),
        "complete": states.count("complete"),
        "half": states.count("half"),
        "unreadable": states.count("unreadable"),
        "orphans": orphans,
        "left_after_next_start": sorted(p.name for p in (folder / "jobs").glob(".*") if p.name.endswith(LEFT)),
    }


def kill_backend(files: DemoFiles, folder: Path, moments: int, longest: float) -> dict[str, Any]:
    """Counts over fits in one Blender whose backend is killed."""
    folder.mkdir(parents=True)
    with in_blender("kill", files.start, files.reference, folder, str(moments), str(longest)) as blender:
        assert blender.stdout is not None
        rows = [json.loads(line) for line in blender.stdout if line.startswith('{"killed"')]
    assert len(rows) == moments, f"Blender ended after {len(rows)} of {moments} fits"
    return {
        "moments": moments,
        "killed": sum(row["killed"] for row in rows),
        "finished_before": sum(not row["killed"] for row in rows),
        "changed_without_apply": sum(not row["unchanged"] for row in rows),
        "complete": sum(row["complete"] for row in rows),
        "half": sum(row["has_result"] and not row["complete"] for row in rows),
        "not_reverted": sum(not row["reverted"] for row in rows),
        "left": sorted({name for row in rows for name in row["left"]}),
        "without_sentence": sum(not row["sentence"] for row in rows),
    }


@dataclass(frozen=True)
class Run:
    """Seconds from the beginning to every step it reached, and its backend's process id (0 before it has one)."""

    at: dict[str, float]
    backend: int

    @property
    def last(self) -> str:
        """The last step reached."""
        return next(reversed(self.at), "none")


def _run(files: DemoFiles, folder: Path, at: float | None, since: str = "begin", jobs: Path | None = None) -> Run:
    """One run in a copy of the .blend, killed `at` seconds after a step."""
    folder.mkdir(parents=True)
    blend = folder / "a.blend"
    shutil.copyfile(files.start, blend)
    job = (jobs or folder.parent / "jobs") / folder.name
    begin, steps, backend = time.monotonic(), {}, 0
    with in_blender("fit", blend, files.reference, job, start_new_session=True) as blender:
        timer = threading.Timer(at if at is not None else 600.0, _kill, [blender])
        if since == "begin":
            timer.start()
        assert blender.stdout is not None
        for line in blender.stdout:
            if line.startswith('{"step"'):
                event = json.loads(line)
                steps[event["step"]] = time.monotonic() - begin
                backend = event.get("backend", backend)
                if event["step"] == since:
                    timer.start()
        timer.cancel()
    run = Run(steps, backend)
    assert at is not None or run.last == "saved", f"a run that nobody killed ended after {run.last!r}"
    return run


def _kill(process: subprocess.Popen[str]) -> None:
    if process.poll() is None:
        os.kill(process.pid, signal.SIGKILL)


def _ends(pid: int) -> bool:
    """Whether the process ends within its time; nobody here is its parent, so no zombie stays."""
    end = time.monotonic() + ORPHAN_SECONDS
    while pid and Path(f"/proc/{pid}").exists():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


def _values(*blends: Path) -> dict[str, Any]:
    with in_blender("check", *blends) as blender:
        assert blender.stdout is not None
        rows = [json.loads(line) for line in blender.stdout if line.startswith('{"file"')]
    return {row["file"]: row["values"] for row in rows}


def _state(found: dict[str, Any] | None, start: dict[str, Any], done: dict[str, Any]) -> str:
    if found is None:
        return "unreadable"
    if found == start:
        return "unchanged"
    # the numbers of a fit depend a little on the threads' timing; whichever was applied, all of it must be there
    changed = {name for name in done if done[name] != start[name]}
    same = {name for name in found if found[name] == start[name]}
    return "half" if changed & same else "complete"


if __name__ == "__main__":
    main()
