# SPDX-License-Identifier: Apache-2.0
"""Whole jobs far beyond the usual size: ``python -m tests.faults.heavy``; record: `docs/reference/reliability.md`.

A picture of 4096 x 4096 pixels and an object of two million triangles, exported from Blender.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any

from ..stability.test_extremes import POINT, SKY
from .limits import job
from .scene import ROOT, environment

PIXELS = 4096
SEGMENTS = 1000  # squared: patches of two triangles


def main() -> None:
    """Run everything and write what came of it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--record", type=Path, default=ROOT / "docs" / "reliability" / "heavy.json")
    chosen = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory(prefix="mfo-heavy-") as folder:
        for row in chain(large_pictures(Path(folder), PIXELS), many_triangles(Path(folder), SEGMENTS)):
            rows.append(row)
            print(json.dumps(row), flush=True)
    chosen.record.parent.mkdir(parents=True, exist_ok=True)
    chosen.record.write_text(json.dumps(rows, indent=1) + "\n")


def large_pictures(folder: Path, size: int) -> Iterator[dict[str, Any]]:
    """Fits of a sphere to references of `size` squared pixels."""
    cases = (("point light", POINT.format(40.0), "fast"), ("sky", SKY.format(1.0), "balanced"))
    for light, text, preset in cases:
        path = job(folder, size, text, preset=preset)
        yield measured(f"fit, {size}x{size}, {light}, {preset}", "-m", "mfo_backend", "run", path, "--progress", "none")


def many_triangles(folder: Path, segments: int, size: int = 128) -> Iterator[dict[str, Any]]:
    """The export of a sphere of 2 `segments`**2 triangles from Blender, and a fit of it."""
    path, count = folder / "triangles", 2 * segments**2
    yield measured(f"export, {count:,} triangles", "-m", "tests.faults.heavy_export", path, str(segments), str(size))
    yield measured(f"fit, {count:,} triangles, fast", "-m", "mfo_backend", "run", path, "--progress", "none")


def measured(what: str, *words: str | Path) -> dict[str, Any]:
    """A process of this Python: exit code, last line on stderr, peak resident memory in MB and processor seconds."""
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            [sys.executable, *map(str, words)], cwd=ROOT, env=environment(), stdout=subprocess.DEVNULL, stderr=errors
        )
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        errors.seek(0)
        lines = errors.read().decode("utf-8", "replace").split("\n")
    said = [line.removeprefix("mfo: ") for line in lines if line.startswith("mfo: ")]
    return {
        "what": what,
        "exit": process.returncode,
        "sentence": said[0] if said else "",
        "megabytes": round(usage.ru_maxrss / 1024),
        "cpu_seconds": round(usage.ru_utime + usage.ru_stime),
    }


if __name__ == "__main__":
    main()
