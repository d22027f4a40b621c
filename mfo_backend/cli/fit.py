# SPDX-License-Identifier: Apache-2.0
"""`mfo fit SCENE.xml --target SHAPE_ID --reference REF`: a job folder from a Mitsuba scene, and its run."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from ..fit.settings import FitSettings
from ..job.fit_scene import Fitter, fit_scene
from ..job.make_job import make_job
from ..job.progress import EventWriter
from ..job.protocol_stream import take_stdout
from ..job.run_job import run_job
from ..job.stop import StopSignal
from ..metrics.tone_mapping import DisplayView
from .main import report_error
from .result_text import result_text
from .run import leave

_SETTINGS = ("model", "preset", "parameters", "range", "seed", "max_iterations", "spp", "keep_optimizer_state")


def add_parser(subparsers) -> None:  # type: ignore[no-untyped-def]  # argparse names its class with an underscore
    """Add `mfo fit`."""
    parser = subparsers.add_parser(
        "fit",
        help="fit a material of a Mitsuba scene",
        description="Recover the material of one shape of a Mitsuba scene from a reference picture.",
    )
    parser.add_argument("scene", type=Path, metavar="SCENE.xml", help="Mitsuba 3 scene")
    parser.add_argument("--target", required=True, metavar="SHAPE_ID", help="id of the shape with the material")
    parser.add_argument("--reference", required=True, type=Path, metavar="REF", help="EXR, HDR, PNG, JPEG or TIFF")
    parser.add_argument("--preset", help="method of the fit (default: paper)")
    parser.add_argument("--model", help="material model (default: mitsuba_principled)")
    parser.add_argument("--parameters", help="'all', 'reduced' or names separated by commas (default: all)")
    parser.add_argument("--range", help="'ldr' or 'hdr' losses (default: hdr for a linear reference, else ldr)")
    parser.add_argument("--seed", type=int, help="random numbers (default: 0)")
    parser.add_argument("--max-iterations", type=int, help="of each stage (default: 300)")
    parser.add_argument("--spp", type=int, help="samples per pixel of an iteration (default: 16)")
    parser.add_argument("--keep-optimizer-state", action="store_const", const=True, help="between the stages")
    parser.add_argument("--exposure", type=float, metavar="EV", help="of the view a display reference was made with")
    parser.add_argument("--gamma", type=float, help="of that view (default: 1)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="new folder of the job (default: mfo-SCENE-1, ...)")
    parser.add_argument("--json", action="store_true", help="print the result as one JSON object")
    parser.set_defaults(func=run)


def run(arguments: argparse.Namespace) -> int:
    """Make the job and run it."""
    return work(arguments, fit_scene)


def work(arguments: argparse.Namespace, fitter: Fitter) -> int:
    """Make the job and run it with a given fit; returns the exit code."""
    given = {name: getattr(arguments, name) for name in _SETTINGS if getattr(arguments, name) is not None}
    settings = FitSettings.from_request(given | _parameters(arguments.parameters))
    view = None
    if arguments.exposure is not None or arguments.gamma is not None:
        view = DisplayView(arguments.exposure or 0.0, 1.0 if arguments.gamma is None else arguments.gamma)
    folder = arguments.out or _free_folder(arguments.scene)
    make_job(arguments.scene, arguments.target, arguments.reference, settings, folder, view=view)
    stream = take_stdout() if arguments.json else None
    events = EventWriter(bar=True)
    stop = StopSignal(cancel_file=folder / "cancel")
    with stop.watching():
        status = run_job(folder, events, stop, fitter=fitter)
    if not (folder / "result.json").exists():
        report_error(status, events.last_sentence, stream=stream)
        return leave(status)
    result = json.loads((folder / "result.json").read_text("utf-8"))
    if stream is not None:
        print(json.dumps(result | {"folder": str(folder)}, ensure_ascii=False), file=stream)
        stream.close()
    else:
        print(f"{result['sentence']}\n\n{result_text(result)}\n\nReport: {folder / 'index.html'}")
    return leave(status)


def _parameters(text: str | None) -> dict[str, Any]:
    if text is None:
        return {}
    if text in ("all", "reduced"):
        return {"parameters": text}
    return {"parameters": tuple(name.strip() for name in text.split(",") if name.strip())}


def _free_folder(scene: Path) -> Path:
    number = 1
    while (folder := Path(f"mfo-{scene.stem}-{number}")).exists():
        number += 1
    return folder
