# SPDX-License-Identifier: Apache-2.0
"""What a fit of a large frame takes, from the start of its process: `python -m studies.cost.large_frames`; needs bpy.

    python -m studies.cost.large_frames [--frames 256x256 1920x1080] [--lenses 1 0.5] [--samples 64] [--repeat 2]

The scene of `mfo demo`, rendered by Cycles, through its own lens and through one of half the length, where the object
is small. A first fit that is not counted fills the kernel cache.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from studies.cost.cold_start import child

ROOT = Path(__file__).resolve().parents[2]

_FRAME = """import bpy, sys
source, width, height, lens, target = sys.argv[1:]
bpy.ops.wm.open_mainfile(filepath=source)
scene = bpy.context.scene
scene.render.resolution_x, scene.render.resolution_y = int(width), int(height)
scene.camera.data.lens *= float(lens)
bpy.ops.wm.save_as_mainfile(filepath=target)
"""


def main() -> None:
    """Print a line for each frame and lens."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", nargs="+", default=["256x256", "1920x1080"])
    parser.add_argument("--lenses", nargs="+", default=["1", "0.5"])
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--repeat", type=int, default=2)
    chosen = parser.parse_args()
    for frame in chosen.frames:
        for lens in chosen.lenses:
            with tempfile.TemporaryDirectory(prefix="mfo-frames-") as folder:
                job = make_job(Path(folder), frame.split("x"), lens, chosen.samples)
                runs = [run_job(job) for _ in range(1 + chosen.repeat)][1:]
                said = json.loads((job / "result.json").read_text())
                share = share_counted(job)
            seconds, gib = min(run[0] for run in runs), max(run[1] for run in runs)
            before, after = said["errors"]["flip"]
            print(
                f"{frame}, lens {lens}: target {100 * share:.0f} % of the frame; {seconds:.1f} s, {gib:.2f} GiB; "
                f"FLIP {before:.3f} -> {after:.3f}, model gap at most {100 * said['model_gap']['at_most']:.2g} %",
                flush=True,
            )


def make_job(folder: Path, frame: list[str], lens: str, samples: int) -> Path:
    """The job folder of the demo's scene in a frame of (width, height) pixels."""
    _blender("demo-scene", folder, "--scene-seed", 1)
    for name in ("truth", "start"):
        blend = str(folder / f"{name}.blend")
        child(["-c", _FRAME, blend, *frame, lens, blend])
    reference = folder / "reference.exr"
    _blender("render", folder / "truth.blend", "--out", reference, "--samples", samples)
    words = ("--object", "Suzanne", "--reference", reference, "--job", folder / "job")
    _blender("export", folder / "start.blend", *words)
    return folder / "job"


def run_job(job: Path) -> tuple[float, float]:
    """Seconds and peak memory (GiB) of the process of a fit."""
    began = time.monotonic()
    words = [sys.executable, "-m", "mfo_backend", "run", str(job), "--progress", "none"]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.DEVNULL) as process:
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise SystemExit(f"The fit ended with {process.returncode}.")
    return time.monotonic() - began, used.ru_maxrss / 2**20


def share_counted(job: Path) -> float:
    """The share of the frame that the errors are of."""
    from mfo_backend.report.picture import mask_from_png

    return float(mask_from_png((job / "pictures" / "counted.png").read_bytes()).mean())


def _blender(*words: object) -> None:
    child(["-m", "blender_addon.headless", *map(str, words)])


if __name__ == "__main__":
    main()
