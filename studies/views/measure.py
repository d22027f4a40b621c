# SPDX-License-Identifier: Apache-2.0
"""One scene of `studies.views`: its fits to one and several pictures."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

from ..child_module import MATCHED_OR_NOT, run_module

TURNS = range(30, 360, 30)  # degrees around the target that a camera stands at, as `scene` makes them


def measure(number: int, folder: Path) -> dict[str, Any]:
    """The row of one scene."""
    run_module("studies.views.scene", "build", number, folder)
    front = rendered(folder, "Front")
    one = fit(folder, [front])
    proposal = one.get("next_picture")
    draw = random.Random(1000 + number)
    turns = [f"T{turn:03d}" for turn in TURNS]
    proposed = f"T{round(proposal['turn']) % 360:03d}" if proposal else draw.choice(turns)
    drawn = draw.choice([turn for turn in turns if turn != proposed])
    second, third = rendered(folder, proposed), rendered(folder, drawn)
    wrong = rendered(folder, proposed, moved=True)
    return {
        "number": number,
        "proposal": proposal,
        "cameras": [proposed, drawn],
        "one": _short(one),
        "proposed": _short(fit(folder, [front, second])),
        "drawn": _short(fit(folder, [front, third])),
        "three": _short(fit(folder, [front, second, third])),
        "planted": _short(fit(folder, [front, wrong, third])),
    }


def rendered(folder: Path, camera: str, *, moved: bool = False) -> tuple[Path, str]:
    """The truth from a camera, and the camera's name."""
    file = folder / f"{camera}{'_moved' if moved else ''}.exr"
    run_module("studies.views.scene", "render", folder, camera, file, *(["--moved"] if moved else []))
    return file, camera


def fit(folder: Path, pictures: list[tuple[Path, str]]) -> dict[str, Any]:
    """The result of one job over all pictures."""
    words = [word for file, camera in pictures for word in ("--reference", f"{file}@camera={camera}")]
    asked = ("--object", "Target", *words, "--out", folder / "job", "--json")
    return run_module("mfo_backend", "blend", folder / "start.blend", *asked, allowed=MATCHED_OR_NOT).answer


def _short(result: dict[str, Any]) -> dict[str, Any]:
    """What the summary asks for."""
    certainty = {name: {"level": c["level"], "sd": max(c["sd"])} for name, c in result.get("certainty", {}).items()}
    keys = ("verdict", "seconds", "contradiction", "recovered", "bounds")
    return {key: result.get(key) for key in keys} | {"certainty": certainty}
