# SPDX-License-Identifier: Apache-2.0
"""One case of `studies.verdicts` from its scene to its row: fit by `mfo blend`, judged by a Cycles render."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ..child_module import MATCHED_OR_NOT, run_module
from .cases import KINDS, Case, sockets_of


@dataclass(frozen=True)
class Row:
    """A measured case.

    `flip` is the mean FLIP between the reference, scene-linear, and Cycles' render of the fitted file with as many
    samples, over the whole picture; `floor` the same of the reference's own scene with other noise. `target_flip` and
    `target_floor` are those of the pixels of the target. `values` holds each fitted value, what it truly is, its
    standard deviation and its level.
    """

    kind: str
    case: dict[str, Any]
    verdict: str
    cause: str
    exit_code: int
    flip: float
    floor: float
    target_flip: float
    target_floor: float
    start_flip: float
    seconds: float
    values: dict[str, dict[str, Any]]
    notes: list[str]
    error: str = ""

    @property
    def excess(self) -> float:
        """FLIP above the noise, of the whole picture or of the target, whichever is more."""
        return max(self.flip - self.floor, self.target_flip - self.target_floor)


def measure(kind: str, number: int, folder: Path) -> Row:
    """Build the scene, fit it, render the fitted file; a failure is a row with its sentence."""
    case = KINDS[kind](number)
    try:
        return _measured(kind, case, folder / kind / case.name)
    except RuntimeError as error:
        nothing = float("nan")
        return Row(kind, asdict(case), "failed", "", 1, *(nothing,) * 6, {}, [], error=str(error))


def _measured(kind: str, case: Case, folder: Path) -> Row:
    if not (folder / "floor.exr").is_file():
        run_module("studies.verdicts.scene", kind, case.number, folder)
    picture = folder / f"reference.{case.picture}"
    words = ("--object", "Target", "--reference", picture, "--out", folder / "job", "--json")
    baked = ("--reference-view", "scene") if case.picture == "png" else ()
    asked = (folder / "start.blend", *words, *baked)
    code, result = run_module("mfo_backend", "blend", *asked, allowed=MATCHED_OR_NOT)
    return Row(
        kind, asdict(case), result.get("verdict") or "", result.get("verdict_cause") or "",
        code, *flips_in_cycles(case, folder), start_flip=result["errors"]["flip"][0], seconds=result["seconds"],
        values=values_of(case, result), notes=result["notes"],
    )  # fmt: skip


def values_of(case: Case, result: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Each fitted value, what it truly is (None where something is planted), its standard deviation and its level."""
    truth = {"metallic": 0.0} | {name.lower().replace(" ", "_"): value for name, value in sockets_of(case).items()}
    return {
        name: {
            "value": value,
            "truth": None if case.plant else truth.get(name, result["initial"].get(name)),
            **result["certainty"].get(name, {}),
        }
        for name, value in result["recovered"].items()
    }


def flips_in_cycles(case: Case, folder: Path) -> tuple[float, float, float, float]:
    """Render the fitted file of `folder`/job in Cycles to after.exr, then see `flips`."""
    run_module("blender_addon.headless", "check", folder / "start.blend", "--job", folder / "job",
        "--out", folder / "after.exr", "--samples", case.judge_samples, "--seed", 2)  # fmt: skip
    return flips(folder)


def flips(folder: Path) -> tuple[float, float, float, float]:
    """Mean FLIP of after.exr and floor.exr against reference.exr, over the whole picture and then over the target."""
    from mfo_backend.metrics.flip.flip_error import flip_error
    from mfo_backend.scene.image_file import read_image

    reference, floor, after = (read_image(folder / f"{name}.exr") for name in ("reference", "floor", "after"))
    mask = read_image(folder / "job" / "pictures" / "counted.png").pixels[..., 0] > 0.5
    maps = [flip_error(reference, picture).map for picture in (after, floor)]
    flip, base = (float(of.mean()) for of in maps)
    return flip, base, *(float(of[mask].mean()) for of in maps)
