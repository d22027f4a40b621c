# SPDX-License-Identifier: Apache-2.0
"""The most memory a fit's process takes: `python -m studies.cost.peak_memory [--scenes 0 1] [--sizes 256 512 1024]`.

    python -m studies.cost.peak_memory [--scenario noise] [--scenes 0 1] [--sizes 256 512 1024] [--preset balanced]

Scenes are those of `mfo bench`. Reference and fit have processes of their own; printed is the resident memory of
the second at its peak, Python and Mitsuba included.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from studies.recovery.scene_fit import fit_to, open_bench_scene, reference_of, write_bench_scene

ROOT = Path(__file__).resolve().parents[2]

REFERENCE_SEED = 0x3E300000


def main() -> None:
    """Print a line for each scene and size; in a child, render or fit one."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenario", default="noise")
    parser.add_argument("--scenes", type=int, nargs="+", default=[0, 1])
    parser.add_argument("--sizes", type=int, nargs="+", default=[256, 512, 1024])
    parser.add_argument("--preset", default="balanced")
    parser.add_argument("--inside", nargs=2, metavar=("STEP", "FOLDER"), help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.inside:
        step, folder = chosen.inside[0], Path(chosen.inside[1])
        file = folder / "reference.npy"
        scene = write_bench_scene(chosen.scenario, chosen.scenes[0], chosen.sizes[0], folder / step)
        renderer, settings = open_bench_scene(scene, chosen.preset)
        if step == "render":
            np.save(file, reference_of(scene, renderer, REFERENCE_SEED))
            return
        began = time.monotonic()
        fit_to(renderer, np.load(file), settings)
        gib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        print(json.dumps({"seconds": time.monotonic() - began, "gib": gib}))
        return
    for size in chosen.sizes:
        for scene in chosen.scenes:
            with tempfile.TemporaryDirectory(prefix="mfo-memory-") as folder:
                what = [f"--scenario={chosen.scenario}", f"--preset={chosen.preset}", f"--scenes={scene}"]
                words = [sys.executable, "-m", "studies.cost.peak_memory", *what, f"--sizes={size}", "--inside"]
                subprocess.run([*words, "render", folder], check=True)
                done = subprocess.run([*words, "fit", folder], check=True, capture_output=True, text=True)
            said = json.loads(done.stdout.splitlines()[-1])
            print(
                f"{chosen.scenario} {scene} {size}x{size}: peak {said['gib']:.2f} GiB, {said['seconds']:.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
