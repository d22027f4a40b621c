# SPDX-License-Identifier: Apache-2.0
"""`mfo batch JOB...`: many job folders, several at a time or on a cluster."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path

from ...job.batch import JobEnd, is_done, run_here, run_there
from ...job.cluster import open_client, threads_each
from ...job.output.progress_bar import terminal_columns
from ...job.run.stop import StopSignal
from ...types.errors import BadInputError
from ...types.status import Status
from ..cluster_options import add_cluster_options
from .run import add_trust_option


def add_parser(subparsers) -> None:  # type: ignore[no-untyped-def]  # argparse names its class with an underscore
    """Add `mfo batch`."""
    parser = subparsers.add_parser(
        "batch",
        help="run many job folders",
        description="Run job folders, each in a process of its own. Those with a whole result are left as they are.",
    )
    parser.add_argument("jobs", type=Path, nargs="+", metavar="JOB", help="folder with a request.json")
    parser.add_argument("--again", action="store_true", help="also run jobs that have a result")
    parser.add_argument("--json", action="store_true", help="print one JSON object a job")
    add_trust_option(parser)
    add_cluster_options(parser)
    parser.set_defaults(func=run)


def run(arguments: argparse.Namespace) -> int:
    """Run what is not done yet; the exit code is the worst of the jobs'."""
    missing = [str(job) for job in arguments.jobs if not (job / "request.json").is_file()]
    if missing:
        raise BadInputError(f"No request.json in {', '.join(missing)}: give job folders.")
    jobs = list(dict.fromkeys(str(job.absolute()) for job in arguments.jobs))
    left = [job for job in jobs if arguments.again or not is_done(Path(job))]
    print(f"{len(left)} of {len(jobs)} jobs to run", file=sys.stderr)
    stop = StopSignal()
    with stop.watching():
        if arguments.scheduler:
            with open_client(arguments.scheduler, 0) as client:
                ends = _show(run_there(left, client, stop.requested, arguments.trust), len(left), arguments.json)
        else:
            count = arguments.workers or 1
            threads = threads_each(count) if count > 1 else 0
            ends = _show(run_here(left, count, threads, stop.requested, arguments.trust), len(left), arguments.json)
    if len(ends) < len(left):
        print("mfo: stopped; the same command goes on where it was.", file=sys.stderr)
        return Status.CANCELLED.exit_code
    return max((Status(end.status).exit_code for end in ends), default=0)


def _show(ends: Iterator[JobEnd], count: int, as_json: bool) -> list[JobEnd]:
    import json

    from tqdm import tqdm

    say: Callable[[str], None] = lambda text: tqdm.write(text, file=sys.stdout)  # noqa: E731
    seen = []
    with tqdm(total=count, unit="job", disable=None, smoothing=0.0, ncols=terminal_columns(), nrows=20) as bar:
        for end in ends:
            seen.append(end)
            say(json.dumps(asdict(end)) if as_json else f"{end.job}: {end.status}, {end.seconds:.0f} s. {end.sentence}")
            bar.update()
    return seen
