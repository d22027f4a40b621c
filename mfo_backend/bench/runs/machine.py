# SPDX-License-Identifier: Apache-2.0
"""What a row was measured with: versions, commit, processor, threads."""

from __future__ import annotations

import platform
import subprocess
from pathlib import Path
from typing import Any

from ...job.output.result import versions


def machine_facts(variant: str, *, threads: int, import_seconds: float) -> dict[str, Any]:
    """Versions, Mitsuba variant, processor, threads of its kernels, and the commit of the checkout if it is one.

    Parameters
    ----------
    variant
        The one that is set.
    threads
        Those its kernels run on.
    import_seconds
        What importing Mitsuba and setting it took in this process.
    """
    return {
        "versions": versions(variant),
        "device": "GPU" if variant.startswith("cuda") else _processor(),
        "threads": threads,
        "import_seconds": import_seconds,
        "commit": source_commit(),
    }


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text("utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()


def source_commit() -> str:
    """Short commit id, ``+changes`` where sources differ from it, empty outside of a checkout."""
    root = Path(__file__).resolve().parents[3]

    def git(*words: str) -> str:
        done = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True, timeout=10, check=True)
        return done.stdout.strip()

    try:
        if not (root / ".git").exists():
            return ""
        changed = git("status", "--porcelain", "--", "mfo_backend")
        return git("rev-parse", "--short", "HEAD") + ("+changes" if changed else "")
    except (OSError, subprocess.SubprocessError):
        return ""
