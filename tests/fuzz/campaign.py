# SPDX-License-Identifier: Apache-2.0
"""All targets in turn, each in a process of its own, and what came of it: ``python -m tests.fuzz.campaign``.

Needs the package atheris in this Python. The corpus and the crashes stay in the folder, so that a second call goes on
where the first ended; the sums are kept there too and in the record that `docs/reliability.md` is made of.
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
        inputs, cpu, killed = _fuzz(name, chosen.folder, int(min(SLICE, max(5, end - time.monotonic()))))
        old = sums.get(name, {"inputs": 0, "cpu_seconds": 0.0, "killed": 0})
        sums[name] = {
            "inputs": old["inputs"] + inputs,
            "cpu_seconds": round(old["cpu_seconds"] + cpu, 1),
            "killed": old["killed"] + killed,
        }
        kept.write_text(json.dumps(sums, indent=1))
    places = sorted(p.name for p in (chosen.folder / "crashes").glob("*") if p.suffix != ".txt")
    print("\n".join(places) or "no crash")
    chosen.record.parent.mkdir(parents=True, exist_ok=True)
    chosen.record.write_text(json.dumps(sums, indent=1) + "\n")


def _fuzz(name: str, folder: Path, seconds: int) -> tuple[int, float, int]:
    """Inputs tried, processor seconds, and how many inputs ended the process."""
    artifacts = folder / "crashes"
    known = set(artifacts.glob("*_*-*"))
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    words = [sys.executable, "-m", "tests.fuzz.fuzz_one", name, str(folder), str(seconds)]
    done = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, errors="replace", env=dict(os.environ))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    log = folder / f"{name.replace(' ', '_')}.log"
    log.write_text((done.stdout + done.stderr)[-20_000:])
    found = re.search(r"stat::number_of_executed_units:\s*(\d+)", done.stdout + done.stderr)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    # an artifact without content is Mitsuba's own threads at the exit that libFuzzer calls, after the last input
    killers = [path for path in set(artifacts.glob("*_*-*")) - known if path.suffix != ".txt" and path.stat().st_size]
    if not found or killers:
        print(f"{name}: exit {done.returncode}, see {log}; {killers}", flush=True)
    return (int(found[1]) if found else 0), cpu, len([path for path in killers if "Error-" not in path.name])


if __name__ == "__main__":
    main()
