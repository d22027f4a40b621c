# SPDX-License-Identifier: Apache-2.0
"""Materials recovered from Cycles' pictures and judged in Cycles: the demo's scene and others with random materials.

    python -m bench.cycles_recovery [--size 128] [--samples 512] [--only 1/environment ...] [--out DIR]

writes docs/cycles_recovery.md. Needs a Python with `bpy`.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
TABLE = ROOT / "docs" / "cycles_recovery.md"
# the demo's own scene, then two of each light; the seed draws material, start, world and the light's place
SCENES = (
    (1, "environment"),
    (2, "environment"),
    (3, "environment"),
    (4, "point"),
    (5, "point"),
    (6, "area"),
    (7, "area"),
    (8, "sun"),
    (9, "sun"),
)
REFERENCE_SEED, JUDGE_SEED = 0, 1  # Cycles' noise of the judged pictures is not the reference's
OWN_SAMPLES = 2  # for one of Cycles: ours are independent, its are stratified
LIMIT = 0.012
KEPT = "recovery.json"


@dataclass(frozen=True)
class Recovery:
    """Mean FLIP against the reference, of Cycles renders but for `model`, and the seconds of the fit."""

    before: float
    after: float
    floor: float  # the true material with the noise of the judged pictures
    paired: float  # not against the reference: recovered against true material, both with the noise of the judge
    model: float  # our own render of the true material
    seconds: float
    notes: tuple[str, ...]


def recover(seed: int, light: str, folder: Path, *, size: int, samples: int) -> Recovery:
    """Build a scene, fit it with `mfo blend --preset balanced --apply` and judge the saved file.

    Raises
    ------
    RuntimeError
        With the last lines of whichever program failed.
    """
    from mfo_backend.metrics.flip_error import flip_error
    from mfo_backend.metrics.tone_mapping import DisplayView
    from mfo_backend.scene.image_file import read_image
    from mfo_backend.types.image import Encoding, Image

    from .cycles_parity import render_job

    scene = _run("bench.recovery_scene", seed, light, folder, "--size", size)

    def render(blend: str, picture: str, noise: int) -> Image:
        words = ("--out", folder / picture, "--samples", samples, "--seed", noise)
        _run("blender_addon.headless", "render", folder / blend, *words)
        return read_image(folder / picture)

    reference = render("truth.blend", "reference.exr", REFERENCE_SEED)
    judged = {"floor": render("truth.blend", "floor.exr", JUDGE_SEED)}
    judged["before"] = render("start.blend", "before.exr", JUDGE_SEED)
    common = ("--object", scene["object"], "--reference", folder / "reference.exr")
    options = ("--preset", "balanced", "--out", folder / "job", "--apply", "--save-as", folder / "recovered.blend")
    result = _run("mfo_backend", "blend", folder / "start.blend", *common, *options, "--json")
    judged["after"] = render("recovered.blend", "after.exr", JUDGE_SEED)
    _run("blender_addon.headless", "export", folder / "truth.blend", *common, "--job", folder / "truth")
    ours = np.mean(render_job(folder / "truth", OWN_SAMPLES * samples), axis=0).astype(np.float32)
    judged["model"] = Image(ours, Encoding.LINEAR)
    view = DisplayView()
    flips = {name: flip_error(reference, picture, display=view).mean for name, picture in judged.items()}
    flips["paired"] = flip_error(judged["floor"], judged["after"], display=view).mean
    found = Recovery(**flips, seconds=result["seconds"], notes=tuple(result["notes"]))
    (folder / KEPT).write_text(json.dumps(asdict(found)))
    return found


def _kept(folder: Path) -> Recovery | None:
    """What an earlier run found."""
    if not (folder / KEPT).is_file():
        return None
    found = json.loads((folder / KEPT).read_text())
    return Recovery(**found | {"notes": tuple(found["notes"])})


def _run(module: str, *words: Any) -> dict[str, Any]:
    """The JSON object on the last line of a Python module's output."""
    command = [sys.executable, "-m", module, *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    answer = json.loads(lines[-1]) if lines else {}
    if done.returncode or not lines:
        raise RuntimeError(f"{module} ended with {done.returncode}: {answer.get('sentence', done.stderr[-500:])}")
    return answer


INTRODUCTION = """# Materials recovered from Cycles' pictures

`python -m bench.cycles_recovery` writes this file. Scene 1 is that of `mfo demo`; the others have its head and table
with other random materials, starts and lights: {size}x{size} pixels, {samples} samples per pixel, Blender 5.0.1 and its
own render settings but for adaptive sampling and denoising. `mfo blend --preset balanced` fits all parameters to a
Cycles render, and Cycles renders the saved result with another seed. Mean FLIP of the whole picture against the
reference:

- before, after: Cycles' render of the start and of the recovered material;
- floor: Cycles' render of the true material, which differs by noise alone;
- same noise: Cycles' render of the recovered against that of the true material, both with the seed of the judge, so
  that most of the noise is in both: what the fit has lost;
- model gap: our own render of the true material. Above the floor it is what the export and the renderer lose, and the
  noise of our render, which has {own} times the samples but independent ones.

| scene | light | before | after | floor | same noise | model gap | fit |
|---|---|---|---|---|---|---|---|
"""


def table_row(seed: int, light: str, found: Recovery) -> str:
    """One line of the table."""
    flips = (found.before, found.after, found.floor, found.paired, found.model)
    return f"| {seed} | {light} | " + " | ".join(f"{flip:.4f}" for flip in flips) + f" | {found.seconds:.0f} s |"


def summary(found: Sequence[Recovery], tried: int) -> str:
    """How many were good enough, how many could not be told from the noise, and what was worst."""
    good = sum(recovery.after <= LIMIT for recovery in found)
    drowned = sum(recovery.after > LIMIT and recovery.floor > LIMIT for recovery in found)
    text = f"{good} of {tried} scenes have a mean FLIP of at most {LIMIT} after applying, {tried - len(found)} failed"
    if drowned:
        text += f", in {drowned} noise alone gives more"
    if not found:
        return f"{text}."
    return f"{text}. With the same noise the largest is {max(recovery.paired for recovery in found):.4f}."


def main() -> None:
    """Recover all scenes and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--samples", type=int, default=512)
    parser.add_argument("--only", nargs="*", metavar="SEED/LIGHT", help="print the rows of these scenes alone")
    parser.add_argument("--out", type=Path, help="keep the scenes here, and do not repeat those that are there")
    chosen = parser.parse_args()
    scenes = [(seed, light) for seed, light in SCENES if not chosen.only or f"{seed}/{light}" in chosen.only]
    rows, found = [], []
    notes: dict[str, list[str]] = {}
    with tempfile.TemporaryDirectory() as temporary:
        for seed, light in scenes:
            folder = (chosen.out or Path(temporary)).absolute() / str(seed)
            try:
                found.append(_kept(folder) or recover(seed, light, folder, size=chosen.size, samples=chosen.samples))
            except RuntimeError as error:
                rows.append(f"| {seed} | {light} | failed: {error} |")
            else:
                rows.append(table_row(seed, light, found[-1]))
                for note in found[-1].notes:
                    notes.setdefault(note, []).append(str(seed))
            print(rows[-1], flush=True)
    print(summary(found, len(scenes)))
    if not chosen.only:
        text = INTRODUCTION.format(size=chosen.size, samples=chosen.samples, own=OWN_SAMPLES) + "\n".join(rows)
        lines = [f"- {note} Scenes {', '.join(seeds)}." for note, seeds in notes.items()]
        said = "\n\nNotes of the exporter and the fit:\n\n" + "\n".join(lines) if notes else ""
        TABLE.write_text(f"{text}\n\n{summary(found, len(scenes))}{said}\n", "utf-8")


if __name__ == "__main__":
    main()
