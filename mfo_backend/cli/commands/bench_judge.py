# SPDX-License-Identifier: Apache-2.0
"""`mfo bench judge DIR`: the paper's judge, HDR-VDP-3, on rows that were measured without it."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from ...bench.judge.q_jod import scored, without_score
from ...bench.rows.method import METHODS
from ...bench.rows.row import Row
from ...bench.rows.row_file import RowFile
from ...bench.scenes.assets import Assets
from ...bench.scenes.scenario import SCENARIOS
from ...job.output.progress_bar import terminal_columns
from ...job.run.stop import StopSignal
from ...metrics.judges.hdr_vdp_program import find_code, find_program
from ...types.errors import BadInputError, MfoError
from ...types.image import Pixels
from ...types.status import Status
from ..blender_host import find_blender_host


def add_judge_parser(actions) -> None:  # type: ignore[no-untyped-def]  # argparse names its class with an underscore
    """Add `mfo bench judge`."""
    parser = actions.add_parser(
        "judge",
        help="add HDR-VDP-3's score to rows that have none",
        description="Render the pictures of the rows of DIR again, from their values and seeds, and add the score of "
        "HDR-VDP-3 (MFO_HDRVDP3 names a copy, GNU Octave runs it) to those that have none. Stopped, it goes on later.",
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of a bench")
    parser.add_argument("--scenario", action="append", default=[], choices=tuple(SCENARIOS), help="again for more")
    parser.add_argument("--method", action="append", default=[], choices=tuple(METHODS), help="again for more")
    parser.set_defaults(func=run_judge)


def run_judge(arguments: argparse.Namespace) -> int:
    """Score rows a batch at a time, each batch on the disk before the next begins; returns the exit code."""
    from tqdm import tqdm

    from ...bench.runs.fit_runner import FitRunner

    find_code(), find_program()  # before anything is rendered
    file = RowFile(arguments.folder)
    left = without_score(file.read(), arguments.scenario, arguments.method)
    if not left:
        print(f"No row of {file.path} that was asked for lacks the score.", file=sys.stderr)
        return 0
    runner = FitRunner(arguments.folder / "scenes", _size(arguments.folder), Assets.find(), host=_host())
    stop = StopSignal()
    with file.only_writer(), stop.watching(), tqdm(total=len(left), unit="row", ncols=terminal_columns()) as bar:

        def pair(row: Row) -> tuple[Pixels, Pixels]:
            bar.update()  # a batch takes minutes
            return runner.judged_pair(row)

        for batch in scored(left, pair, stop.requested):
            file.replace(batch)
    return Status.CANCELLED.exit_code if stop.requested() else 0


def _host():
    try:
        return find_blender_host()
    except MfoError:
        return None


def _size(folder: Path) -> int:
    try:
        return int(json.loads((folder / "setup.json").read_text("utf-8"))["size"])
    except (OSError, ValueError, KeyError) as error:
        raise BadInputError(f"{folder} holds no bench ({error}): give the folder of `mfo bench --out`.") from None
