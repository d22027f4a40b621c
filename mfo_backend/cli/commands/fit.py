# SPDX-License-Identifier: Apache-2.0
"""`mfo fit SCENE.xml --target SHAPE_ID --reference REF`: a job folder from a Mitsuba scene, and its run."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from ...fit.settings import FitSettings
from ...job.folder.make_job import make_job
from ...job.output.protocol_stream import take_stdout
from ...job.run.fit_scene import Fitter, fit_scene
from ...metrics.display.tone_mapping import DisplayView
from ..fit_options import add_fit_options, fit_from_options
from ..main import report_error
from ..part_options import add_part_options, part_from_options
from ..result_text import result_text
from ..run_folder import run_folder
from .run import leave


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
    add_part_options(parser)
    add_fit_options(parser)
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
    settings = FitSettings.from_request(fit_from_options(arguments))
    view = None
    if arguments.exposure is not None or arguments.gamma is not None:
        view = DisplayView(arguments.exposure or 0.0, 1.0 if arguments.gamma is None else arguments.gamma)
    folder = arguments.out or _free_folder(arguments.scene)
    is_new = not folder.exists()
    part = part_from_options(arguments)
    make_job(arguments.scene, arguments.target, arguments.reference, settings, folder, view=view, part=part)
    stream = take_stdout() if arguments.json else None
    done = run_folder(folder, fitter, is_new=is_new, trusted=True)  # the user's own scene, named on the command line
    if done.result is None:
        report_error(done.status, done.sentence, stream=stream)
        return leave(done.status)
    if stream is not None:
        print(json.dumps({**done.result, "folder": str(folder)}, ensure_ascii=False), file=stream)
        stream.close()
    else:
        print(f"{result_text(done.result)}\n\nReport: {folder / 'index.html'}\n{done.sentence}")
    return leave(done.status)


def _free_folder(scene: Path) -> Path:
    number = 1
    while (folder := Path(f"mfo-{scene.stem}-{number}")).exists():
        number += 1
    return folder
