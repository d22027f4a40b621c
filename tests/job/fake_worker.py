# SPDX-License-Identifier: Apache-2.0
"""`mfo run` with a fit that needs no renderer: a child process of the tests.

`fake.json` in the job folder says what it does: how many iterations of which length, and where it goes wrong.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time

import numpy as np

from mfo_backend.cli.commands import run as command
from mfo_backend.job.run.job_outcome import JobOutcome
from mfo_backend.types.errors import BadInputError, SetupError
from mfo_backend.types.event import BestValues, Preview, Progress, StageEnd, Started
from mfo_backend.types.result import CurvePoint, FitResult, StageReport
from mfo_backend.types.status import Status


def fake_fit(folder, request, reference, view, *, listener, should_stop, more=()):
    plan = {"iterations": 5, "seconds": 0.01, "load_seconds": 0.0, "problem": "", "deaf": False}
    if (folder.root / "fake.json").exists():
        plan |= json.loads((folder.root / "fake.json").read_text())
    time.sleep(plan["load_seconds"])
    raise_problem(plan["problem"])
    print("a library prints on stdout")
    os.write(1, b"native code writes to file descriptor 1\n")
    listener(Started(stages=("mse-hdr",), parameters=("roughness",), seconds=0.0))
    start = np.full_like(reference.pixels, 0.2)
    curve, roughness, status = [], 0.5, Status.STALE
    for iteration in range(plan["iterations"]):
        if should_stop() and not plan["deaf"]:
            status = Status.CANCELLED
            break
        time.sleep(plan["seconds"])
        loss = 0.1 / (1 + iteration)
        roughness = 0.49 - 0.01 * iteration
        curve.append(CurvePoint(iteration, loss, loss, 0.01 * iteration, 3.0 * iteration))
        listener(Progress("mse-hdr", 0, 1, iteration, loss, loss, iteration / plan["iterations"], 0.0, float("nan")))
        listener(Preview(start))
        listener(BestValues(fake_result(Status.FAILED, roughness)))
        if plan["problem"] == "die":
            os.kill(os.getpid(), 9)
    best = curve[-1].loss if curve else 0.1
    listener(StageEnd("mse-hdr", status.value, status.sentence, len(curve), 0.1, best))
    stage = StageReport("mse-hdr", status, 0.1, best, len(curve), 0.1, {"roughness": roughness}, tuple(curve))
    counted = np.ones(start.shape[:2], bool)
    return JobOutcome(fake_result(status, roughness, stage), start, reference.pixels, counted, "fake_variant")


def fake_result(status, roughness, *stages):
    return FitResult(
        status=status,
        message=status.sentence,
        model="fake",
        initial={"roughness": 0.5, "base_color": (0.8, 0.8, 0.8)},
        recovered={"roughness": roughness, "base_color": (0.25, 0.5, 0.75)},
        bounds={"roughness": (0.04, 1.0), "base_color": (0.001, 0.999)},
        stages=stages,
        errors={"flip": (0.2, 0.1), "mse": (0.1, float("inf"))},
        seconds=0.1,
        passes=3.0 * sum(len(stage.curve) for stage in stages),
    )


def raise_problem(problem: str) -> None:
    if problem == "bad_input":
        raise BadInputError("Unknown parameter 'rough': this material has roughness.")
    if problem == "setup":
        raise SetupError("No LLVM library was found: get one.")
    if problem == "import":
        raise ImportError("libgone.so: cannot allocate memory")
    if problem == "bug":
        raise ZeroDivisionError("a bug\nwith a second line")
    if problem == "memory":
        raise MemoryError
    if problem == "space":
        raise OSError(28, "No space left on device")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    command.add_parser(parser.add_subparsers())
    grace = float(os.environ.get("MFO_TEST_ORPHAN_GRACE", "10"))
    parsed = parser.parse_args(["run", *sys.argv[1:]])
    sys.exit(command.leave(command.work(parsed, fake_fit, orphan_grace=grace, prepare=lambda: print("prepared"))))
