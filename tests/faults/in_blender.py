# SPDX-License-Identifier: Apache-2.0
"""Inside the bpy module: ``fit``: fit, apply and save until killed; ``kill``: fits whose backend is killed;
``check``: what is in the .blend files that others left; ``many``: fits in one Blender, with its memory.

Every command prints JSON lines; `tests.faults.kill` and `tests.faults.endurance` read them.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from pathlib import Path
from typing import Any

import bpy

import blender_addon
from blender_addon.running import running_job

OBJECT = "Suzanne"
FIT = {"object": OBJECT, "preset": "fast", "wait": False}


def open_file(path: Path) -> None:
    """Open a .blend with the add-on registered."""
    if not hasattr(bpy.types.Material, "mfo"):
        blender_addon.register()
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=False)


def values() -> dict[str, Any]:
    """The Principled sockets of the object's material."""
    nodes = bpy.data.objects[OBJECT].active_material.node_tree.nodes
    inputs = next(node for node in nodes if node.type == "BSDF_PRINCIPLED").inputs
    found = {s.name: getattr(s, "default_value", None) for s in inputs}
    return {name: v if isinstance(v, (int, float)) else tuple(v) for name, v in found.items() if v is not None}


def say(**fields: Any) -> None:
    """One JSON line."""
    print(json.dumps(fields), flush=True)


def fit(blend: str, reference: str, job: str) -> None:
    """Fit, apply, save; every step is announced, so that a killer can choose between them."""
    open_file(Path(blend))
    say(step="opened")
    bpy.ops.mfo.fit(reference=reference, job_folder=job, **FIT)
    say(step="started", backend=running_job.current.process.pid)
    running_job.wait(lambda _: None)
    say(step="fitted")
    bpy.ops.mfo.apply()
    say(step="applied")
    bpy.ops.wm.save_mainfile()
    say(step="saved")


def kill(blend: str, reference: str, folder: str, moments: str, longest: str) -> None:
    """Fits whose backend gets SIGKILL at a random moment; the material must be as before or complete."""
    open_file(Path(blend))
    before, rng = values(), random.Random(7)
    for index in range(int(moments)):
        job = Path(folder, f"job_{index % 3}")  # folders are used again, with what a killed backend left in them
        bpy.ops.mfo.fit(reference=reference, job_folder=str(job), **FIT)
        pid, at = running_job.current.process.pid, time.monotonic() + rng.uniform(0.0, float(longest))
        while (outcome := running_job.step()) is None and time.monotonic() < at:
            time.sleep(0.01)
        killed = outcome is None
        if killed:
            os.kill(pid, signal.SIGKILL)
        while outcome is None:
            outcome = running_job.step()
            time.sleep(0.01)
        runtime = bpy.context.window_manager.mfo_runtime
        unchanged = values() == before
        complete = False
        if runtime.has_result:
            bpy.ops.mfo.apply()
            complete = values() != before and (job / "result.json").is_file()
            bpy.ops.mfo.revert(material=bpy.data.objects[OBJECT].active_material.name)
        left = [p.name for p in job.rglob("*") if p.name.endswith((".tmp", ".partial", ".old"))]
        say(
            killed=killed, status=outcome.status, sentence=outcome.sentence, unchanged=unchanged, complete=complete,
            has_result=bool(runtime.has_result), reverted=values() == before, left=left,
        )  # fmt: skip


def check(*blends: str) -> None:
    """The values in every file."""
    for blend in blends:
        open_file(Path(blend))
        say(file=blend, values=values())


def many(blend: str, reference: str, folder: str, count: str) -> None:
    """Fits in one Blender, one job folder after the other; resident memory of this process in MB."""
    open_file(Path(blend))
    for index in range(int(count)):
        begin = time.monotonic()
        bpy.ops.mfo.fit(reference=reference, job_folder=str(Path(folder, f"job_{index % 3}")), **FIT)
        outcome = running_job.wait(lambda _: None)
        bpy.ops.mfo.apply()
        bpy.ops.mfo.revert(material=bpy.data.objects[OBJECT].active_material.name)
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        say(fit=index, seconds=time.monotonic() - begin, status=outcome.status, megabytes=pages * 4096 / 1e6,
            images=len(bpy.data.images), threads=len(os.listdir("/proc/self/task")),
            files=len(os.listdir("/proc/self/fd")))  # fmt: skip


if __name__ == "__main__":
    {"fit": fit, "kill": kill, "check": check, "many": many}[sys.argv[1]](*sys.argv[2:])
    sys.stdout.flush()
    os._exit(0)
