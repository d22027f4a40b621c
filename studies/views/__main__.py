# SPDX-License-Identifier: Apache-2.0
"""Several pictures of a material and the proposal of the next: one row for each scene, and a summary.

    python -m studies.views OUT.jsonl --numbers 0-19

A scene's material is fitted to one picture; to that and the proposed one; to that and one drawn at random; to all
three; and to all three when the second was rendered under another lamp than its scene has.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from .summary import summary

ROOT = Path(__file__).resolve().parents[2]
TURNS = range(30, 360, 30)  # degrees around the target that a camera stands at, as `scene` makes them
_ENDS = (0, 5)  # exit codes of a fit that came to its end: matched or not


def measure(number: int, folder: Path) -> dict[str, Any]:
    """The row of one scene."""
    run_module("studies.views.scene", "build", number, folder)
    front = rendered(folder, "Front")
    one = fit(folder, [front])
    proposal = one.get("next_picture")
    draw = random.Random(1000 + number)
    turns = [f"T{turn:03d}" for turn in TURNS]
    proposed = f"T{round(proposal['turn']) % 360:03d}" if proposal else draw.choice(turns)
    drawn = draw.choice([turn for turn in turns if turn != proposed])
    second, third = rendered(folder, proposed), rendered(folder, drawn)
    wrong = rendered(folder, proposed, moved=True)
    return {
        "number": number,
        "proposal": proposal,
        "cameras": [proposed, drawn],
        "one": _short(one),
        "proposed": _short(fit(folder, [front, second])),
        "drawn": _short(fit(folder, [front, third])),
        "three": _short(fit(folder, [front, second, third])),
        "planted": _short(fit(folder, [front, wrong, third])),
    }


def rendered(folder: Path, camera: str, *, moved: bool = False) -> tuple[Path, str]:
    """The truth from a camera, and the camera's name."""
    file = folder / f"{camera}{'_moved' if moved else ''}.exr"
    run_module("studies.views.scene", "render", folder, camera, file, *(["--moved"] if moved else []))
    return file, camera


def fit(folder: Path, pictures: list[tuple[Path, str]]) -> dict[str, Any]:
    """The result of one job over all pictures."""
    words = [word for file, camera in pictures for word in ("--reference", f"{file}@camera={camera}")]
    return run_module(
        "mfo_backend", "blend", folder / "start.blend", "--object", "Target", *words, "--out", folder / "job", "--json"
    )


def _short(result: dict[str, Any]) -> dict[str, Any]:
    """What the summary asks for."""
    certainty = {name: {"level": c["level"], "sd": max(c["sd"])} for name, c in result.get("certainty", {}).items()}
    keys = ("verdict", "seconds", "contradiction", "recovered", "bounds")
    return {key: result.get(key) for key in keys} | {"certainty": certainty}


def run_module(module: str, *words: Any) -> dict[str, Any]:
    """What a module of this checkout answers last, as JSON."""
    done = subprocess.run(
        [sys.executable, "-m", module, *map(str, words)], capture_output=True, text=True, cwd=ROOT, check=False
    )
    if done.returncode not in _ENDS:
        raise RuntimeError(f"{module} ended with {done.returncode}: {done.stderr[-500:]}")
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    return json.loads(lines[-1]) if lines else {}


def main() -> None:
    """Measure the scenes that have no row yet, then print the summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", type=Path)
    parser.add_argument("--numbers", default="0-19", help="first-last")
    chosen = parser.parse_args()
    first, last = map(int, chosen.numbers.split("-"))
    text = chosen.rows.read_text("utf-8") if chosen.rows.exists() else ""
    rows = [json.loads(line) for line in text.splitlines()]
    for number in range(first, last + 1):
        if number in {row["number"] for row in rows}:
            continue
        with tempfile.TemporaryDirectory() as folder:
            rows.append(measure(number, Path(folder)))
        with chosen.rows.open("a", encoding="utf-8") as file:
            file.write(json.dumps(rows[-1]) + "\n")
    print(summary(rows))


if __name__ == "__main__":
    main()
