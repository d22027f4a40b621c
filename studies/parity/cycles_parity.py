# SPDX-License-Identifier: Apache-2.0
"""Our render of an exported scene against the Cycles render of the same scene, with the noise taken out.

    python -m studies.parity.cycles_parity [--size 128] [--samples 512] [--spp 512] [--only glass/area ...]

writes docs/reference/cycles_parity.md, unless only some scenes are asked for. Needs a Python with `bpy`.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import textwrap
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .parity_scene import LIGHTS, MATERIALS

ROOT = Path(__file__).resolve().parents[2]

TABLE = ROOT / "docs" / "reference" / "cycles_parity.md"
WIDTH = 118  # of a line of the page
BLOCK = 4  # pixels along each side of the means that are compared
SPP_AT_ONCE = 256  # 1024 samples of 32 x 32 pixels take 0.22 processor seconds, and 0.6 with 32 at once
NOISY = {"glass": (2, 4)}  # smaller by, and more samples by: caustics
CONFIDENCE = 1.64  # standard deviations that 95 % of normal draws stay below
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Difference:
    """Ours minus Cycles, in parts of the mean of the Cycles picture; all but `noise` have the noise taken out."""

    level: float  # of the means of the pictures
    level_sd: float
    at_least: float  # mean absolute difference of the blocks: a lower bound that is tight where noise is small
    at_most: float  # root of the mean squared difference, 95 % of the time smaller: an upper bound of the same
    noise: float  # mean absolute difference of the halves of the pictures, halved


def compare(ours: tuple[Array, Array], cycles: tuple[Array, Array]) -> Difference:
    """Compare two independent renders each (height, width, 3) of what should be the same picture.

    The differences of the first and of the second halves share what differs but not the noise, so the mean of their
    product is the squared difference itself, and the mean of one by the other's sign falls short of the absolute
    difference only where noise turns the sign.
    """
    blocks = [[_blocks(picture) for picture in pair] for pair in (ours, cycles)]
    scale = float(np.mean(blocks[1]))
    first, second = ((blocks[0][k] - blocks[1][k]) / scale for k in (0, 1))
    products = (first * second).mean(axis=-1)
    square = float(np.mean(products)) + CONFIDENCE * float(np.std(products)) / products.size**0.5
    signed = 0.5 * float(np.mean(np.sign(first) * second + np.sign(second) * first))
    halves = 0.5 * (first - second)
    return Difference(
        level=0.5 * float(np.mean(first + second)),
        level_sd=float(np.std(halves.mean(axis=-1))) / halves[..., 0].size ** 0.5,
        at_least=max(signed, 0.0),
        at_most=max(square, 0.0) ** 0.5,
        noise=float(np.mean(np.abs(halves))),
    )


def _blocks(picture: Array) -> Array:
    height, width = (n // BLOCK for n in picture.shape[:2])
    return picture.reshape(height, BLOCK, width, BLOCK, 3).mean(axis=(1, 3), dtype=np.float64)


def render_job(job: Path, spp: int, free: str = "base_color") -> tuple[Array, Array]:
    """Two renders of a job's scene with Blender's model, half of `spp` each; one value is `free`, without a texture."""
    from mfo_backend.job.folder.job_folder import JobFolder
    from mfo_backend.job.folder.request import read_request
    from mfo_backend.job.run.job_scene import request_materials
    from mfo_backend.render.machine.llvm import configure_llvm, needs_llvm
    from mfo_backend.render.pictures.renderer import load_renderer

    if needs_llvm():
        configure_llvm()  # before the first import of drjit
    folder = JobFolder.open(job)
    request = read_request(folder)
    renderer = load_renderer(
        job / request.scene,
        request.target.shape_id,
        model="blender_principled",
        parameters=[free],
        materials=request_materials(folder, request),
        light_paths=request.light_paths,
    )
    at_once = max(1, min(SPP_AT_ONCE, spp // 2))
    rounds = max(1, spp // (2 * at_once))
    halves = [
        np.mean(
            [renderer.image(renderer.start, seed=half * rounds + k, spp=at_once).astype(float) for k in range(rounds)],
            axis=0,
        )
        for half in (0, 1)
    ]
    return halves[0], halves[1]


def measure(material: str, light: str, folder: Path, *, size: int, samples: int, spp: int) -> tuple[Difference, list]:
    """Build, export and render one scene with both; returns the difference and the exporter's notes."""
    from mfo_backend.scene.image_file import read_image

    command = [sys.executable, "-m", "studies.parity.parity_scene", material, light, str(folder)]
    done = subprocess.run(
        [*command, "--size", str(size), "--samples", str(samples)], capture_output=True, text=True, cwd=ROOT
    )
    if done.returncode:
        raise RuntimeError(f"{material}/{light}: Blender ended with {done.returncode}: {done.stderr[-2000:]}")
    notes = json.loads(done.stdout.strip().splitlines()[-1])["notes"]
    pictures = [np.asarray(read_image(folder / f"cycles_{k}.exr").pixels, float) for k in (0, 1)]
    return compare(render_job(folder / "job", spp), (pictures[0], pictures[1])), notes


