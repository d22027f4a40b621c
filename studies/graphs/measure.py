# SPDX-License-Identifier: Apache-2.0
"""One scene of `studies.graphs`: its fit, and what Cycles says of it."""

from __future__ import annotations

import math
import random
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mfo_backend.cli.run_folder import run_folder
from mfo_backend.job.run.fit_scene import fit_scene
from mfo_backend.metrics.flip.flip_error import flip_error
from mfo_backend.scene.image_file import write_exr
from mfo_backend.types.image import Encoding, Image, Pixels

from ..verdicts.summary import DEVIATIONS, OFF
from .bumps import BUMPS
from .head import head_scene, side_camera
from .materials import GRAPHS
from .mixes import MIXES, DrawnMix, put_mix
from .values import FITTED, SOCKETS, Drawn

SERIES = ("sockets", "values", "mixes", "bumps")
NODE_SERVER = (sys.executable, "-m", "blender_addon.probe.server")
SAMPLES = {"lamp": 128, "probe": 256}


def build_scene(graph: str, light: str, size: int) -> Any:
    """The head with the graph's material; returns object and Principled node."""
    target, node = head_scene(light, size)
    if graph in MIXES:
        put_mix(graph, target)
    else:
        (GRAPHS | BUMPS)[graph](target.active_material.node_tree, node)
    return target, node


def row(graph: str, light: str, seed: int, size: int, series: str, views: int = 1) -> dict[str, Any]:
    """One fit, to pictures of one or two cameras, and what Cycles says of it in the first."""
    import bpy

    from blender_addon.export.job import export_job
    from blender_addon.export.reference.picture_setup import PictureSetup
    from blender_addon.result.job_result import read_job_result
    from blender_addon.result.write_back import apply_values, result_to_sockets

    target, node = build_scene(graph, light, size)
    draw = random.Random(f"{graph} {light} {seed}")
    drawn: Drawn | DrawnMix
    if series == "mixes":
        drawn = DrawnMix(graph, target)
    elif series == "values":
        drawn = Drawn(target, node, FITTED[graph])
    else:
        drawn = Drawn(target, node, [name for name in SOCKETS if not node.inputs[name].is_linked])
    names = drawn.names
    truth = drawn.draw(draw)
    start = drawn.draw(draw, near=truth)
    drawn.put(truth)
    reference, floor = (_cycles(SAMPLES[light], k) for k in (1, 2))
    others = [] if views == 1 else [(side_camera().name, _cycles(SAMPLES[light], 5, "Side"))]
    drawn.put(start)
    before = _cycles(SAMPLES[light], 3)
    with tempfile.TemporaryDirectory() as folder:
        picture, job = Path(folder) / "reference.exr", Path(folder) / "job"
        write_exr(picture, reference)
        setups = [PictureSetup(picture)]
        for number, (camera, shown) in enumerate(others, 2):
            write_exr(path := Path(folder) / f"{camera}.exr", shown)
            setups.append(PictureSetup(path, number, camera=camera))
        began = time.monotonic()
        parameters = [name if "/" in name else name.lower().replace(" ", "_") for name in names]
        export_job(bpy.context, target, job, reference=setups if others else picture, fit={"parameters": parameters})
        done = run_folder(job, partial(fit_scene, blender=NODE_SERVER), is_new=True)
        known = {"series": series, "graph": graph, "light": light, "seed": seed, "size": size, "views": views}
        if done.result is None:
            return {**known, "failed": done.sentence}
        seconds = time.monotonic() - began
        result = read_job_result(job)
        apply_values(target.active_material, result_to_sockets(result), job, leaf=result.leaf or None)
        after = _cycles(SAMPLES[light], 4)
        mask = bpy.data.images.load(str(job / "pictures" / "counted.png"))
        counted = np.array(mask.pixels).reshape(size, size, -1)[::-1, :, 0] > 0.5  # Blender's rows begin below
    flips = {name: _flip(floor, other, counted) for name, other in
             (("before", before), ("after", after), ("floor", reference))}  # fmt: skip
    of = [(name, _key_of(name, key, result)) for name, key in zip(names, parameters, strict=True)]
    sure = {name: result.certainty.get(key, "") for name, key in of}
    spread = {name: drawn.share(name, result.spread[key], truth[name]) for name, key in of if key in result.spread}
    return {
        **known, "seconds": round(seconds, 1), "verdict": result.verdict,
        **{f"flip_{name}": round(value, 5) for name, value in flips.items()},
        "wrong": {name: round(error, 4) for name, error in drawn.errors(truth).items()}, "certainty": sure,
        "spread": {name: round(share, 5) for name, share in spread.items() if math.isfinite(share)},
    }  # fmt: skip


def is_wrong(made: dict[str, Any], name: str) -> bool:
    """Whether a value of a row is off by more than a fiftieth of its range and by more than three deviations."""
    return made["wrong"][name] > max(OFF, DEVIATIONS * made["spread"].get(name, 0.0))


def _key_of(name: str, key: str, result: Any) -> str:
    """What a result calls a value: those of a mix's fitted leaf have plain names."""
    own = f"{result.leaf}/"
    if not result.leaf or not name.startswith(own):
        return key
    plain = {label: parameter for parameter, label in result.labels.items()}
    return plain.get(name.removeprefix(own), name.removeprefix(own).lower().replace(" ", "_"))


def _cycles(samples: int, seed: int, camera: str = "Camera") -> Pixels:
    import bpy
    import OpenEXR

    scene = bpy.context.scene
    scene.camera = bpy.data.objects[camera]
    scene.cycles.samples, scene.cycles.seed = samples, seed
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.color_mode = "OPEN_EXR", "32", "RGB"
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "cycles.exr")
        bpy.ops.render.render(write_still=True)
        scene.camera = bpy.data.objects["Camera"]
        channels = OpenEXR.File(scene.render.filepath).channels()
        return np.array(channels["RGB"].pixels, np.float32)[..., :3]


def _flip(first: Pixels, second: Pixels, counted: np.ndarray) -> float:
    error = flip_error(Image(first, Encoding.LINEAR), Image(second, Encoding.LINEAR))
    return float(error.map[counted].mean())
