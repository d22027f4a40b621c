# SPDX-License-Identifier: Apache-2.0
"""Random scenes rendered by Cycles and, from their export, by our renderer; failures are minimised to their causes.

    python -m studies.differential [--scenes 100] [--seed 0] [--size 48] [--samples 64] [--exported]
        [--groups material light shape]

A scene fails if the pictures differ (`compare`), the export was not refused, and no note names a setting without which
they agree. Prints each failure with the settings it takes, and how many scenes in a row had none. Needs `bpy`.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..parity.cycles_parity import render_job
from ..warm_blender import warm_blenders
from .compare import Difference, Picture, compare
from .random_scene import GROUPS, PLAIN_WORDS, WORDS, Rig, build, drawn

AGAIN = 4  # times as many samples, with other seeds, before a difference is believed
FREE = ("specular_ior_level", "roughness", "base_color", "metallic", "alpha")  # no setting of the study links all


@dataclass(frozen=True)
class Outcome:
    """Of one scene: what was set, the export's refusal if any, its notes, and the difference of the pictures."""

    settings: tuple[str, ...]
    refusal: str
    notes: tuple[str, ...]
    difference: Difference | None

    @property
    def is_named_by_setting(self) -> bool:
        """Whether a sentence names one of the settings, and not only what the plain scene has."""
        return any(word in note for name in self.settings for word in WORDS[name] for note in self.notes)

    @property
    def is_silent(self) -> bool:
        """Whether the pictures differ and no sentence names one of the settings."""
        named = self.is_named_by_setting or any(word in note for word in PLAIN_WORDS for note in self.notes)
        return self.difference is not None and self.difference.is_failure and not named


def try_scene(settings: Sequence[str], seed: int, folder: Path, *, size: int, samples: int) -> Outcome:
    """Build, export and render one scene."""
    from blender_addon.export.job import ExportError, export_job

    rig = build(settings, seed, folder, size=size, samples=samples)
    theirs = (_cycles(rig, folder, 1), _cycles(rig, folder, 2))
    job = folder / f"job_{len(list(folder.glob('job_*')))}"
    try:
        import bpy

        report = export_job(bpy.context, rig.target, job, reference=folder / "cycles_1.exr", fit={})
    except ExportError as refusal:
        return Outcome(tuple(settings), str(refusal), (), None)
    first, second = _ours(job, 2 * samples)
    region = report.request["reference"].get("region", (0.0, 0.0, 1.0, 1.0))
    ours = _empty_beside(first, region), _empty_beside(second, region)
    return Outcome(tuple(settings), "", report.notes, compare(ours, theirs))


def _ours(job: Path, samples: int) -> tuple[Picture, Picture]:
    """Two pictures of a job; one value without a link is free, of which nothing is asked."""
    from mfo_backend.types.errors import BadInputError

    for free in FREE[:-1]:
        with contextlib.suppress(BadInputError):
            return render_job(job, samples, free)
    return render_job(job, samples, FREE[-1])


def _empty_beside(picture: Picture, region: Sequence[float]) -> Picture:
    """A picture of the frame as Cycles leaves it where a region is rendered alone; edges are parts of its sides."""
    height, width = picture.shape[:2]
    left, top, right, bottom = np.rint(np.multiply(region, (width, height, width, height))).astype(int)
    shown = np.zeros_like(picture)
    shown[top:bottom, left:right] = picture[top:bottom, left:right]
    return shown


def minimised(outcome: Outcome, seed: int, folder: Path, *, size: int, samples: int) -> Outcome:
    """Leave settings out as long as the scene stays a silent failure."""
    for name in outcome.settings:
        fewer = [kept for kept in outcome.settings if kept != name]
        found = try_scene(fewer, seed, folder, size=size, samples=samples)
        if found.is_silent:
            outcome = found
    return outcome


def study(
    scenes: int, seed: int, *, size: int, samples: int, exported: bool = False, groups: Sequence[str] = ()
) -> list[Outcome]:
    """Try that many scenes and return the silent failures, minimised.

    All scenes first ask Blenders that run already; what fails or is refused there is tried anew, with its own.
    """
    failures, refused, named = [], 0, 0
    again = list[tuple[int, list[str]]]()
    with warm_blenders():
        for number in range(seed, seed + scenes):
            names = drawn(number, exported=exported, groups=groups)
            with tempfile.TemporaryDirectory() as name:
                outcome = try_scene(names, number, Path(name), size=size, samples=samples)
            if outcome.is_silent or outcome.refusal:
                again.append((number, names))
                print(f"scene {number} is tried again: {outcome.refusal or outcome.difference}", flush=True)
            elif outcome.difference is not None and outcome.difference.is_failure:
                named += 1
                by = "a setting" if outcome.is_named_by_setting else "the plain scene"  # which may hide another cause
                print(f"scene {number}, named by {by}: {', '.join(names)}: {outcome.difference}", flush=True)
    for number, names in again:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            outcome = try_scene(names, number, folder, size=size, samples=AGAIN * samples)
            refused += bool(outcome.refusal)
            if outcome.is_silent:
                outcome = minimised(outcome, number, folder, size=size, samples=AGAIN * samples)
                failures.append(outcome)
                print(f"scene {number}: {', '.join(outcome.settings) or 'the plain scene'}: {outcome.difference}")
                sys.stdout.flush()
    print(f"{scenes} scenes from {seed}: {len(failures)} silent failures, {named} named, {refused} refused")
    return failures


def _cycles(rig: Rig, folder: Path, seed: int) -> Picture:
    import bpy
    import OpenEXR

    rig.scene.cycles.seed = seed
    path = folder / f"cycles_{seed}.exr"
    rig.scene.render.filepath = str(path)
    with _quiet():
        bpy.ops.render.render(write_still=True)
    channels: Any = OpenEXR.File(str(path)).channels()
    return np.asarray(next(iter(channels.values())).pixels[:, :, :3], np.float64)


@contextlib.contextmanager
def _quiet() -> Any:
    """Without Blender's own lines on stdout."""
    sys.stdout.flush()
    kept = os.dup(1)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        try:
            yield
        finally:
            os.dup2(kept, 1)
            os.close(kept)


def main() -> None:
    """Run the study from the command line; ends with 1 after a silent failure."""
    parser = argparse.ArgumentParser(prog="python -m studies.differential", description=__doc__)
    parser.add_argument("--scenes", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size", type=int, default=48, help="pixels along each side")
    parser.add_argument("--samples", type=int, default=64, help="a pixel, of each of two halves")
    parser.add_argument("--exported", action="store_true", help="only settings that no sentence names")
    parser.add_argument("--groups", nargs="*", default=(), choices=tuple(GROUPS), help="of settings; without it, all")
    chosen = parser.parse_args()
    counts = {"size": chosen.size, "samples": chosen.samples}
    failures = study(chosen.scenes, chosen.seed, **counts, exported=chosen.exported, groups=chosen.groups)
    sys.exit(1 if failures else 0)
