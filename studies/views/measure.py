# SPDX-License-Identifier: Apache-2.0
"""One scene of `studies.views`: its fits to one and several pictures."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any, NamedTuple

from ..child_module import MATCHED_OR_NOT, run_module

TURNS = range(30, 360, 30)  # degrees around the target that a camera stands at, as `scene` makes them
LAMP_TURNS = (0, 90, 180, 270)  # degrees that its lamp is turned by; 0 is the lamp alone


class Shot(NamedTuple):
    """A camera of the file and the scene it shows, the first one without a name."""

    camera: str
    scene: str = ""


FRONT = Shot("Front")
SHOTS = (*(Shot(f"T{turn:03d}") for turn in TURNS), *(Shot("Front", f"L{turn:03d}") for turn in LAMP_TURNS))


def measure(number: int, folder: Path, size: int) -> dict[str, Any]:
    """The row of one scene, whose pictures have `size` pixels along a side."""
    run_module("studies.views.scene", "build", number, folder, "--size", size)
    front = rendered(folder, FRONT)
    one = fit(folder, [front])
    proposal = one.get("next_picture")
    draw = random.Random(1000 + number)
    proposed = shot_of(proposal) if proposal else draw.choice(SHOTS)
    drawn = draw.choice([shot for shot in SHOTS if shot != proposed])
    second, third = rendered(folder, proposed), rendered(folder, drawn)
    # a lamp that is elsewhere in the first scene
    planted = next((shot for shot in (proposed, drawn) if not shot.scene), Shot(f"T{draw.choice(TURNS):03d}"))
    wrong = rendered(folder, planted, moved=True)
    other = third if planted == proposed else second
    return {
        "number": number,
        "size": size,
        "proposal": proposal,
        "shots": [proposed, drawn],
        "one": _short(one),
        "proposed": _short(fit(folder, [front, second])),
        "drawn": _short(fit(folder, [front, third])),
        "three": _short(fit(folder, [front, second, third])),
        "planted": _short(fit(folder, [front, wrong, other])),
    }


def shot_of(proposal: dict[str, Any]) -> Shot:
    """The camera and scene of the files that a result proposes."""
    if proposal["light"]:
        return Shot("Front", f"L{round(proposal['light_turn']) % 360:03d}")
    return Shot(proposal["camera"] or f"T{round(proposal['turn']) % 360:03d}")


def rendered(folder: Path, shot: Shot, *, moved: bool = False) -> tuple[Path, Shot]:
    """The truth as a shot shows it."""
    file = folder / f"{shot.camera}{shot.scene}{'_moved' if moved else ''}.exr"
    words = [*(["--scene", shot.scene] if shot.scene else []), *(["--moved"] if moved else [])]
    run_module("studies.views.scene", "render", folder, shot.camera, file, *words)
    return file, shot


def fit(folder: Path, pictures: list[tuple[Path, Shot]]) -> dict[str, Any]:
    """The result of one job over all pictures."""
    words: list[str] = []
    for file, shot in pictures:
        what = f"camera={shot.camera}" + (f",scene={shot.scene}" if shot.scene else "")
        words += ["--reference", f"{file}@{what}"]
    asked = ("--object", "Target", *words, "--out", folder / "job", "--json")
    return run_module("mfo_backend", "blend", folder / "start.blend", *asked, allowed=MATCHED_OR_NOT).answer


def _short(result: dict[str, Any]) -> dict[str, Any]:
    """What the summary asks for."""
    certainty = {name: {"level": c["level"], "sd": max(c["sd"])} for name, c in result.get("certainty", {}).items()}
    keys = ("verdict", "seconds", "contradiction", "recovered", "bounds")
    return {key: result.get(key) for key in keys} | {"certainty": certainty}
