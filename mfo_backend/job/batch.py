# SPDX-License-Identifier: Apache-2.0
"""Many job folders, each run by a process of its own: a job that dies takes no other with it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..types.status import Status
from .cluster import LOOK_SECONDS, RETRIES, as_they_come

_ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class JobEnd:
    """How one job ended; `status` is the code of a `Status`."""

    job: str
    status: str
    sentence: str
    seconds: float


def is_done(job: Path) -> bool:
    """Whether the folder holds a whole result."""
    try:
        result = json.loads((job / "result.json").read_text("utf-8"))
        return not result["partial"]
    except (OSError, ValueError, KeyError, TypeError):
        return False


def run_one(
    job: str, threads: int = 0, should_stop: Callable[[], bool] = lambda: False, trusted: bool = False
) -> JobEnd:
    """Run `mfo run` on a folder and wait for it; asked to stop, it keeps its best values."""
    began = time.monotonic()
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join(filter(None, (str(_ROOT), os.environ.get("PYTHONPATH")))))
    if threads:
        environment["MFO_THREADS"] = str(threads)
    words = [sys.executable, "-m", "mfo_backend", "run", job, "--progress", "none", "--parent", str(os.getpid())]
    words += ["--trust"] * trusted
    process = subprocess.Popen(
        words, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    asked = False
    while True:
        try:
            _, errors = process.communicate(timeout=LOOK_SECONDS)
            break
        except subprocess.TimeoutExpired:
            if should_stop() and not asked:
                asked = True
                process.send_signal(signal.SIGTERM)
    said = [line for line in errors.splitlines() if line.startswith("mfo: ")]
    codes = {status.exit_code: status.value for status in Status if status.exit_code}
    status = codes.get(process.returncode, Status.CONVERGED.value if process.returncode == 0 else Status.FAILED.value)
    sentence = said[0].removeprefix("mfo: ") if said else _end_sentence(process.returncode)
    return JobEnd(job, status, sentence, time.monotonic() - began)


def _end_sentence(code: int) -> str:
    """Why a process ended that could not say so itself."""
    if code >= 0:
        return f"The process ended with code {code}."
    try:
        name = signal.Signals(-code).name
    except ValueError:
        name = f"signal {-code}"
    # native code that gets no memory ends in a segmentation fault (Dr.Jit 1.5.0, Embree 3)
    ended = "was killed" if name == "SIGKILL" else "crashed"
    return (
        f"The process {ended} ({name}); the memory may have run out, so try a lower resolution or fewer jobs at once."
    )


def run_here(
    jobs: Sequence[str], at_once: int, threads: int, should_stop: Callable[[], bool], trusted: bool = False
) -> Iterator[JobEnd]:
    """Run jobs on this machine, `at_once` at a time; those not begun when asked to stop are left out."""
    with ThreadPoolExecutor(at_once) as pool:
        waiting = {pool.submit(run_one, job, threads, should_stop, trusted) for job in jobs}
        while waiting:
            ended, waiting = wait(waiting, timeout=LOOK_SECONDS, return_when=FIRST_COMPLETED)
            yield from (future.result() for future in ended)
            if should_stop():
                waiting = {future for future in waiting if not future.cancel()}


def run_there(
    jobs: Sequence[str], client: Any, should_stop: Callable[[], bool], trusted: bool = False
) -> Iterator[JobEnd]:
    """Run jobs on Dask workers, which must see the folders under the same names."""
    futures = {job: client.submit(run_one, job, trusted=trusted, pure=False, retries=RETRIES) for job in jobs}
    left = dict(futures)
    for job, outcome in as_they_come(client, futures, should_stop):
        del left[job]
        if outcome.error is None:
            yield outcome.result
        else:
            yield JobEnd(job, Status.FAILED.value, f"Dask gave this job up: {outcome.error}", 0.0)
    client.cancel([*left.values()])
