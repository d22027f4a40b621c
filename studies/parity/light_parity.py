# SPDX-License-Identifier: Apache-2.0
"""Every kind of light of exported scenes, here and in Cycles, with the noise taken out.

    python -m studies.parity.light_parity [--samples 4096] [--only "spread"]

writes docs/reference/light_parity.md. Needs a Python with `bpy`.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from .cycles_parity import Difference, compare, render_job, table_row
from .light_scene import FLOORS, SIZE, Lights, build

TABLE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "light_parity.md"


def measure(
    floor: str, lights: Lights, folder: Path, samples: int, cycles_samples: int | None = None
) -> tuple[Difference, list[str]]:
    """Build one scene and compare it; returns the difference and the exporter's notes."""
    return measure_scene(build(floor, lights), folder, samples, cycles_samples)


def measure_scene(
    target: Any, folder: Path, samples: int, cycles_samples: int | None = None
) -> tuple[Difference, list[str]]:
    """Compare the scene that is open; half of `samples` go into each of two renders.

    Cycles' own number of samples is `cycles_samples`, if that is given: its sequence is less noisy.
    """
    import bpy

    from blender_addon.export.job import export_job
    from mfo_backend.scene.image_file import read_image

    scene = bpy.context.scene
    scene.cycles.samples = (cycles_samples or samples) // 2
    halves = []
    for seed in range(2):
        scene.cycles.seed = seed
        path = folder / f"cycles_{seed}.exr"
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        halves.append(np.asarray(read_image(path).pixels, float))
    job = export_job(bpy.context, target, folder / "job", reference=folder / "cycles_0.exr", fit={})
    return compare(render_job(folder / "job", samples), (halves[0], halves[1])), list(job.notes)


INTRODUCTION = """# Lights here and in Cycles

`python -m studies.parity.light_parity` writes this file.
A floor under each light, {size}x{size} pixels, box filter, in Cycles
{version} with {samples} samples per pixel and in our renderer with as many. Both come in two halves, so that the noise
can be taken out; columns as in [cycles_parity.md](cycles_parity.md), in percent of the picture's mean. The shiny floor
is metal of roughness 0.1, whose light is nearly all met by rays that the material sends out. "Before": a dim light with
a size of about a metre hangs between a small bright one and the floor, and does not block it. "nodes": lights with
nodes over the matt floor, which Cycles measures for the export.

| floor | light | level | mean | rms | noise |
|---|---|---|---|---|---|
"""


def main() -> None:
    """Measure all scenes and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, default=4096)
    parser.add_argument("--only", default="", help="print the rows of lights with this in their names alone")
    chosen = parser.parse_args()
    import bpy

    rows = []
    for floor, cases in FLOORS.items():
        for name, lights in cases.items():
            if chosen.only not in f"{floor} {name}":
                continue
            with tempfile.TemporaryDirectory() as folder:
                found, notes = measure(floor, lights, Path(folder), chosen.samples)
            if notes:
                raise RuntimeError(f"{floor}, {name}: the exporter leaves something out: {' '.join(notes)}")
            rows.append(table_row(floor, name, found))
            print(rows[-1], flush=True)
    if not chosen.only:
        text = INTRODUCTION.format(size=SIZE, samples=chosen.samples, version=bpy.app.version_string.split()[0])
        TABLE.write_text(text + "\n".join(rows) + "\n", "utf-8")


if __name__ == "__main__":
    main()
