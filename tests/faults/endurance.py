# SPDX-License-Identifier: Apache-2.0
"""Many fits in one process: ``python -m tests.faults.endurance backend|blender|repeat --fits 200``.

``backend``: one Python runs job after job, as nothing of ours does but a bench; ``blender``: one Blender starts a
backend for each. Memory, open files, threads and seconds of every fit go into the record of
`docs/reference/reliability.md`.
``repeat``: the same job again and again, in new processes, with 1, 2 and 4 threads.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .scene import ROOT, environment, in_blender, make_demo

PARTS = {"values": ("initial", "recovered", "certainty"), "errors": ("errors",)}  # of result.json
WARM = 5  # fits until kernels are compiled and pools have grown


def main() -> None:
    """Run one of the three and write its record."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("backend", "blender", "repeat"))
    parser.add_argument("--fits", type=int, default=200)
    parser.add_argument("--size", type=int, default=24)
    parser.add_argument("--record", type=Path, default=ROOT / "docs" / "reliability")
    chosen = parser.parse_args()
    chosen.record.mkdir(parents=True, exist_ok=True)
    run = {"backend": backend, "blender": blender, "repeat": repeat}[chosen.what]
    with tempfile.TemporaryDirectory(prefix="mfo-endurance-") as folder:
        for record in run(Path(folder), chosen.fits, chosen.size):  # so far, again and again
            (chosen.record / f"{chosen.what}.json").write_text(json.dumps(record) + "\n")
    print(json.dumps({key: value for key, value in record.items() if key != "rows"}, indent=1))


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """First and last tenth after the warm-up, medians, and memory per fit by a line through all of them."""
    kept = rows[WARM:]
    part = max(len(kept) // 10, 1)
    first, last = kept[:part], kept[-part:]

    def median(some: list[dict[str, Any]], key: str) -> float:
        return round(float(np.median([row[key] for row in some])), 3)

    slope = float(np.polyfit(np.arange(len(kept)), [row["megabytes"] for row in kept], 1)[0]) if len(kept) > 1 else 0.0
    return {
        "fits": len(rows),
        "bad": sum(row["status"] not in ("converged", "stale", "unchanged", "max_iterations") for row in rows),
        "seconds": [median(first, "seconds"), median(last, "seconds")],
        "megabytes": [median(first, "megabytes"), median(last, "megabytes")],
        "megabytes_per_fit": round(slope, 4),
        "files": [median(first, "files"), median(last, "files")],
        "threads": [median(first, "threads"), median(last, "threads")],
        "rows": [[round(row["seconds"], 2), round(row["megabytes"], 1)] for row in rows],
    }


def backend(folder: Path, fits: int, size: int) -> Iterator[dict[str, Any]]:
    """Jobs of three presets in turn, in one process, from seed to seed; also the kernels on disk."""
    from mfo_backend.job.output.progress import EventWriter
    from mfo_backend.job.run.run_job import run_job
    from mfo_backend.job.run.stop import StopSignal

    job = export(folder, size)
    request = json.loads((job / "request.json").read_text())
    cache = folder / "kernels"  # nobody else's
    cache.mkdir()
    os.environ["DRJIT_CACHE_DIR"] = str(cache)
    rows = []
    for index in range(fits):
        request["fit"] |= {
            "preset": ("fast", "balanced", "paper")[index % 3],
            "seed": index,
            "max_iterations": 8,
            "spp": 2,
        }
        (job / "request.json").write_text(json.dumps(request))
        begin = time.monotonic()
        status = run_job(job, EventWriter(stream=io.StringIO()), StopSignal())
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        rows.append(
            {
                "seconds": time.monotonic() - begin,
                "status": status.value,
                "megabytes": pages * 4096 / 1e6,
                "files": len(os.listdir("/proc/self/fd")),
                "threads": len(os.listdir("/proc/self/task")),
                "kernels": len(list(cache.rglob("*"))),
            }
        )
        if index == fits - 1 or index % 20 == 19:
            third = rows[WARM - WARM % 3 :: 3]  # one preset: seconds of different ones cannot be compared
            found = summary(rows) | {"seconds": summary(third)["seconds"]}
            yield found | {"kernels": [rows[min(WARM, index)]["kernels"], rows[-1]["kernels"]]}


def blender(folder: Path, fits: int, size: int) -> Iterator[dict[str, Any]]:
    """Fit, apply and revert in one Blender."""
    files = make_demo(folder / "demo", size)
    with in_blender("many", files.start, files.reference, folder, str(fits)) as process:
        assert process.stdout is not None
        rows = []
        for line in process.stdout:
            if line.startswith('{"fit"'):
                rows.append(json.loads(line))
                if len(rows) == fits or len(rows) % 20 == 0:
                    yield summary(rows) | {"images": [rows[0]["images"], rows[-1]["images"]]}
    assert len(rows) == fits, f"Blender ended after {len(rows)} of {fits} fits"


def repeat(folder: Path, fits: int, size: int) -> Iterator[dict[str, Any]]:
    """How far results of the same job differ: between processes, and between numbers of threads."""
    job = export(folder, size)
    request = json.loads((job / "request.json").read_text())
    found: dict[str, Any] = {}
    for preset in ("fast", "balanced", "paper"):
        request["fit"] |= {"preset": preset, "seed": 5, "max_iterations": 12, "spp": 4}
        (job / "request.json").write_text(json.dumps(request))
        runs = {threads: [_values(job, threads) for _ in range(max(2, fits))] for threads in (1, 2, 4)}
        found[preset] = {"runs": sum(map(len, runs.values()))}
        for part in PARTS:
            same = [np.ptp([run[part] for run in some], axis=0).max() for some in runs.values()]
            everything = [run[part] for some in runs.values() for run in some]
            found[preset][part] = {
                "same_threads": float(max(same)),
                "one_thread": float(same[0]),
                "any_threads": float(np.ptp(everything, axis=0).max()),
            }
    yield found


def _values(job: Path, threads: int) -> dict[str, list[float]]:
    """The recovered values with their certainty, and the errors, of a run in a new process."""
    code = (
        "import sys, os, io\nfrom pathlib import Path\n"
        "from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm\n"
        "needs_llvm() and configure_llvm()\nimport drjit as dr\n"
        f"dr.set_thread_count({threads})\n"
        "from mfo_backend.job.run.run_job import run_job\nfrom mfo_backend.job.output.progress import EventWriter\n"
        "from mfo_backend.job.run.stop import StopSignal\n"
        f"run_job(Path({str(job)!r}), EventWriter(stream=io.StringIO()), StopSignal())\nos._exit(0)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT, env=environment(), capture_output=True)
    result = json.loads((job / "result.json").read_text())
    return {part: leaves({key: result[key] for key in keys}) for part, keys in PARTS.items()}


def leaves(value: Any) -> list[float]:
    """All numbers of a JSON value in order."""
    if isinstance(value, dict):
        return [n for key in sorted(value) for n in leaves(value[key])]
    if isinstance(value, list):
        return [n for item in value for n in leaves(item)]
    return [] if isinstance(value, str) else [float(value)]


def export(folder: Path, size: int) -> Path:
    """The demo's job folder."""
    from .scene import headless

    files = make_demo(folder / "demo", size)
    job = folder / "job"
    headless("export", files.start, "--object", "Suzanne", "--reference", files.reference, "--job", job)
    return job


if __name__ == "__main__":
    main()
