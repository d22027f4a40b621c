# SPDX-License-Identifier: Apache-2.0
"""`mfo demo`: the main job from end to end on a scene that Blender builds on the spot.

Cycles renders an object with a material drawn at random: the reference. The same scene with another random material is
the start. The fit recovers the first from its picture, and Cycles renders the recovered material to judge it.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

from ...metrics.display.tone_mapping import DisplayView
from ...metrics.flip.flip_error import flip_error
from ...report.picture import displayed, png_bytes
from ...scene.image_file import read_image
from ...types.errors import BadInputError
from ...types.image import Image
from ..blender_host import find_blender_host
from ..fit_options import add_fit_options, fit_from_options
from .blend import apply_result, fit_blend

_REFERENCE_SEED, _JUDGE_SEED = 0, 1  # Cycles' noise of the judged pictures is not the reference's


def add_parser(subparsers) -> None:  # type: ignore[no-untyped-def]  # argparse names its class with an underscore
    """Add `mfo demo`."""
    parser = subparsers.add_parser(
        "demo",
        help="fit a material in a scene that is built on the spot",
        description="Recover a random material from a Cycles render of it, apply it and judge it in Cycles.",
    )
    parser.add_argument("--out", type=Path, default=Path("mfo-demo"), metavar="DIR", help="folder (default: mfo-demo)")
    parser.add_argument("--scene-seed", type=int, default=1, metavar="N", help="which materials and light")
    parser.add_argument("--size", type=int, default=256, metavar="PIXELS", help="width and height of the pictures")
    parser.add_argument("--samples", type=int, default=256, metavar="N", help="Cycles' samples per pixel")
    add_fit_options(parser)
    parser.add_argument("--blender", metavar="PROGRAM", help="a Blender program (default: MFO_BLENDER, bpy, PATH)")
    parser.add_argument("--json", action="store_true", help="print the outcome as one JSON object")
    parser.set_defaults(func=run)


def run(arguments: argparse.Namespace) -> int:
    """Build, render, fit, apply, render again and compare."""
    host = find_blender_host(arguments.blender)
    folder = arguments.out.absolute()
    if folder.exists() and any(folder.iterdir()):
        if not (folder / "demo.json").is_file():
            raise BadInputError(f"{folder} is not empty and not of an earlier demo: give another folder with --out.")
        _empty(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "demo.json").write_text("{}")
    begin = time.monotonic()

    def say(text: str) -> None:
        print(f"[{time.monotonic() - begin:6.1f} s] {text}", file=sys.stderr, flush=True)

    def render(blend: str, picture: str, seed: int) -> Image:
        say(f"Cycles renders {picture}")
        host.call(
            "render",
            folder / blend,
            "--out",
            folder / picture,
            "--samples",
            str(arguments.samples),
            "--seed",
            str(seed),
        )
        return read_image(folder / picture)

    say(f"building the scene ({host.name})")
    scene = host.call("demo-scene", folder, "--scene-seed", str(arguments.scene_seed), "--size", str(arguments.size))
    reference = render("truth.blend", "reference.exr", _REFERENCE_SEED)
    before = render("start.blend", "before.exr", _JUDGE_SEED)
    say("fitting the material")
    fit = fit_blend(
        host,
        folder / "start.blend",
        scene["object"],
        folder / "reference.exr",
        folder / "job",
        fit_from_options(arguments),
    )
    apply_result(host, folder / "start.blend", fit.job, folder / "recovered.blend", force=True)
    after = render("recovered.blend", "after.exr", _JUDGE_SEED)
    view = DisplayView()
    flips = [flip_error(reference, picture, display=view).mean for picture in (before, after)]
    for name, picture in (("reference", reference), ("before", before), ("after", after)):
        (folder / f"{name}.png").write_bytes(png_bytes(displayed(picture, view)))
    outcome = {
        "flip_before": flips[0],
        "flip_after": flips[1],
        "fit_seconds": fit.result["seconds"],
        "seconds": time.monotonic() - begin,
        "truth": scene["truth"],
        "recovered": fit.result["recovered"],
        "job": str(fit.job),
    }
    (folder / "demo.json").write_text(json.dumps(outcome, indent=1))
    if arguments.json:
        print(json.dumps(outcome))
        return 0
    print(f"Mean FLIP in Cycles: before {flips[0]:.4f}, after {flips[1]:.4f} ({flips[0] / flips[1]:.1f} times smaller)")
    print(f"Fit {fit.result['seconds']:.1f} s, all together {outcome['seconds']:.1f} s")
    print(f"Pictures: {folder}/reference.png before.png after.png; report: {fit.job / 'index.html'}")
    return 0


def _empty(folder: Path) -> None:
    """Remove what an earlier demo wrote."""
    import shutil

    for path in folder.iterdir():
        shutil.rmtree(path) if path.is_dir() else path.unlink()
