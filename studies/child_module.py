# SPDX-License-Identifier: Apache-2.0
"""Modules of this checkout in processes of their own, as a user runs them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

ROOT = Path(__file__).resolve().parents[1]
MATCHED_OR_NOT = (0, 5)  # exit codes of an `mfo` fit that came to its end


class Ended(NamedTuple):
    """A finished process: its exit code, and the JSON object that it printed last, empty where there is none."""

    code: int
    answer: dict[str, Any]


def run_module(module: str, *words: Any, allowed: tuple[int, ...] = (0,)) -> Ended:
    """Run ``python -m module words``.

    Raises
    ------
    RuntimeError
        With the sentence or the last lines of a program that ended with a code that is not allowed.
    """
    command = [sys.executable, "-m", module, *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    answer = json.loads(lines[-1]) if lines else {}
    if done.returncode not in allowed:
        raise RuntimeError(f"{module} ended with {done.returncode}: {answer.get('sentence', done.stderr[-500:])}")
    return Ended(done.returncode, answer)
