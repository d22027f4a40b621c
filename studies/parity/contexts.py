# SPDX-License-Identifier: Apache-2.0
"""Pictures of the truth among surfaces and under worlds that Cycles bakes, against Cycles itself.

    python -m studies.parity.contexts ROWS [--only "sky with sun"] [--seeds 1] [--size 64] [--samples 256]

appends one JSON object for each context and seed to ROWS, skips those that are there, and prints them all. Level is
the difference of the pictures' means, in parts of Cycles'; FLIP of two Cycles renders is the floor.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .context_scene import SURFACES, WORLDS
from .cycles_parity import ROOT, render_job

LEVEL, FLIP = 0.01, 0.01  # what a context may differ by: share of the level, FLIP above the floor


def measure(context: str, seed: int, folder: Path, *, size: int, samples: int) -> dict[str, Any]:
    """Build, export and render one context with both; returns its row."""
    from mfo_backend.scene.image_file import read_image

    words = [context, str(folder), "--seed", str(seed), "--size", str(size), "--samples", str(samples)]
    command = [sys.executable, "-m", "studies.parity.context_scene", *words]
    begun = time.monotonic()
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    if done.returncode:
        raise RuntimeError(f"{context}: Blender ended with {done.returncode}: {done.stderr[-2000:]}")
    notes = json.loads(done.stdout.strip().splitlines()[-1])["notes"]
    cycles = [np.asarray(read_image(folder / f"cycles_{k}.exr").pixels, np.float32) for k in (0, 1)]
    ours = [half.astype(np.float32) for half in render_job(folder / "job", 8 * samples)]
    both = float(np.mean(cycles))
    return {
        "context": context,
        "seed": seed,
        "level": float(np.mean(ours)) / both - 1.0,
        "flip": _flip(cycles[0], ours[0]),
        "floor": _flip(cycles[0], cycles[1]),
        "seconds": round(time.monotonic() - begun, 1),
        "notes": [note for note in notes if "Cycles" in note and "Clamping" not in note],
    }


def _flip(reference: NDArray[np.float32], test: NDArray[np.float32]) -> float:
    """Mean FLIP of two scene-linear pictures, exposed so that the reference's mean is a middle grey."""
    from mfo_backend.metrics.flip.ldr_flip import flip_map

    exposure = 0.18 / float(np.mean(reference))
    shown = [np.clip(picture * exposure, 0.0, 1.0) ** (1.0 / 2.2) for picture in (reference, test)]
    return float(np.mean(flip_map(shown[0], shown[1])))


def holds(row: dict[str, Any]) -> bool:
    """Whether a context is as near to Cycles as it should be."""
    return abs(row["level"]) <= LEVEL and row["flip"] <= row["floor"] + FLIP


def main() -> None:
    """Measure what is missing and print everything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rows", type=Path)
    parser.add_argument("--only", nargs="*", metavar="CONTEXT")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--samples", type=int, default=256)
    chosen = parser.parse_args()
    rows = [json.loads(line) for line in chosen.rows.read_text("utf-8").splitlines()] if chosen.rows.is_file() else []
    known = {(row["context"], row["seed"]) for row in rows}
    for context in [name for name in (*WORLDS, *SURFACES) if not chosen.only or name in chosen.only]:
        for seed in range(chosen.seeds):
            if (context, seed) in known:
                continue
            try:
                with tempfile.TemporaryDirectory() as folder:
                    row = measure(context, seed, Path(folder), size=chosen.size, samples=chosen.samples)
            except RuntimeError as error:
                print(error, flush=True)
                continue
            rows.append(row)
            with open(chosen.rows, "a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            print(_line(row), flush=True)
    print(f"{sum(map(holds, rows))} of {len(rows)} hold")


def _line(row: dict[str, Any]) -> str:
    verdict = "holds" if holds(row) else "FAILS"
    return (
        f"{row['context']:20s} {row['seed']} level {100 * row['level']:+.2f} % FLIP {row['flip']:.4f} "
        f"floor {row['floor']:.4f} {verdict} {row['seconds']:.0f} s"
    )


if __name__ == "__main__":
    main()
