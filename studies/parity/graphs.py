# SPDX-License-Identifier: Apache-2.0
"""Pictures of the truth of twelve node graphs by recorded paths, against Cycles.

    python -m studies.parity.graphs ROWS [--graphs bump facing] [--lights lamp] [--size 256] [--samples 128]
        [--blender "blender"]

appends one JSON object for each graph and light to ROWS, skips those that are there, and prints each. Without
`--blender` scenes are built and rendered by this Python's `bpy`. Level is the difference of the pictures' means over
the target's inner pixels, as a share of Cycles' (two renders); `rms` that of the pictures themselves without their
noise, which two halves of either tell; FLIP is that of our picture and the first render, and that of both renders.
"""

from __future__ import annotations

import argparse
import json
import shlex
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..graphs.bumps import BUMPS
from ..graphs.head import LIGHTS
from ..graphs.subsurface import SUBSURFACE
from .cycles_parity import ROOT
from .graph_scene import CONSTANT

GRAPHS = (
    *("ramp", "roughness", "metallic", "bump", "coat_bump", "wave_bump", "hue", "facing", "brushed", "gradient"),
    *("checker", "mixed"),
)
RAYS = 4  # along each side of a pixel
RECORDINGS = {"lamp": 6, "probe": 16}  # averaged: light over other surfaces and that of a probe are sampled

Pixels = NDArray[np.float32]


def measure(graph: str, light: str, folder: Path, *, size: int, samples: int, blender: str | None) -> dict[str, Any]:
    """Build, export and render one graph with both; returns its row."""
    from mfo_backend.metrics.flip.flip_error import flip_error
    from mfo_backend.scene.image_file import read_image
    from mfo_backend.types.image import Encoding, Image

    begun = time.monotonic()
    words = [graph, light, str(folder), "--size", str(size), "--samples", str(samples)]
    script = Path(__file__).with_name("graph_scene.py")
    here = [sys.executable, "-m", "studies.parity.graph_scene"]
    there = [*shlex.split(blender or ""), *("--background", "--factory-startup", "--python-exit-code", "1")]
    command = [*there, "--python", str(script), "--", *words] if blender else [*here, *words]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    if done.returncode:
        raise RuntimeError(f"{graph}: Blender ended with {done.returncode}: {done.stderr[-2000:]}")
    cycles = [np.asarray(read_image(folder / f"cycles_{k}.exr").pixels, np.float32) for k in (0, 1)]
    halves, counted = recorded_truth(folder / "job", RECORDINGS[light])
    ours = np.mean(halves, axis=0, dtype=np.float32)

    def flip(other: Pixels) -> float:
        images = [Image(np.where(counted[..., None], each, 0.0), Encoding.LINEAR) for each in (cycles[0], other)]
        return float(flip_error(*images).map[counted].mean())

    inner = [picture[counted].astype(float) for picture in (*cycles, *halves)]
    both = float(np.mean(inner[:2]))
    square = float(np.mean((inner[0] - inner[2]) * (inner[1] - inner[3])))
    return {
        "graph": graph, "light": light, "size": size, "level": float(np.mean(inner[2:])) / both - 1.0,
        "rms": max(square, 0.0) ** 0.5 / both, "flip": flip(ours), "floor": flip(cycles[1]),
        "seconds": round(time.monotonic() - begun, 1),
    }  # fmt: skip


def recorded_truth(job: Path, recordings: int) -> tuple[list[Pixels], NDArray[np.bool_]]:
    """Two independent pictures of a job's material as it is in the scene, and the pixels that they are right in."""
    from mfo_backend.job.folder.job_folder import JobFolder
    from mfo_backend.job.folder.request import read_request
    from mfo_backend.job.run.job_scene import request_materials
    from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm
    from mfo_backend.render.paths.recorded_scene import RecordedScene
    from mfo_backend.render.pictures.mitsuba_renderer import MitsubaRenderer
    from mfo_backend.render.pictures.renderer import load_renderer

    if needs_llvm():
        configure_llvm()  # before the first import of drjit
    folder = JobFolder.open(job)
    request = read_request(folder)
    renderer = load_renderer(
        job / request.scene, request.target.shape_id, model="blender_principled", parameters=["ior"],
        materials=request_materials(folder, request), light_paths=request.light_paths,
    )  # fmt: skip
    assert isinstance(renderer, MitsubaRenderer)
    mask = renderer.target_mask()
    recorded = RecordedScene(renderer, int(mask.sum()))
    halves = [np.zeros((*mask.shape, 3), np.float32) for _ in range(2)]
    counted = np.zeros(mask.shape, bool)
    for seed in range(recordings):
        paths = recorded.record(renderer.start, grid=RAYS, seed=seed, near=True)
        groups = paths.pixel_groups(paths.interior)
        found = np.asarray(recorded.pictures(paths, groups)(renderer.start))[:, :, 0]
        halves[seed % 2].reshape(-1, 3)[groups.pixels] += found / np.float32(recordings / 2)
        counted.ravel()[groups.pixels] = True
    return halves, counted


def main() -> None:
    """Measure what is missing and print it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rows", type=Path)
    parser.add_argument(
        "--graphs", nargs="+", choices=[CONSTANT, *GRAPHS, *BUMPS, *SUBSURFACE], default=[CONSTANT, *GRAPHS]
    )
    parser.add_argument("--lights", nargs="+", choices=LIGHTS, default=list(LIGHTS))
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--samples", type=int, default=128)
    parser.add_argument("--blender", help="the program that builds and renders")
    chosen = parser.parse_args()
    rows = [json.loads(line) for line in chosen.rows.read_text("utf-8").splitlines()] if chosen.rows.is_file() else []
    known = {(row["graph"], row["light"], row["size"]) for row in rows}
    for light in chosen.lights:
        for graph in chosen.graphs:
            if (graph, light, chosen.size) in known:
                continue
            with tempfile.TemporaryDirectory() as folder:
                row = measure(
                    graph, light, Path(folder), size=chosen.size, samples=chosen.samples, blender=chosen.blender
                )
            with chosen.rows.open("a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")
            print(json.dumps(row), flush=True)


if __name__ == "__main__":
    main()
