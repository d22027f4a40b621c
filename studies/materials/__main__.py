# SPDX-License-Identifier: Apache-2.0
"""Rooms of six unknown materials, fitted together to one picture by Cycles and judged in Cycles: one row for each.

    python -m studies.materials OUT.jsonl --numbers 0-9 --size 96 --preset balanced

A row has for each material the mean FLIP of Cycles' picture of the fitted room and that of the floor, a second picture
of the truth: both against the reference, on the pixels that see the material. The goal is a difference of at most 0.01.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.flip.flip_error import flip_error
from mfo_backend.scene.image_file import read_image
from mfo_backend.types.image import Image

ROOT = Path(__file__).resolve().parents[2]
OBJECTS = ("Floor", "Walls", "Chest", "Ball", "Vase", "Shade")
WITHIN = 0.01  # FLIP above the floor
ROOMS = "studies.materials.scene"
_ENDS = (0, 5)  # exit codes of a fit that came to its end: matched or not


def measure(number: int, folder: Path, size: int, preset: str) -> dict[str, Any]:
    """The row of one room."""
    _run(ROOMS, "build", number, folder, "--size", size)
    pictures = {}
    for name, file, seed in (("reference", "truth", 3), ("floor", "truth", 4)):
        pictures[name] = folder / f"{name}.exr"
        _run(ROOMS, "render", folder / f"{file}.blend", pictures[name], seed)
    words = [word for name in OBJECTS for word in ("--object", name)]
    began, cpu = time.monotonic(), _child_seconds()
    result = _run(
        "mfo_backend", "blend", folder / "start.blend", *words, "--reference", pictures["reference"],
        "--preset", preset, "--out", folder / "job", "--apply", "--force", "--save-as",
        folder / "fitted.blend", "--json",
    )  # fmt: skip
    seconds, cpu = time.monotonic() - began, _child_seconds() - cpu
    pictures["fitted"] = folder / "fitted.exr"
    _run(ROOMS, "render", folder / "fitted.blend", pictures["fitted"], 5)
    images = {name: read_image(path, None) for name, path in pictures.items()}
    row: dict[str, Any] = {"number": number, "size": size, "preset": preset, "seconds": seconds, "cpu": cpu}
    row["fit_seconds"], row["verdict"], row["materials"] = result["seconds"], result["verdict"], {}
    for found in result["materials"]:
        seen = read_image(folder / "job" / found["folder"] / "pictures" / "counted.png", None).pixels[..., 0] > 0.5
        floor, fitted = (_flip(images["reference"], images[name], seen) for name in ("floor", "fitted"))
        row["materials"][found["object"]] = {
            "pixels": int(seen.sum()), "floor": floor, "fitted": fitted, "verdict": found["verdict"],
            "recovered": found["recovered"],
        }  # fmt: skip
    row["truth"] = json.loads((folder / "truth.json").read_text("utf-8"))
    return row


def _flip(reference: Image, test: Image, mask: np.ndarray) -> float:
    view = DisplayView.for_scene(reference.pixels, mask)
    return float(flip_error(reference, test, display=view).map[mask].mean(dtype=np.float64))


def _child_seconds() -> float:
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def summary(rows: list[dict[str, Any]]) -> str:
    """The rows in a few lines."""
    lines = [
        "| room | worst material | FLIP above floor | within 0.01 | verdict | seconds | processor |",
        "|---|---|---|---|---|---|---|",
    ]
    good = 0
    for row in rows:
        above = {name: found["fitted"] - found["floor"] for name, found in row["materials"].items()}
        worst = max(above, key=lambda name: above[name])
        within = sum(value <= WITHIN for value in above.values())
        good += within == len(above)
        lines.append(
            f"| {row['number']} | {worst} | {above[worst]:.4f} | {within} of {len(above)} | {row['verdict']} | "
            f"{row['seconds']:.0f} | {row['cpu']:.0f} |"
        )
    return "\n".join([*lines, "", f"All materials within {WITHIN} of the floor in {good} of {len(rows)} rooms."])


def _run(module: str, *words: Any) -> dict[str, Any]:
    done = subprocess.run(
        [sys.executable, "-m", module, *map(str, words)],
        capture_output=True, text=True, cwd=ROOT, check=False, env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    if done.returncode not in _ENDS:
        raise RuntimeError(f"{module} ended with {done.returncode}: {done.stderr[-500:]}")
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    return json.loads(lines[-1]) if lines else {}


def main() -> None:
    """Measure the rooms that have no row yet, then print the summary."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", type=Path)
    parser.add_argument("--numbers", default="0-9", help="first-last")
    parser.add_argument("--size", type=int, default=96, help="pixels along a side")
    parser.add_argument("--preset", default="balanced")
    chosen = parser.parse_args()
    first, last = map(int, chosen.numbers.split("-"))
    text = chosen.rows.read_text("utf-8") if chosen.rows.exists() else ""
    rows = [json.loads(line) for line in text.splitlines()]
    for number in range(first, last + 1):
        if number in {row["number"] for row in rows}:
            continue
        with tempfile.TemporaryDirectory() as folder:
            rows.append(measure(number, Path(folder), chosen.size, chosen.preset))
        with chosen.rows.open("a", encoding="utf-8") as file:
            file.write(json.dumps(rows[-1]) + "\n")
    print(summary(rows))


if __name__ == "__main__":
    main()
