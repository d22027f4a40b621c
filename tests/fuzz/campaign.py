# SPDX-License-Identifier: Apache-2.0
"""All targets in turn, each in a process of its own, and what came of it: ``python -m tests.fuzz.campaign``.

Needs the package atheris in this Python. The corpus and the crashes stay in the folder, so that a second call goes on
where the first ended; the sums are kept there too and in the record that `docs/reference/reliability.md` is made of.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NAMES = ("request.json", "result.json", "progress lines", "scene.xml", "exr", "hdr", "png", "jpg", "tif", "ply",
         "ply in Mitsuba")  # fmt: skip
SLICE = 60  # seconds for one target before the next has its turn


def main() -> None:
    """Fuzz for the given time and write the sums after every slice."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=3600, help="wall-clock time in all")
    parser.add_argument("--folder", type=Path, default=Path("/tmp/mfo-fuzz"), help="corpus, crashes, sums")
    parser.add_argument("--record", type=Path, default=ROOT / "docs" / "reliability" / "fuzz.json")
    chosen = parser.parse_args()
    chosen.folder.mkdir(parents=True, exist_ok=True)
    kept = chosen.folder / "sums.json"
    sums = json.loads(kept.read_text()) if kept.exists() else {}
    end = time.monotonic() + chosen.seconds
    while time.monotonic() < end:
        # the target with the least time so far
        name = min(NAMES, key=lambda n: sums.get(n, {}).get("cpu_seconds", 0.0))
        inputs, cpu = _fuzz(name, chosen.folder, int(min(SLICE, max(5, end - time.monotonic()))))
        old = sums.get(name, {"inputs": 0, "cpu_seconds": 0.0})
        sums[name] = {"inputs": old["inputs"] + inputs, "cpu_seconds": round(old["cpu_seconds"] + cpu, 1)}
        kept.write_text(json.dumps(sums, indent=1))
    found = crashes(chosen.folder)
    print("\n".join(path.name for path in found) or "no crash")
    record = {
        name: sums[name] | {"killed": sum(_is_of(path, name) for path in found)} for name in NAMES if name in sums
    }
    chosen.record.parent.mkdir(parents=True, exist_ok=True)
    chosen.record.write_text(json.dumps(record, indent=1) + "\n")


def crashes(folder: Path) -> list[Path]:
    """Inputs that raised something unexpected, ended the process, took too long or too much memory.

    An artifact without content is Mitsuba's own threads at the exit that libFuzzer calls, after the last input; slow
    units are those of a busy machine.
    """
    kinds = ("Error-", "Exception-", "_crash-", "_oom-", "_timeout-")
    found = (folder / "crashes").glob("*")
    return sorted(
        path for path in found
        if path.suffix != ".txt" and path.stat().st_size and any(kind in path.name for kind in kinds)
    )  # fmt: skip


def _is_of(path: Path, name: str) -> bool:
    return re.match(re.escape(name.replace(" ", "_")) + "(-|_crash|_oom|_timeout)", path.name) is not None


def _fuzz(name: str, folder: Path, seconds: int) -> tuple[int, float]:
    """Inputs tried and processor seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    words = [sys.executable, "-m", "tests.fuzz.fuzz_one", name, str(folder), str(seconds)]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, errors="replace", env=dict(os.environ))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    log = folder / f"{name.replace(' ', '_')}.log"
    log.write_text((done.stdout + done.stderr)[-20_000:])
    found = re.search(r"stat::number_of_executed_units:\s*(\d+)", done.stdout + done.stderr)
    if not found:
        print(f"{name}: exit {done.returncode}, see {log}", flush=True)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return (int(found[1]) if found else 0), cpu


if __name__ == "__main__":
    main()
