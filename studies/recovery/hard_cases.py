# SPDX-License-Identifier: Apache-2.0
"""The hard cases, each with many seeds.

    python -m studies.recovery.hard_cases [--seeds 12] [--size 64] [--case NAME ...] [--preset balanced] [--rows FILE]

Every run is one line of the rows' file, so a run that was stopped goes on where it was; the table goes to stdout.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def main() -> None:
    """Measure what is missing, then print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--case", action="append")
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("--rows", type=Path, default=Path("hard.jsonl"))
    arguments = parser.parse_args()
    from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm

    if needs_llvm():
        configure_llvm()
    from mfo_backend.bench.report.hard_section import hard_table
    from mfo_backend.bench.runs.hard_runs import HardRun, run_hard_case
    from mfo_backend.bench.scenes.hard_cases import HARD_CASES

    rows = arguments.rows.read_text("utf-8").splitlines() if arguments.rows.exists() else []
    runs = [HardRun(**{k: tuple(v) if isinstance(v, list) else v for k, v in json.loads(row).items()}) for row in rows]
    done = {(run.case, run.seed) for run in runs}
    for seed in range(arguments.seeds):
        for name in arguments.case or HARD_CASES:
            if (name, seed) in done:
                continue
            with tempfile.TemporaryDirectory() as folder:
                run = run_hard_case(HARD_CASES[name], seed, arguments.size, Path(folder), arguments.preset)
            runs.append(run)
            with arguments.rows.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(run)) + os.linesep)
            print(f"{name} {seed}: {'solved' if run.solved else 'NOT solved'}, {run.error:.4g}", file=sys.stderr)
    print("\n".join(hard_table([asdict(run) for run in runs]).markdown()))


if __name__ == "__main__":
    main()
