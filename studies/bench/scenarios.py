# SPDX-License-Identifier: Apache-2.0
"""One row of each scenario: a scene by number, its fit, and what Cycles says of the fitted file."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

from mfo_backend.bench.rows.blender_row import BlenderRow

from ..child_module import run_module
from ..materials.measure import measure as measure_room
from ..verdicts.measure import flips
from ..verdicts.measure import measure as measure_verdict
from ..verdicts.summary import determined
from ..views.measure import FRONT, SHOTS, fit, rendered, shot_of

OTHER_NOISE = 7  # seed of the pictures that a result is judged by


def graphs(scene: int, size: int) -> BlenderRow:
    """Values inside a node graph; the graphs take turns, and lamp and probe do."""
    import bpy

    import blender_addon

    from ..graphs.head import LIGHTS
    from ..graphs.measure import is_wrong, row
    from ..graphs.values import FITTED

    if not hasattr(bpy.types.Material, "mfo"):
        blender_addon.register()  # what was applied is kept in properties of the material
    names = list(FITTED)
    graph, light = names[scene % len(names)], LIGHTS[scene % len(LIGHTS)]
    found = row(graph, light, scene, size, "values")
    case = f"{graph}, {light}"
    if "failed" in found:
        return BlenderRow("graphs", scene, case, error=found["failed"])
    sure = [name for name, level in found["certainty"].items() if level == "determined"]
    return BlenderRow(
        "graphs", scene, case, found["verdict"], found["flip_after"], found["flip_floor"], found["flip_before"],
        found["seconds"], len(sure), sum(is_wrong(found, name) for name in sure),
    )  # fmt: skip


def views(scene: int, size: int) -> BlenderRow:
    """A material by two pictures, the second from where the result of the first proposes; judged in the first."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        run_module("studies.views.scene", "build", scene, folder, "--size", size)
        front = rendered(folder, FRONT)
        proposal = fit(folder, [front]).get("next_picture")
        second = shot_of(proposal) if proposal else SHOTS[scene % len(SHOTS)]
        result = fit(folder, [front, rendered(folder, second)])
        front[0].rename(folder / "reference.exr")
        job = ("--job", folder / "job")
        for file, name, words in (("truth", "floor", ()), ("start", "before", ()), ("start", "after", job)):
            command = "check" if words else "render"
            picture = ("--out", folder / f"{name}.exr", "--seed", OTHER_NOISE)
            run_module("blender_addon.headless", command, folder / f"{file}.blend", *words, *picture)
        _, _, after, floor = flips(folder)
        (folder / "before.exr").replace(folder / "after.exr")
        start = flips(folder)[2]
        truth = result["initial"] | json.loads((folder / "truth.json").read_text("utf-8"))
    values = [
        {"value": value, "truth": truth[name], **result["certainty"].get(name, {})}
        for name, value in result["recovered"].items()
    ]
    wrong, sure = determined(values)
    case = f"Front and {second.scene or second.camera}"
    return BlenderRow("views", scene, case, result["verdict"], after, floor, start, result["seconds"], sure, wrong)


def verdicts(kind: str, name: str, scene: int, size: int) -> BlenderRow:
    """A case of `studies.verdicts`, which has its own size."""
    with tempfile.TemporaryDirectory() as temporary:
        row = measure_verdict(kind, scene, Path(temporary))
    case = f"{row.case['material']}, {row.case['light']}" + (f", {row.case['plant']}" if row.case["plant"] else "")
    if row.error:
        return BlenderRow(name, scene, case, error=row.error)
    wrong, sure = determined(row.values.values())
    return BlenderRow(
        name, scene, case, row.verdict, row.target_flip, row.target_floor, row.start_flip, row.seconds, sure, wrong
    )


def materials(scene: int, size: int) -> BlenderRow:
    """A room of six materials fitted together; its errors are those of the material that ends furthest away."""
    with tempfile.TemporaryDirectory() as temporary:
        row = measure_room(scene, Path(temporary), size, "balanced")
    name, worst = max(row["materials"].items(), key=lambda item: item[1]["fitted"] - item[1]["floor"])
    return BlenderRow(
        "materials", scene, f"six, furthest: {name}", row["verdict"], worst["fitted"], worst["floor"],
        seconds=row["seconds"],
    )  # fmt: skip


SCENARIOS: dict[str, Callable[[int, int], BlenderRow]] = {
    "graphs": graphs,
    "views": views,
    "materials": materials,
    "classes": partial(verdicts, "classes", "classes"),
    "wrong": partial(verdicts, "planted", "wrong"),
}