INTRODUCTION = """# Exported scenes here and in Cycles

`python -m studies.parity.cycles_parity` writes this file.
A ball on a floor, {size}x{size} pixels, box filter, in Cycles 5.0.1
with {samples} samples per pixel and, exported by the add-on, in our renderer with the model `blender_principled` and
{spp}; glass, with its caustics, in half the size with {more} times the samples. Both renders come in two halves with
seeds of their own, so that the noise can be taken out: the halves' differences share nothing but the difference of the
renderers. Compared are means over {block}x{block} pixels, in percent of the picture's mean:

- level: difference of the means of whole pictures, with its standard deviation;
- mean: mean absolute difference, a lower bound, tight where the noise is small;
- rms: root of the mean squared difference, with 95 % confidence, an upper bound of the mean absolute difference;
- noise: mean absolute noise of what is compared.

| material | light | level | mean | rms | noise |
|---|---|---|---|---|---|
"""


def table_row(material: str, light: str, found: Difference) -> str:
    """One line of the table, in percent."""
    level = f"{100 * found.level:+.2f} ± {100 * found.level_sd:.2f}"
    rest = " | ".join(f"{100 * number:.2f}" for number in (found.at_least, found.at_most, found.noise))
    return f"| {material} | {light} | {level} | {rest} |"


def main() -> None:
    """Measure all scenes and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--spp", type=int, default=512)
    parser.add_argument("--only", nargs="*", metavar="MATERIAL/LIGHT", help="print the rows of these scenes alone")
    chosen = parser.parse_args()
    scenes = [(m, light) for m in MATERIALS for light in LIGHTS if not chosen.only or f"{m}/{light}" in chosen.only]
    rows, notes = [], []
    with tempfile.TemporaryDirectory() as folder:
        for k, (material, light) in enumerate(scenes):
            smaller, more = NOISY.get(material, (1, 1))
            size, samples, spp = chosen.size // smaller, chosen.samples * more, chosen.spp * more
            found, said = measure(material, light, Path(folder) / str(k), size=size, samples=samples, spp=spp)
            rows.append(table_row(material, light, found))
            notes += [note for note in said if note not in notes]
            print(rows[-1], flush=True)
    if not chosen.only:
        numbers = {"size": chosen.size, "samples": chosen.samples, "spp": chosen.spp, "more": NOISY["glass"][1]}
        text = INTRODUCTION.format(**numbers, block=BLOCK)
        said = "\n\n" + textwrap.fill("Notes of the exporter: " + " ".join(notes), WIDTH) if notes else ""
        TABLE.write_text(text + "\n".join(rows) + said + "\n", "utf-8")


if __name__ == "__main__":
    main()
