# SPDX-License-Identifier: Apache-2.0
"""One room of `studies.materials`: its fit, and what Cycles says of each material."""

from __future__ import annotations

import json
import resource
import time
from pathlib import Path
from typing import Any

import numpy as np

from mfo_backend.metrics.display.tone_mapping import DisplayView
from mfo_backend.metrics.flip.flip_error import flip_error
from mfo_backend.scene.image_file import read_image
from mfo_backend.types.image import Image

from ..child_module import MATCHED_OR_NOT, run_module

ROOMS = "studies.materials.scene"
# Pictures of the truth beside the reference: one alone is uncertain by up to 0.006 on targets of 140 to 420 pixels
FLOORS = 4


def measure(
    number: int,
    folder: Path,
    size: int,
    preset: str,
    *,
    nodes: bool = False,
    things: int = 0,
    from_truth: bool = False,
) -> dict[str, Any]:
    """The row of one room, whose values are inside `nodes` or of sockets alone; `from_truth` fits the truth's file.

    With `things` it is that many of them on a floor, which are fitted in a queue.
    """
    kind = ["--nodes"] if nodes else ["--things", things]
    run_module(ROOMS, "build", number, folder, "--size", size, *kind)
    truth = json.loads((folder / "truth.json").read_text("utf-8"))
    names = [f"{name}/{value}" for name, values in truth.items() for value in values]
    pictures = {}
    for name, seed in (("reference", 3), *((f"floor{k}", 6 + k) for k in range(FLOORS))):
        pictures[name] = folder / f"{name}.exr"
        run_module(ROOMS, "render", folder / "truth.blend", pictures[name], seed)
    words = [word for name in truth for word in ("--object", name)]
    words += ["--parameters", ", ".join(names)] if nodes or things else []
    words += ["--queue"] if things else []
    file = folder / ("truth.blend" if from_truth else "start.blend")
    began, cpu = time.monotonic(), _child_seconds()
    result = run_module(
        "mfo_backend", "blend", file, *words, "--reference", pictures["reference"],
        "--preset", preset, "--out", folder / "job", "--apply", "--force", "--save-as",
        folder / "fitted.blend", "--json", allowed=MATCHED_OR_NOT,
    ).answer  # fmt: skip
    seconds, cpu = time.monotonic() - began, _child_seconds() - cpu
    pictures["fitted"] = folder / "fitted.exr"
    run_module(ROOMS, "render", folder / "fitted.blend", pictures["fitted"], 5)
    images = {name: read_image(path, None) for name, path in pictures.items()}
    row: dict[str, Any] = {"number": number, "size": size, "preset": preset, "seconds": seconds, "cpu": cpu}
    row["nodes"], row["things"], row["from_truth"], row["truth"] = nodes, things, from_truth, truth
    row["fit_seconds"], row["verdict"], row["materials"] = result["seconds"], result["verdict"], {}
    for found in result["materials"]:
        seen = read_image(folder / "job" / found["folder"] / "pictures" / "counted.png", None).pixels[..., 0] > 0.5
        floors = [_flip(images["reference"], images[f"floor{k}"], seen) for k in range(FLOORS)]
        fitted = _flip(images["reference"], images["fitted"], seen)
        row["materials"][found["object"]] = {
            "pixels": int(seen.sum()), "floor": float(np.mean(floors)), "floors": floors, "fitted": fitted,
            "verdict": found["verdict"],
            "recovered": found["recovered"],
        }  # fmt: skip
        if nodes:
            row["materials"][found["object"]]["values"] = _errors(truth[found["object"]], found)
    return row


def _errors(truth: dict[str, Any], found: dict[str, Any]) -> dict[str, list[Any]]:
    """Of each value its error and its deviation as shares of the range it is fitted in, and how sure it is called."""
    errors = {}
    for name, value in truth.items():
        key = name if "/" in name else name.lower().replace(" ", "_")
        low, high = found["bounds"][key]
        error = np.abs(np.subtract(found["recovered"][key], value)).max() / (high - low)
        sure = found["certainty"].get(key, {"sd": [0.0], "level": ""})
        spread = max((sd for sd in sure["sd"] if sd is not None), default=0.0) / (high - low)
        errors[name] = [round(float(error), 4), round(spread, 5), sure["level"]]
    return errors


def _flip(reference: Image, test: Image, mask: np.ndarray) -> float:
    view = DisplayView.for_scene(reference.pixels, mask)
    return float(flip_error(reference, test, display=view).map[mask].mean(dtype=np.float64))


def _child_seconds() -> float:
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime
