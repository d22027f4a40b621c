# SPDX-License-Identifier: Apache-2.0
"""Materials recovered from Cycles' pictures and judged in Cycles: the demo's scene and others with random materials.

    python -m studies.recovery.cycles_recovery [--size 96] [--samples 256] [--judge-samples 4096] [--judge PYTHON]
        [--only 1/environment ...] [--out DIR]

writes docs/reference/cycles_recovery.md. Needs a Python with `bpy`; ColorVideoVDP is computed by PYTHON, which has
the packages of the extra `judges`.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import textwrap
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]

TABLE = ROOT / "docs" / "reference" / "cycles_recovery.md"
WIDTH = 118  # of a line of the page
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
REFERENCE_SEED, TRUTH_SEED, JUDGED_SEED = 0, 1, 2  # no two compared pictures share their noise
OWN_SAMPLES = 2048
LIMIT, LEAST_JOD = 0.012, 9.8
KEPT = "recovery.json"


@dataclass(frozen=True)
class Recovery:
    """Differences to a render of the true material with many samples, of Cycles renders but for `model`.

    Mean FLIP, and JOD by ColorVideoVDP, which may be missing; `seconds` are those of the fit, `gap` the result's own
    figure.
    """

    before: float
    after: float
    floor: float  # the true material with other noise
    model: float  # our own render of the true material
    jod: float | None
    jod_floor: float | None
    gap: float | None
    seconds: float
    notes: tuple[str, ...]


@dataclass(frozen=True)
class Effort:
    """Pixels along each side, samples per pixel of the picture that is fitted and of the judged ones."""

    size: int = 96
    samples: int = 256
    judge_samples: int = 4096


def recover(seed: int, light: str, folder: Path, effort: Effort, judge: str) -> Recovery:
    """Build a scene, fit it with `mfo blend --preset balanced --apply` and judge the saved file.

    The fit sees a picture of few samples; the judged pictures have many, so that they differ by the material and not by
    their noise.

    Raises
    ------
    RuntimeError
        With the last lines of whichever program failed.
    """
    from mfo_backend.metrics.display.tone_mapping import DisplayView
    from mfo_backend.metrics.flip.flip_error import flip_error
    from mfo_backend.scene.image_file import read_image
    from mfo_backend.types.image import Encoding, Image

    from ..parity.cycles_parity import render_job

    scene = _run("studies.recovery.recovery_scene", seed, light, folder, "--size", effort.size)

    def render(blend: str, picture: str, samples: int, noise: int) -> Path:
        words = ("--out", folder / picture, "--samples", samples, "--seed", noise)
        _run("blender_addon.headless", "render", folder / blend, *words)
        return folder / picture

    render("truth.blend", "reference.exr", effort.samples, REFERENCE_SEED)
    common = ("--object", scene["object"], "--reference", folder / "reference.exr")
    options = ("--preset", "balanced", "--out", folder / "job", "--apply", "--save-as", folder / "recovered.blend")
    result = _run("mfo_backend", "blend", folder / "start.blend", *common, *options, "--json")
    truth = render("truth.blend", "truth.exr", effort.judge_samples, TRUTH_SEED)
    files = {"before": render("start.blend", "before.exr", effort.samples, JUDGED_SEED)}
    for name, blend in (("after", "recovered.blend"), ("floor", "truth.blend")):
        files[name] = render(blend, f"{name}.exr", effort.judge_samples, JUDGED_SEED)
    judged = {name: read_image(path) for name, path in files.items()}
    _run("blender_addon.headless", "export", folder / "truth.blend", *common, "--job", folder / "truth")
    ours = np.mean(render_job(folder / "truth", OWN_SAMPLES), axis=0).astype(np.float32)
    judged["model"] = Image(ours, Encoding.LINEAR)
    reference, view = read_image(truth), DisplayView()
    flips = {name: flip_error(reference, picture, display=view).mean for name, picture in judged.items()}
    jod, jod_floor = (
        _run("mfo_backend", "compare", truth, files[name], "--json", python=judge)["metrics"]["jod"]
        for name in ("after", "floor")
    )
    gap = (result.get("model_gap") or {}).get("relative")
    found = Recovery(
        **flips, jod=jod, jod_floor=jod_floor, gap=gap, seconds=result["seconds"], notes=tuple(result["notes"])
    )
    (folder / KEPT).write_text(json.dumps(asdict(found)))
    return found


def _kept(folder: Path) -> Recovery | None:
    """What an earlier run found."""
    if not (folder / KEPT).is_file():
        return None
    found = json.loads((folder / KEPT).read_text())
    return Recovery(**found | {"notes": tuple(found["notes"])})


def _run(module: str, *words: Any, python: str = sys.executable) -> dict[str, Any]:
    """The JSON object on the last line of a Python module's output."""
    command = [python, "-m", module, *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    answer = json.loads(lines[-1]) if lines else {}
    if done.returncode or not lines:
        raise RuntimeError(f"{module} ended with {done.returncode}: {answer.get('sentence', done.stderr[-500:])}")
    return answer


INTRODUCTION = """# Materials recovered from Cycles' pictures

`python -m studies.recovery.cycles_recovery` writes this file.
Scene 1 is that of `mfo demo`; the others have its head and table
with other random materials, starts and lights: {size}x{size} pixels, Blender 5.0.1 and its own render settings but for
adaptive sampling and denoising. `mfo blend --preset balanced` fits all parameters to a Cycles render of {samples}
samples per pixel; then Cycles renders the saved result. Judged are pictures of {judge_samples} samples, so that the
figures are those of the material: two of 256 samples under the environment are a FLIP of 0.02 apart through their noise
alone. Mean FLIP of the whole picture, and JOD by ColorVideoVDP (10 is equal), against Cycles' render of the true
material:

- before, after: Cycles' render of the start ({samples} samples) and of the recovered material;
- floor: Cycles' render of the true material with another seed: the noise that is left;
- ours: our own render of the true material ({own} samples): what the export and the renderer lose, and noise;
- gap: the result's own `model_gap`, found without the truth.

| scene | light | before | after | floor | ours | JOD after | JOD floor | gap | fit |
|---|---|---|---|---|---|---|---|---|---|
"""


def table_row(seed: int, light: str, found: Recovery) -> str:
    """One line of the table."""
    flips = " | ".join(f"{flip:.4f}" for flip in (found.before, found.after, found.floor, found.model))
    jods = " | ".join("-" if jod is None else f"{jod:.2f}" for jod in (found.jod, found.jod_floor))
    gap = "-" if found.gap is None else f"{100 * found.gap:.1f} %"
    return f"| {seed} | {light} | {flips} | {jods} | {gap} | {found.seconds:.0f} s |"


def summary(found: Sequence[Recovery], tried: int, unmeasured: int = 0) -> str:
    """How many were good enough by each measure, and what was worst."""
    good, failed = sum(recovery.after <= LIMIT for recovery in found), tried - len(found) - unmeasured
    text = f"{good} of {tried} scenes have a mean FLIP of at most {LIMIT} after applying, {failed} failed"
    text += f", {unmeasured} are not measured." if unmeasured else "."
    scores = [recovery.jod for recovery in found if recovery.jod is not None]
    if scores:
        high = sum(score >= LEAST_JOD for score in scores)
        text += f" {high} of {len(scores)} have a JOD of at least {LEAST_JOD}, the lowest is {min(scores):.2f}."
    return text + (f" The largest FLIP is {max(recovery.after for recovery in found):.4f}." if found else "")


def main() -> None:
    """Recover all scenes and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=Effort.size)
    parser.add_argument("--samples", type=int, default=Effort.samples)
    parser.add_argument("--judge-samples", type=int, default=Effort.judge_samples)
    parser.add_argument("--judge", default=sys.executable, metavar="PYTHON", help="a Python with ColorVideoVDP")
    parser.add_argument("--only", nargs="*", metavar="SEED/LIGHT", help="print the rows of these scenes alone")
    parser.add_argument("--out", type=Path, help="keep the scenes here, and do not repeat those that are there")
    parser.add_argument("--kept", action="store_true", help="write the table of the scenes in OUT, measure no others")
    chosen = parser.parse_args()
    effort = Effort(chosen.size, chosen.samples, chosen.judge_samples)
    scenes = [(seed, light) for seed, light in SCENES if not chosen.only or f"{seed}/{light}" in chosen.only]
    rows, found, unmeasured = [], [], 0
    notes: dict[str, list[str]] = {}
    with tempfile.TemporaryDirectory() as temporary:
        for seed, light in scenes:
            folder = (chosen.out or Path(temporary)).absolute() / str(seed)
            if chosen.kept and _kept(folder) is None:
                rows.append(f"| {seed} | {light} | not measured |")
                unmeasured += 1
                continue
            try:
                found.append(_kept(folder) or recover(seed, light, folder, effort, chosen.judge))
            except RuntimeError as error:
                rows.append(f"| {seed} | {light} | failed: {error} |")
            else:
                rows.append(table_row(seed, light, found[-1]))
                for note in found[-1].notes:
                    notes.setdefault(note, []).append(str(seed))
            print(rows[-1], flush=True)
    print(summary(found, len(scenes), unmeasured))
    if not chosen.only:
        text = INTRODUCTION.format(**asdict(effort), own=OWN_SAMPLES) + "\n".join(rows)
        lines = [
            textwrap.fill(f"- {note} Scenes {', '.join(seeds)}.", WIDTH, subsequent_indent="  ", break_long_words=False)
            for note, seeds in notes.items()
        ]
        counted = textwrap.fill(summary(found, len(scenes), unmeasured), WIDTH)
        said = "\n\nNotes of the exporter and the fit:\n\n" + "\n".join(lines) if notes else ""
        TABLE.write_text(f"{text}\n\n{counted}{said}\n", "utf-8")


if __name__ == "__main__":
    main()
