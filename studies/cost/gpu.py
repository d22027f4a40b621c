# SPDX-License-Identifier: Apache-2.0
"""Fits on a GPU beside the same fits on the processor of the same machine: `python -m studies.cost.gpu`.

    python -m studies.cost.gpu [--variants llvm_ad_rgb cuda_ad_rgb] [--scenario base] [--method balanced] [--scenes 20]
                               [--size 256] [--tests] [--frame JOB] [--repeat 2] --out DIR

For each variant of Mitsuba: with `--tests` the tests of the material and of the renderer, the bench's scenes, and with
`--frame` a job folder (`studies.cost.large_frames` makes those of 1920 x 1080). What a variant says goes to
`DIR/VARIANT-*.log`, and a table is printed after each, so that a run that is stopped has said what it knows.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]

# their tests evaluate kernels: closures, recordings, renderers, gradients
KERNEL_TESTS = ("tests/material", "tests/render", "tests/fit/recorded")


def main() -> None:
    """Measure each variant and print its line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--variants", nargs="+", default=["llvm_ad_rgb", "cuda_ad_rgb"])
    parser.add_argument("--scenario", default="base")
    parser.add_argument("--method", default="balanced")
    parser.add_argument("--scenes", type=int, default=20)
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--tests", action="store_true")
    parser.add_argument("--frame", type=Path)
    parser.add_argument("--repeat", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True)
    chosen = parser.parse_args()
    chosen.out.mkdir(parents=True, exist_ok=True)
    for variant in chosen.variants:
        logs = chosen.out / variant
        if chosen.tests:
            print(f"{variant}: tests: {run_tests(variant, logs)}", flush=True)
        print(f"{variant}: {bench_line(run_bench(variant, chosen))}", flush=True)
        if chosen.frame:
            print(f"{variant}: frame: {run_frame(variant, chosen.frame, chosen.out, chosen.repeat)}", flush=True)


def run_tests(variant: str, logs: Path) -> str:
    """The last line of pytest on the tests that evaluate kernels."""
    words = [
        "pytest",
        *KERNEL_TESTS,
        "-q",
        "-n",
        "4",
        "--dist",
        "loadfile",
        "-p",
        "no:cacheprovider",
        "-p",
        "no:benchmark",
    ]
    said = _said(variant, words, Path(f"{logs}-tests.log"))
    return said.strip().splitlines()[-1] if said.strip() else "no word"


def run_bench(variant: str, chosen: argparse.Namespace) -> list[dict[str, Any]]:
    """The rows of the bench's scenes."""
    folder = chosen.out / f"{variant}-bench"
    words = ["mfo_backend", "bench", "--scenario", chosen.scenario, "--method", chosen.method]
    words += ["--scenes", str(chosen.scenes), "--size", str(chosen.size), "--out", str(folder)]
    _said(variant, words, Path(f"{chosen.out / variant}-bench.log"))
    rows = folder / "rows.jsonl"
    return [json.loads(line) for line in rows.read_text("utf-8").splitlines()] if rows.is_file() else []


def bench_line(rows: list[dict[str, Any]]) -> str:
    """Seconds, scores and verdicts of rows, in words."""
    if not rows:
        return "no row"
    seconds = statistics.median(row["seconds"] for row in rows)
    flip = [row["flip"] for row in rows]
    above = max(row["reference_flip"] - row["floor_flip"] for row in rows)
    return (
        f"{rows[0]['machine']['device']}: {len(rows)} fits, median {seconds:.2f} s and "
        f"{statistics.median(row['processor_seconds'] for row in rows):.1f} CPU s; the first of its kind "
        f"{max(row['warm_up_seconds'] for row in rows):.1f} s more; FLIP at most {above:.4f} above the floor, of the "
        f"truth's picture median {statistics.median(flip):.4f}, worst {max(flip):.4f}"
    )


def run_frame(variant: str, job: Path, out: Path, repeat: int) -> str:
    """Seconds and peak memory of the process of a job's fit: the first, and the best of `repeat` more."""
    seconds, memory, said = [], 0.0, ""
    for _ in range(1 + repeat):
        copy = out / f"{variant}-job"
        shutil.rmtree(copy, ignore_errors=True)
        shutil.copytree(job, copy)
        began = time.monotonic()
        with Path(f"{out / variant}-frame.log").open("w") as log:
            words = [sys.executable, "-m", "mfo_backend", "run", str(copy), "--progress", "none"]
            process = subprocess.Popen(words, cwd=ROOT, stdout=log, stderr=subprocess.STDOUT, env=_with(variant))
            _, status, used = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode:
            return f"ended with {process.returncode}"
        seconds.append(time.monotonic() - began)
        memory = max(memory, used.ru_maxrss / 2**20)
        result = json.loads((copy / "result.json").read_text("utf-8"))
        before, after = result["errors"]["flip"]
        said = f"FLIP {before:.4f} -> {after:.4f}, verdict {result['verdict']}"
    shutil.rmtree(out / f"{variant}-job", ignore_errors=True)
    return f"first {seconds[0]:.1f} s, then {min(seconds[1:], default=seconds[0]):.1f} s, {memory:.2f} GiB; {said}"


def _with(variant: str) -> dict[str, str]:
    return {**os.environ, "MFO_VARIANT": variant}


def _said(variant: str, words: list[str], log: Path) -> str:
    with log.open("w", encoding="utf-8") as file:
        subprocess.run(
            [sys.executable, "-m", *words], cwd=ROOT, stdout=file, stderr=subprocess.STDOUT, env=_with(variant)
        )
    return re.sub(r"\x1b\[[0-9;]*m", "", log.read_text("utf-8", "replace"))


if __name__ == "__main__":
    main()
